"""Robots on two driven wheels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import Box, Collision, Pose
from roboyard.robots import REGISTERED_ROBOTS, Robot, add_robot, parse_definition
from roboyard.robots.stability.wheels import extent_along
from roboyard.sim import World


@pytest.fixture
def rover() -> Robot:
    world = World()
    world.add_plane()
    return add_robot(world, "rover")


def drive(robot: Robot, twist, seconds: float) -> tuple[float, float]:
    """Mean forward speed and turning rate over the drive."""
    action = robot.controllers["base"].scaling.invert(np.array(twist, float))
    seen = []
    for _ in range(round(seconds * 30)):
        robot.apply_action(action)
        robot.world.step(8)
        linear, angular = robot.velocity_in_base
        seen.append((linear[0], angular[2]))
    v, w = np.mean(seen, axis=0)
    return float(v), float(w)


@pytest.mark.parametrize("twist", [(0.3, 0.0), (0.5, 0.5), (0.0, 1.0), (-0.3, 0.4), (0.1, 0.0), (0.8, -1.0)])
def test_twists_are_followed_within_two_per_cent(rover: Robot, twist) -> None:
    drive(rover, twist, 1.0)
    v, w = drive(rover, twist, 2.0)
    assert v == pytest.approx(twist[0], rel=0.02, abs=0.003)
    assert w == pytest.approx(twist[1], rel=0.02, abs=0.003)
    assert rover.two_wheel.odometry() == pytest.approx((v, w), rel=0.02, abs=0.003)


def spoiled(caster: bool = True) -> Robot:
    """The rover as vendors ship robots: a hull with a margin down to the floor, hubs that reach inwards,
    resistance in the wheels for another simulator.
    """
    registered = REGISTERED_ROBOTS["rover"]
    definition = registered.definition
    if caster:
        names = ("left_wheel", "right_wheel", "caster")
        block = definition.locomotion.model_copy(update={"floor_touching_base_link_names": names})
        definition = definition.model_copy(update={"locomotion": block})
    plain = registered.description(definition)
    hull = Collision(geometry=Box(size=(0.4, 0.2, 0.2)), origin=Pose(position=(0, 0, 0.1)))
    links = []
    for link in plain.links:
        if link.name == "base_link":
            link = replace(link, collisions=(hull,))
        if link.name in ("left_wheel", "right_wheel"):
            inside = -0.05 if link.name == "left_wheel" else 0.05
            hub = Collision(geometry=Box(size=(0.02, 0.06, 0.02)), origin=Pose(position=(0.0, inside, 0.0)))
            links.append(replace(link, collisions=(*link.collisions, hub)))
            continue
        links.append(link)
    joints = tuple(
        replace(j, limit=None, damping=20.0, friction=10.0) if j.type == "continuous" else j
        for j in plain.joints
    )
    world = World()
    world.add_plane()
    return add_robot(world, replace(plain, links=tuple(links), joints=joints), definition=definition)


@pytest.mark.parametrize("twist", [(0.3, 0.0), (-0.1, 0.0), (0.0, 1.0), (0.2, -0.4)])
def test_twists_are_followed_by_a_robot_with_vendor_shapes(twist) -> None:
    robot = spoiled()
    drive(robot, twist, 1.0)
    assert drive(robot, twist, 2.0) == pytest.approx(twist, rel=0.02, abs=0.003)


def test_hulls_are_trimmed_above_the_floor_where_wheels_support_the_robot() -> None:
    cut, kept = (spoiled(caster).description.link_by_name["base_link"] for caster in (True, False))
    assert extent_along(replace(cut, visuals=()), (0, 0, 1)) == pytest.approx(
        (0.03, 0.2)
    )  # what is seen ends there
    assert extent_along(replace(kept, visuals=()), (0, 0, 1)) == (
        0.0,
        0.2,
    )  # the definition does not list the caster


def test_wheel_friction_does_not_shake_a_robot_at_rest() -> None:
    robot = spoiled()
    speeds = []
    for _ in range(45):
        robot.apply_action(np.zeros(2))
        robot.world.step(8)
        speeds.append(np.abs(robot.joint_velocities).max())
    assert max(speeds[15:]) < 1e-3


def test_a_full_circle_returns_to_its_start(rover: Robot) -> None:
    drive(rover, (0.4, 0.8), 0.5)
    start = rover.position
    drive(rover, (0.4, 0.8), 2 * np.pi / 0.8)
    assert np.linalg.norm((rover.position - start)[:2]) < 0.03


def test_it_floats_supported_by_wheels_and_caster(rover: Robot) -> None:
    assert not rover.body.is_fixed
    for _ in range(60):
        rover.apply_action(np.zeros(2))
        rover.world.step(8)
    assert np.abs(rover.position).max() < 1e-3
    touching = {contact.link_a.name for contact in rover.world.contacts(rover.body)}
    assert touching == {"left_wheel", "right_wheel", "caster"}


def test_discrete_actions(rover: Robot) -> None:
    forwards, backwards, left, right, stand = rover.two_wheel.discrete_commands()
    assert forwards == pytest.approx([0.5, 0.0])
    assert backwards == pytest.approx(-forwards)
    assert left == pytest.approx(-right)
    assert stand == pytest.approx([0.0, 0.0])


def test_set_pose_moves_the_whole_robot(rover: Robot) -> None:
    rover.set_pose((2.0, 1.0, 0.0), (0, 0, 1, 0))
    v, _ = drive(rover, (0.4, 0.0), 1.0)
    assert v > 0.3
    assert rover.position[0] < 1.75


def test_swivels_of_casters_come_to_rest_on_a_robot_that_leans() -> None:
    """The swivel's axis leans by 2 mrad; its wheel, which slides, would turn it without end."""
    part = (
        '<link name="{n}"><inertial><mass value="{m}"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0"'
        ' izz="0.02"/></inertial>{shape}</link>'
    )
    ball = '<collision><geometry><sphere radius="{}"/></geometry></collision>'
    joint = (
        '<joint name="j{n}" type="continuous"><parent link="{p}"/><child link="{n}"/>'
        '<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/></joint>'
    )
    text = part.format(n="b", m=20, shape="")
    for n, xyz, axis in (("l", "0 0.2 0.1", "0 1 0"), ("r", "0 -0.2 0.1", "0 1 0")):
        text += part.format(n=n, m=1, shape=ball.format(0.1))
        text += joint.format(n=n, p="b", xyz=xyz, rpy="0 0 0", axis=axis)
    for n, x in (("f", 0.2), ("k", -0.2)):
        text += part.format(n=n, m=0.05, shape="") + part.format(n=f"{n}w", m=0.05, shape=ball.format(0.03))
        text += joint.format(n=n, p="b", xyz=f"{x} 0 0.08", rpy="0.002 0 0", axis="0 0 1")
        text += joint.format(n=f"{n}w", p=n, xyz="-0.02 0 -0.05", rpy="0 0 0", axis="0 1 0")
    given = parse_definition(
        {
            "raw_controller_order": ["base"],
            "default_controllers": {"base": "DifferentialDriveController"},
            "two_wheel": {"wheel_radius": 0.1, "wheel_axle_length": 0.4},
            "locomotion": {
                "base_joint_names": ["jl", "jr"],
                "floor_touching_base_link_names": ["l", "r", "fw", "kw"],
            },
        }
    )
    world = World()
    world.add_plane()
    robot = add_robot(world, load_description(f'<robot name="leaning">{text}</robot>'), definition=given)
    world.step(240)
    before = robot.joint_positions
    world.step(240)
    np.testing.assert_allclose(robot.joint_positions, before, atol=2e-3)
    friction = {j.name: j.friction for j in robot.description.joints}
    assert friction["jf"] == pytest.approx(1e-3 * 9.81 * 22.2 / 4)
    assert friction["jl"] == 0.0
