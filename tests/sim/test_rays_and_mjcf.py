"""Rays against closed forms; MJCF files as they are."""

import numpy as np
import pytest

from roboyard.errors import DescriptionError, RoboyardError
from roboyard.sim import World


def test_a_ray_returns_the_link_it_hits():
    world = World()
    world.add_plane()
    ball = world.add_sphere(0.5, (0, 0, 2), mass=0)
    hit = world.ray((0, 0, 5), (0, 0, -1))
    assert hit.body is ball and hit.link.name == "base"
    np.testing.assert_allclose(hit.position, [0, 0, 2.5], atol=1e-9)
    np.testing.assert_allclose(hit.normal, [0, 0, 1], atol=1e-9)
    assert hit.fraction == pytest.approx(2.5 / 6) and hit.distance == pytest.approx(2.5)
    assert world.ray((5, 5, 5), (5, 5, 4)) is None


def test_rays_without_length_hit_nothing_and_others_still_do():
    """MuJoCo ends the process for a direction without length."""
    world = World()
    world.add_sphere(0.5, (0, 0, 2), mass=0)
    starts = [(0, 0, 0), (0, 0, 0), (0, 0, 2), (0, 0, 0)]
    ends = [(0, 0, 3), (0, 0, 0), (0, 0, 2), (0, 0, 1e-310)]
    hits = world.rays(starts, ends)
    np.testing.assert_array_equal(hits.hit, [True, False, False, False])
    np.testing.assert_allclose(hits.position[0], [0, 0, 1.5], atol=1e-9)
    assert world.ray((1, 1, 1), (1, 1, 1)) is None
    assert not world.rays([(0, 0, 0)], [(0, 0, 0), (0, 0, 1)]).hit.any()


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1.7e308])
def test_rays_that_are_not_finite_are_refused(wrong):
    world = World()
    world.add_sphere(0.5, (0, 0, 2), mass=0)
    with pytest.raises(RoboyardError, match=r"ray 1: .* must be finite"):
        world.rays([(0, 0, 0), (-wrong, 0, 0)], [(0, 0, 3), (wrong, 0, 3)])


@pytest.mark.parametrize("shared", [True, False])
def test_batches_agree_with_single_rays(shared):
    world = World()
    world.add_plane()
    for k in range(8):
        world.add_box((0.3, 0.4, 0.5), (np.cos(k), np.sin(k), 0.4), (0, 0, np.sin(k), np.cos(k)), mass=0)
    rng = np.random.default_rng(1)
    starts = np.array([[0.0, 0.0, 1.5]]) if shared else rng.uniform((-1, -1, 1), (1, 1, 2), (60, 3))
    ends = rng.uniform(-2, 2, (60, 3)) * (1, 1, 0) + (0, 0, -0.5)
    hits = world.rays(starts, ends)
    for i, end in enumerate(ends):
        one = world.ray(starts[0] if shared else starts[i], end)
        assert (one is not None) == hits.hit[i]
        if one is not None:
            np.testing.assert_allclose(hits.position[i], one.position, atol=1e-12)
            assert hits.owners[i, 0] == one.body.id
    assert hits.hit.sum() > 50


def test_misses_end_at_the_end():
    hits = World().rays((0, 0, 0), [(1, 0, 0), (0, 2, 0)])
    np.testing.assert_array_equal(hits.owners, -1)
    np.testing.assert_array_equal(hits.fraction, 1.0)
    np.testing.assert_array_equal(hits.position, [(1, 0, 0), (0, 2, 0)])


MJCF = """<mujoco model="cart"><option timestep=".01" integrator="RK4" gravity="0 0 -1"/>
<worldbody><geom type="plane" size="5 5 .1"/>
<body name="cart" pos="0 0 .5"><joint name="rail" type="slide" axis="1 0 0"/>
<geom type="box" size=".1 .1 .1"/>
<body name="pole"><joint name="pivot" axis="0 1 0" range="-90 90"/>
<geom type="capsule" fromto="0 0 0 0 0 .5" size=".02"/></body></body>
<body name="ball" pos="2 0 1"><freejoint/><geom size=".1"/></body></worldbody>
<actuator><motor name="push" joint="rail" gear="3"/></actuator></mujoco>"""


def test_mjcf_files_add_their_bodies_and_actuators(tmp_path):
    path = tmp_path / "cart.xml"
    path.write_text(MJCF)
    world = World()
    ground, cart, ball = world.add_mjcf(path)
    assert [joint.name for joint in cart.joints] == ["rail", "pivot"]
    assert world.model.nu == 1
    assert world.model.opt.timestep == world.timestep and world.model.opt.gravity[2] == -9.81
    cart.joint("rail").position = 0.4
    np.testing.assert_allclose(cart.link("pole").pose[0], [0.4, 0, 0.5], atol=1e-9)
    assert cart.joint("pivot").limits == pytest.approx((-np.pi / 2, np.pi / 2))
    world.step(480)
    assert ball.position[2] == pytest.approx(0.1, abs=1e-2)
    assert {c.body_b.id for c in world.contacts(ball)} == {ground.id}
    assert len(world.render_scene().shapes) == 4


def test_a_broken_mjcf_names_the_file(tmp_path):
    path = tmp_path / "broken.xml"
    path.write_text("<mujoco><worldbody><geom size='-1'/></worldbody></mujoco>")
    with pytest.raises(DescriptionError, match=r"broken\.xml"):
        World().add_mjcf(path)


def test_a_body_of_several_joints_has_a_handle_for_each():
    xml = """<mujoco><worldbody><body name="arm" pos="0 0 1"><joint name="yaw" axis="0 0 1"/>
    <joint name="pitch" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 1 0 0" size=".05"/></body>
    </worldbody></mujoco>"""
    world = World(gravity=(0, 0, 0))
    (arm,) = world.add_mjcf(xml)
    assert arm.joint_names == ("yaw", "pitch")
    arm.joint_positions = [np.pi / 2, 0.0]
    hit = world.ray((0, 0.5, 3), (0, 0.5, 0))
    assert hit.link.name == "arm" and hit.position[2] == pytest.approx(1.05)
