"""Building a description: masses, frames, filters, shapes."""

import numpy as np
import pytest
from sim_robots import angle_between, arm, loose, pendulum, rod

from roboyard.description.mass_properties import mass_properties, possible_moments
from roboyard.description.model import (
    Box,
    Collision,
    Contact,
    Inertial,
    Joint,
    Link,
    Mesh,
    Pose,
    RobotDescription,
    Visual,
)
from roboyard.errors import RoboyardError
from roboyard.shapes import primitives
from roboyard.sim import World
from roboyard.transforms import quaternion_from_rpy


def test_full_tensors_keep_their_mass_matrix():
    rng = np.random.default_rng(0)
    a = rng.normal(size=(3, 3))
    tensor = a @ a.T
    tensor = (np.trace(tensor) * np.eye(3) - tensor) * 0.01
    quaternion = quaternion_from_rpy((0.3, -0.2, 0.9))
    inertial = Inertial(
        mass=2.0,
        origin=Pose(position=(0.1, 0.2, 0.3), quaternion=tuple(quaternion)),
        inertia=(tensor[0, 0], tensor[0, 1], tensor[0, 2], tensor[1, 1], tensor[1, 2], tensor[2, 2]),
    )
    world = World(gravity=(0, 0, 0))
    body = world.add_urdf(loose("thing", inertial))
    world.kinematics()
    row = body.mujoco_ids[0]
    r = world.data.ximat[row].reshape(3, 3)
    from roboyard.transforms import matrix_from_quaternion

    expected = matrix_from_quaternion(quaternion) @ tensor @ matrix_from_quaternion(quaternion).T
    np.testing.assert_allclose(r @ np.diag(world.model.body_inertia[row]) @ r.T, expected, atol=1e-12)
    np.testing.assert_allclose(body.center_of_mass, [0.1, 0.2, 0.3], atol=1e-12)


@pytest.mark.parametrize(
    ("moments", "problem"),
    [
        ((1.0, 1.0, 1.0), None),
        ((1.0, 1.0, 2.0), None),
        ((1.0, 1.0, 2.5), "triangle"),
        ((-1.0, 1.0, 1.0), "positive"),
        ((0.0, 0.0, 0.0), "positive"),
    ],
)
def test_impossible_moments_are_raised_to_the_nearest_possible(moments, problem):
    found, note = possible_moments(np.array(moments))
    assert (found > 0).all()
    assert 2 * found.max() <= found.sum() * (1 + 1e-12)
    assert found.max() >= max(moments)
    assert (note is None) == (problem is None)
    if problem is None:
        np.testing.assert_array_equal(found, moments)
    else:
        assert problem in note


def test_negative_mass_counts_as_zero():
    found = mass_properties(Inertial(mass=-1.0))
    assert found.mass == 0.0 and "negative" in found.note


def test_massless_moving_links_change_nothing():
    def period_angle(description):
        world = World(timestep=1e-3)
        body = world.add_urdf(description, fixed_base=True)
        body.joint("hinge").position = 0.5
        world.step(500)
        return body.joint("hinge").position

    plain = pendulum()
    ghost = Joint(name="ghost_joint", type="continuous", parent="rod", child="ghost", axis=(1, 0, 0))
    haunted = RobotDescription(
        name="haunted", links=(*plain.links, Link(name="ghost")), joints=(*plain.joints, ghost)
    )
    assert period_angle(haunted) == pytest.approx(period_angle(plain), abs=1e-5)
    body = World().add_urdf(haunted, fixed_base=True)
    assert body.link("ghost").mass == 0.0
    assert any("ghost" in note for note in body.notes)


def test_every_link_stays_a_body_behind_fixed_joints():
    description = RobotDescription(
        name="chain",
        links=(rod("a"), rod("b"), rod("c")),
        joints=(
            Joint(name="ab", type="fixed", parent="a", child="b", origin=Pose(position=(1, 0, 0))),
            Joint(name="bc", type="fixed", parent="b", child="c", origin=Pose(position=(0, 1, 0))),
        ),
    )
    world = World()
    body = world.add_urdf(description, (0, 0, 5))
    assert [link.name for link in body.links] == ["a", "b", "c"]
    np.testing.assert_allclose(body.link("c").pose[0], [1, 1, 5])
    assert body.mass == pytest.approx(3.0)
    assert world.model.nbody == 4


def _two_boxes(gap: float) -> RobotDescription:
    def link(name):
        return rod(name, collisions=(Collision(geometry=Box(size=(0.2, 0.2, 0.2))),))

    middle = Link(name="middle", inertial=Inertial(mass=0.1, inertia=(1e-3, 0, 0, 1e-3, 0, 1e-3)))
    return RobotDescription(
        name="twins",
        links=(link("one"), middle, link("two")),
        joints=(
            Joint(name="a", type="continuous", parent="one", child="middle", axis=(0, 0, 1)),
            Joint(
                name="b",
                type="prismatic",
                parent="middle",
                child="two",
                axis=(1, 0, 0),
                origin=Pose(position=(gap, 0, 0)),
            ),
        ),
    )


@pytest.mark.parametrize("self_collision", [False, True])
def test_self_collision_is_optional(self_collision):
    world = World(gravity=(0, 0, 0))
    world.add_urdf(_two_boxes(0.15), self_collision=self_collision)
    world.step()
    assert bool(world.contacts()) == self_collision


def test_more_robots_than_bits_avoid_self_collision_and_touch_others():
    world = World(gravity=(0, 0, 0))
    robots = [world.add_urdf(_two_boxes(0.15), (5.0 * k, 0, 0)) for k in range(33)]
    world.step()
    assert world.contacts() == []
    robots[32].set_pose((0.05, 0.15, 0))
    world.step()
    assert {c.body_b.id for c in world.contacts(robots[32])} == {robots[0].id}


def test_every_pair_of_robots_can_touch():
    world = World(gravity=(0, 0, 0))
    robots = [world.add_urdf(_two_boxes(0.15), (5.0 * k, 0, 0)) for k in range(7)]
    for k, robot in enumerate(robots):
        for other in robots[:k]:
            place = other.position
            other.set_pose(robot.position + np.array([0.05, 0.15, 0.0]))
            world.detect_contacts()
            pairs = {frozenset((c.body_a.id, c.body_b.id)) for c in world.contacts(robot)}
            assert pairs == {frozenset((robot.id, other.id))}
            other.set_pose(place)


def test_pairs_can_be_switched_off():
    world = World()
    floor, box = world.add_plane(), world.add_box((0.2, 0.2, 0.2), (0, 0, 0.2))
    world.filters.set(floor.links[0], box.links[0], collide=False)
    world.step(240)
    assert box.position[2] < -1
    world.filters.set(floor.links[0], box.links[0], collide=True)
    box.set_pose((0, 0, 0.2))
    world.step(240)
    assert box.position[2] == pytest.approx(0.1, abs=1e-3)


def test_mirrored_and_scaled_meshes_collide_where_they_are_rendered():
    half = primitives.box(0.5, 0.5, 0.5)
    shape = Mesh(uri="", path=None, data=half, scale=(-2.0, 0.5, 1.0))
    link = Link(
        name="base",
        inertial=Inertial(mass=1, inertia=(1, 0, 0, 1, 0, 1)),
        visuals=(Visual(geometry=shape, origin=Pose(position=(1, 0, 0))),),
        collisions=(Collision(geometry=shape, origin=Pose(position=(1, 0, 0))),),
    )
    world = World(gravity=(0, 0, 0))
    body = world.add_urdf(RobotDescription(name="m", links=(link,)), scale=2.0)
    np.testing.assert_allclose(body.bounds, [[0, -0.5, -1], [4, 0.5, 1]], atol=1e-6)
    assert world.ray((2, 0, 5), (2, 0, -5)).position[2] == pytest.approx(1.0, abs=1e-6)
    assert body.mass == pytest.approx(8.0)


def test_flat_meshes_collide():
    quad = primitives.plane(1.0, 1.0)
    world = World()
    world.add_mesh(quad, mass=0)
    ball = world.add_sphere(0.1, (0.3, 0.2, 0.3))
    world.step(240)
    assert ball.position[2] == pytest.approx(0.1, abs=2e-3)


def test_a_mesh_has_the_mass_properties_of_its_solid_hull():
    world = World(gravity=(0, 0, 0))
    box = world.add_mesh(primitives.box(0.1, 0.2, 0.3), mass=3.0)
    world.kinematics()
    moments = world.model.body_inertia[box.mujoco_ids[0]]
    expected = 3.0 / 12 * np.array([0.4**2 + 0.6**2, 0.2**2 + 0.6**2, 0.2**2 + 0.4**2])
    np.testing.assert_allclose(np.sort(moments), np.sort(expected), rtol=1e-5)


def test_heightfields_are_indexed_x_first():
    heights = np.zeros((11, 21))
    heights[8:, :] = 0.5
    world = World()
    world.add_heightfield(heights, (0.1, 0.1), (1, 2, 0))
    assert world.ray((1.45, 2, 5), (1.45, 2, -5)).position[2] == pytest.approx(0.5, abs=1e-5)
    assert world.ray((0.6, 2.9, 5), (0.6, 2.9, -5)).position[2] == pytest.approx(0.0, abs=1e-5)
    ball = world.add_sphere(0.1, (1.45, 2, 1))
    world.step(300)
    assert ball.position[2] == pytest.approx(0.6, abs=2e-3)


def test_contact_settings_of_the_file_are_applied():
    link = Link(
        name="base",
        inertial=Inertial(mass=1, inertia=(1, 0, 0, 1, 0, 1)),
        collisions=(Collision(geometry=Box(size=(1, 1, 1))),),
        contact=Contact(lateral_friction=0.3, rolling_friction=0.01, restitution=0.6),
    )
    world = World()
    body = world.add_urdf(RobotDescription(name="b", links=(link,)))
    assert body.links[0].friction == pytest.approx(0.3)
    assert body.links[0].restitution == pytest.approx(0.6)
    geom = body.links[0].geom_ids[0]
    assert world.model.geom_condim[geom] == 6
    np.testing.assert_allclose(world.model.geom_friction[geom], [0.3, 0.005, 0.01])


def test_visual_and_collision_geoms_have_their_groups():
    link = Link(
        name="base",
        visuals=(Visual(geometry=Box(size=(1, 1, 1))),),
        collisions=(Collision(geometry=Box(size=(1, 1, 1))),),
    )
    world = World()
    world.add_urdf(RobotDescription(name="b", links=(link,)), fixed_base=True)
    assert sorted(world.model.geom_group.tolist()) == [2, 3]
    lean = World(visual_geoms=False)
    lean.add_urdf(RobotDescription(name="b", links=(link,)), fixed_base=True)
    assert lean.model.geom_group.tolist() == [3]


def test_scaled_robots_have_scaled_lengths_and_cubed_masses():
    world = World()
    body = world.add_urdf(arm(), fixed_base=True, scale=2.0)
    np.testing.assert_allclose(body.link("left").pose[0], [0, 0, -4], atol=1e-12)
    assert body.link("upper").mass == pytest.approx(8.0)
    assert body.joint("left_finger").limits == (0.0, 0.1)
    assert angle_between(body.link("left").pose[1], np.array([0, 0, 0, 1.0])) < 1e-9


def test_bounds_of_rotated_meshes_are_tight():
    quaternion = quaternion_from_rpy((0.4, 0.7, 0.2))
    world = World(gravity=(0, 0, 0))
    ball = primitives.sphere(0.5, 64)
    body = world.add_mesh(ball, (1, 2, 3), quaternion, scale=(1, 2, 1))
    from roboyard.transforms import matrix_from_quaternion

    points = (ball.vertices * (1, 2, 1)) @ matrix_from_quaternion(quaternion).T + (1, 2, 3)
    np.testing.assert_allclose(body.bounds, [points.min(axis=0), points.max(axis=0)], atol=1e-5)


def test_a_fixed_base_can_be_freed():
    world = World()
    description = RobotDescription(
        name="crate",
        links=(
            Link(
                name="base",
                inertial=Inertial(mass=2, inertia=(1, 0, 0, 1, 0, 1)),
                collisions=(Collision(geometry=Box(size=(1, 1, 1))),),
            ),
        ),
    )
    crate = world.add_description(description, (0, 0, 5), fixed_base=True)
    ball = world.add_sphere(0.1, (3, 0, 1))
    world.step(10)
    dropped = ball.position[2]
    crate.free_base()
    world.step(100)
    t = 100 * world.timestep
    assert crate.position[2] == pytest.approx(5 - 9.81 * t * (t + world.timestep) / 2, rel=1e-9)
    assert ball.position[2] < dropped and not crate.is_fixed
    crate.free_base()
    ground = world.add_plane()
    with pytest.raises(RoboyardError, match="infinite"):
        ground.free_base()
