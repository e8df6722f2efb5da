"""Grasping modes: objects between the fingers, or touched by one, are held until the gripper opens."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import World, add_robot
from roboyard.description import load_description
from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body


def _box(name: str, size: str, origin: str, mass: float) -> str:
    shape = f'<origin xyz="{origin}"/><geometry><box size="{size}"/></geometry>'
    return (
        f'<link name="{name}"><visual>{shape}</visual><collision>{shape}</collision><inertial>'
        f'<mass value="{mass}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
        "</inertial></link>"
    )


def _joint(name: str, kind: str, parent: str, child: str, xyz: str, axis: str, limits: str) -> str:
    lower, upper = limits.split()
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        f'<limit lower="{lower}" upper="{upper}" effort="40" velocity="1"/></joint>'
    )


URDF = (
    '<robot name="r">'
    + _box("base", "0.2 0.2 0.1", "0 0 0", 5)
    + _box("palm", "0.04 0.16 0.04", "0 0 0", 1)
    + _box("left", "0.02 0.01 0.08", "0 0 0.04", 0.1)
    + _box("right", "0.02 0.01 0.08", "0 0 0.04", 0.1)
    + _joint("lift", "prismatic", "base", "palm", "0 0 0.3", "0 0 1", "0 0.5")
    + _joint("l", "prismatic", "palm", "left", "0 0.01 0.02", "0 1 0", "0 0.05")
    + _joint("r", "prismatic", "palm", "right", "0 -0.01 0.02", "0 -1 0", "0 0.05")
    + "</robot>"
)
DEFINITION = {
    "raw_controller_order": ["arm_0", "gripper_0"],
    "default_controllers": {"arm_0": "JointController", "gripper_0": "MultiFingerGripperController"},
    "default_joint_pos": [0.0, 0.05, 0.05],
    "manipulation": {
        "arm_joint_names": {"0": ["lift"]},
        "eef_link_names": {"0": "palm"},
        "finger_link_names": {"0": ["left", "right"]},
        "finger_joint_names": {"0": ["l", "r"]},
        "assisted_grasp_start_points": {"0": [["left", [0, -0.005, 0.06]]]},
        "assisted_grasp_end_points": {"0": [["right", [0, 0.005, 0.06]]]},
    },
}


def _world(mode: Any, place: tuple[float, float, float], mass: float = 0.1) -> tuple[World, Robot, Body]:
    world = World(gravity=(0, 0, 0))
    robot = add_robot(
        world, load_description(URDF), definition=DEFINITION, on_floor=False, grasping_mode=mode
    )
    box = world.add_box((0.015, 0.015, 0.015), mass=mass, position=place)
    return world, robot, box


def _command(robot: Robot, value: float, seconds: float = 0.5) -> None:
    for _ in range(round(30 * seconds)):
        robot.apply_action({"gripper_0": [value]})
        robot.world.step(robot.steps_per_control)


BETWEEN = (0.0, 0.0, 0.38)


def test_an_assisted_grasp_holds_what_is_between_the_fingers_until_they_open() -> None:
    world, robot, box = _world("assisted", BETWEEN)
    assert robot.manipulation is not None
    _command(robot, -1.0)
    assert robot.arms["0"].is_grasping is True
    held = np.array(box.pose[0]) - robot.link("palm").pose[0]
    start = robot.link("palm").pose[0][2]
    for _ in range(30):
        robot.apply_action({"arm_0": [1.0], "gripper_0": [-1.0]})
        world.step(robot.steps_per_control)
    assert robot.link("palm").pose[0][2] > start + 0.05
    assert np.array(box.pose[0]) - robot.link("palm").pose[0] == pytest.approx(held, abs=0.004)
    _command(robot, 1.0)
    assert robot.arms["0"].is_grasping is False
    assert len(world.constraints) == 0


@pytest.mark.parametrize(("mode", "taken"), [("sticky", True), ("assisted", False)])
def test_only_a_sticky_grasp_takes_what_one_finger_touches(mode: str, taken: bool) -> None:
    """A box in the way of the left finger's end, above the ray between the grasp points."""
    world, robot, _ = _world(mode, (0.0, 0.04, 0.403), mass=9.0)
    for _ in range(6):
        robot.apply_action({"gripper_0": [-1.0]})
        world.step(robot.steps_per_control)
        if any(contact.link_a.name == "left" for contact in world.contacts(robot.body)):
            break
    else:
        pytest.fail("the finger never touched the box")
    robot.apply_action({"gripper_0": [-1.0]})
    assert robot.arms["0"].is_grasping is taken


def test_friction_alone_makes_no_constraint_and_heavy_objects_are_not_taken() -> None:
    world, robot, _ = _world("physical", BETWEEN)
    _command(robot, -1.0)
    assert len(world.constraints) == 0
    assert robot.manipulation is not None and robot.manipulation.assisted_grasp is None
    _, robot, _ = _world("sticky", BETWEEN, mass=20.0)
    _command(robot, -1.0)
    assert robot.arms["0"].is_grasping is False


def test_a_removed_object_and_a_reset_end_a_grasp() -> None:
    world, robot, box = _world("assisted", BETWEEN)
    _command(robot, -1.0)
    world.remove(box)
    assert robot.arms["0"].is_grasping is False
    _command(robot, -1.0, 0.1)
    world, robot, box = _world("assisted", BETWEEN)
    _command(robot, -1.0)
    robot.reset()
    assert robot.arms["0"].is_grasping is False and len(world.constraints) == 0


def test_an_unknown_mode_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"grasping_mode.*'magnetic'.*sticky"):
        _world("magnetic", BETWEEN)
