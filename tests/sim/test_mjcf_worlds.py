"""MJCF files in a world, against MuJoCo's own reading of the same text."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from roboyard.errors import DescriptionError, RoboyardError
from roboyard.sim import World

DEFAULTS = """<mujoco model="defaults">
<default><joint damping="0.3" armature="0.02"/><geom density="500"/>
<default class="stiff"><joint stiffness="4" springref="0.2" frictionloss="0.05"/></default></default>
<worldbody><body name="a" pos="0 0 2"><joint name="h" axis="0 1 0"/>
<geom type="box" size="0.1 0.1 0.3" pos="0 0 -0.3"/>
<body name="b" pos="0 0 -0.6" childclass="stiff"><joint name="k" axis="1 0 0"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.04"/></body></body></worldbody></mujoco>"""
ACTUATORS = """<mujoco model="acts"><compiler angle="radian" autolimits="true"/>
<worldbody><body name="cart" pos="0 0 1"><joint name="rail" type="slide" axis="1 0 0" range="-2 2"/>
<geom type="box" size="0.1 0.1 0.1" mass="2"/><body name="pole"><joint name="pivot" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 0 0 0.5" size="0.02" mass="0.3"/></body></body></worldbody>
<actuator><position name="p" joint="rail" kp="30" kv="5" ctrlrange="-1 1"/>
<motor name="m" joint="pivot" gear="2" forcerange="-1 1"/><velocity joint="pivot" kv="0.1"/></actuator>
<sensor><jointpos joint="rail"/><jointvel joint="pivot"/><framepos objtype="body" objname="pole"/></sensor>
</mujoco>"""
COUPLED = """<mujoco model="coupled"><option timestep="0.02" gravity="1 2 3" integrator="RK4"/>
<worldbody><body name="l" pos="0 0 1"><joint name="one" type="slide" axis="0 0 1"/>
<geom type="sphere" size="0.1" mass="1"/></body><body name="r" pos="1 0 1">
<joint name="two" type="slide" axis="0 0 1"/><geom type="sphere" size="0.1" mass="2"/></body>
<body name="free" pos="3 0 1"><freejoint/><geom type="ellipsoid" size="0.1 0.2 0.3"/></body></worldbody>
<tendon><fixed name="t"><joint joint="one" coef="1"/><joint joint="two" coef="-1"/></fixed></tendon>
<equality><joint joint1="one" joint2="two" polycoef="0 -1 0 0 0"/></equality>
<actuator><motor tendon="t" gear="1"/></actuator></mujoco>"""
BALLS = """<mujoco model="balls"><worldbody><body name="top" pos="0 0 3">
<joint name="socket" type="ball" damping="0.1"/>
<geom type="cylinder" size="0.05 0.4" pos="0.3 0 -0.4"/></body>
<geom name="floor" type="plane" size="5 5 1"/><body name="drop" pos="2 0 0.5"><freejoint/>
<geom type="box" size="0.1 0.2 0.05" friction="0.4"/></body></worldbody></mujoco>"""
TEXTS = {"defaults": DEFAULTS, "actuators": ACTUATORS, "coupled": COUPLED, "balls": BALLS}
FIELDS = [
    *("body_mass", "body_inertia", "body_ipos", "jnt_type", "jnt_axis", "jnt_range", "jnt_stiffness"),
    *("dof_damping", "dof_armature", "dof_frictionloss", "geom_type", "geom_size", "geom_friction"),
    *("actuator_gainprm", "actuator_biasprm", "actuator_gear", "actuator_ctrlrange", "actuator_forcerange"),
    *("sensor_type", "eq_type", "eq_data", "qpos0", "qpos_spring"),
]


def own_model(text: str, world: World) -> mujoco.MjModel:
    """MuJoCo's model of the text with the world's options."""
    spec = mujoco.MjSpec.from_string(text)
    spec.option = world.spec.option
    model = spec.compile()
    for name in (
        "timestep",
        "integrator",
        "solver",
        "iterations",
        "tolerance",
        "cone",
        "impratio",
        "ls_iterations",
    ):
        setattr(model.opt, name, getattr(world.model.opt, name))
    model.opt.gravity[:] = world.model.opt.gravity
    model.opt.disableflags, model.opt.enableflags = world.model.opt.disableflags, world.model.opt.enableflags
    return model


@pytest.mark.parametrize("name", TEXTS)
def test_the_model_holds_the_values_that_mujoco_reads(name: str) -> None:
    world = World()
    world.add_mjcf(TEXTS[name])
    own = mujoco.MjModel.from_xml_string(TEXTS[name])
    for field in FIELDS:
        np.testing.assert_allclose(
            getattr(world.model, field), getattr(own, field), atol=1e-12, err_msg=field
        )


@pytest.mark.parametrize("name", TEXTS)
def test_the_motion_is_that_of_mujoco_alone_with_the_options_of_the_world(name: str) -> None:
    world = World(timestep=1 / 500)
    world.add_mjcf(TEXTS[name])
    model = own_model(TEXTS[name], world)
    data = mujoco.MjData(model)
    data.qvel[:] = world.data.qvel[:] = np.linspace(-0.5, 0.5, model.nv)
    data.ctrl[:] = world.data.ctrl[:] = np.linspace(0.2, 0.4, model.nu)
    mujoco.mj_step(model, data, 200)
    world.step(200)
    np.testing.assert_allclose(world.data.qpos, data.qpos, atol=1e-9)
    np.testing.assert_allclose(world.data.qvel, data.qvel, atol=1e-8)
    np.testing.assert_allclose(world.data.sensordata, data.sensordata, atol=1e-8)


def test_options_of_the_file_do_not_change_the_world() -> None:
    world = World(timestep=0.004, gravity=(0, 0, -2))
    world.add_mjcf(COUPLED)
    assert world.model.opt.timestep == 0.004
    np.testing.assert_array_equal(world.model.opt.gravity, (0, 0, -2))
    free = world.body("coupled/free")
    world.step(100)
    assert free.velocity[0] == pytest.approx((0, 0, -2 * 0.4), abs=1e-12)


def test_an_offset_moves_fixed_jointed_and_free_bodies_alike() -> None:
    plain, moved = World(), World()
    plain.add_mjcf(BALLS)
    moved.add_mjcf(BALLS, (1, -2, 0.5))
    for name in ("balls/top", "balls/drop"):
        np.testing.assert_allclose(moved.body(name).position - plain.body(name).position, (1, -2, 0.5))
    hit = moved.ray((0, 0, 2), (0, 0, -2))
    assert hit is not None
    assert hit.position[2] == pytest.approx(0.5)


def test_two_copies_of_a_file_have_names_of_their_own_and_move_apart() -> None:
    world = World(gravity=(0, 0, 0))
    first, second = (world.add_mjcf(ACTUATORS, (0, y, 0))[0] for y in (0.0, 3.0))
    assert len({body.name for body in world.bodies}) == 2
    first.joint("rail").velocity = 1.0
    world.step(24)
    assert 0.05 < first.joint("rail").position < 0.1  # the position actuator's kv slows it
    assert second.joint("rail").position == 0.0
    world.remove(first)
    world.step(1)
    assert world.model.nu == 3
    assert second.joint("pivot").limits is None
    assert second.joint("rail").limits == (-2, 2)


def test_an_mjcf_body_touches_a_robot_of_the_world() -> None:
    world = World()
    world.add_mjcf(BALLS)
    box = world.add_box((0.2, 0.2, 0.2), (0, 4, 0.1))
    world.step(100)
    touching = {side.name for contact in world.contacts(box) for side in (contact.body_a, contact.body_b)}
    assert touching == {box.name, "balls"}


BODY = "<body><joint type='slide'/><geom size='.1'/>"


@pytest.mark.parametrize(
    "inside",
    [
        f"{BODY}{BODY}</body></body>{BODY}</body>{BODY}</body>",
        f'<body name="body1"><geom size=".1"/></body>{BODY}</body>',
    ],
)
def test_unnamed_bodies_and_joints_get_names_of_their_own(inside: str) -> None:
    world = World()
    bodies = world.add_mjcf(f"<mujoco><worldbody>{inside}</worldbody></mujoco>")
    assert len({body.name for body in bodies}) == len(bodies)
    names = [name for body in bodies for name in body.joint_names]
    assert len(names) == len(set(names)) == inside.count("slide")
    world.step(1)


@pytest.mark.parametrize("name", TEXTS)
def test_masses_are_those_that_mujoco_computes(name: str) -> None:
    world = World()
    bodies = world.add_mjcf(TEXTS[name])
    own = mujoco.MjModel.from_xml_string(TEXTS[name])
    for body in bodies:
        top = body.name.partition("/")[2]
        assert body.mass == pytest.approx(own.body(top).subtreemass[0] if top else 0.0, rel=1e-9)
        for link in body.links:
            if link.mass > 0:
                assert link.mass == pytest.approx(own.body(link.name).mass[0])


REFUSED = {
    "no xml": "<mujoco",
    "an unknown element": "<mujoco><worldbody><bodi/></worldbody></mujoco>",
    "an unknown attribute": "<mujoco><worldbody><geom sise='1'/></worldbody></mujoco>",
    "a joint on no body": "<mujoco><worldbody><joint/></worldbody></mujoco>",
    "a massless moving body": "<mujoco><worldbody><body><freejoint/></body></worldbody></mujoco>",
    "an actuator of no joint": "<mujoco><worldbody/><actuator><motor joint='x'/></actuator></mujoco>",
    "a mesh that is not there": "<mujoco><asset><mesh file='gone.stl'/></asset><worldbody/></mujoco>",
    "one name twice": "<mujoco><worldbody><body name='a'/><body name='a'/></worldbody></mujoco>",
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_mujoco_refuses_is_refused_with_its_name_and_the_world_is_as_before(
    name: str, tmp_path: Path
) -> None:
    world = World()
    box = world.add_box((1, 1, 1), (0, 0, 1))
    file = tmp_path / "bad.xml"
    file.write_text(REFUSED[name])
    with pytest.raises(DescriptionError, match=r"^bad\.xml:(1:)? "):
        world.add_mjcf(file)
    with pytest.raises(
        DescriptionError, match=r"^(MuJoCo cannot read it: |not well-formed XML|<mesh>: .*no such file)"
    ):
        world.add_mjcf(REFUSED[name].replace("<mujoco", "<mujoco "))
    assert world.bodies == (box,)
    world.step(10)
    assert world.model.nbody == 2


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RoboyardError, match=r"gone\.xml"):
        World().add_mjcf(tmp_path / "gone.xml")


def test_meshes_beside_the_file_are_found(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    text = trimesh.creation.box((2, 1, 0.5), np.eye(4)).apply_translation((1, 0, 0)).export(file_type="obj")
    (tmp_path / "parts" / "cube.obj").write_text(text)
    (tmp_path / "scene.xml").write_text(
        '<mujoco model="m"><compiler meshdir="parts"/><asset><mesh name="c" file="cube.obj"/></asset>'
        '<worldbody><body name="b"><freejoint/><geom type="mesh" mesh="c" density="100"/></body></worldbody>'
        "</mujoco>"
    )
    world = World()
    (body,) = world.add_mjcf(tmp_path / "scene.xml")
    assert body.mass == pytest.approx(100, rel=1e-6)
    np.testing.assert_allclose(body.center_of_mass, (1, 0, 0), atol=1e-6)
