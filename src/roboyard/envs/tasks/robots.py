"""Robots of the tasks: registered ones, bundled files, and files of the user, to be added to a world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from roboyard.assets import ROBOTS, asset_path
from roboyard.envs.actions import Action, BaseTwist, GripperOpening, JointDelta, JointTarget, TipDelta
from roboyard.errors import ConfigError
from roboyard.robots import add_robot
from roboyard.robots.registry import REGISTERED_ROBOTS
from roboyard.robots.robot import Robot
from roboyard.robots.spawn import is_robot_file
from roboyard.sim.world import World


def place_robot(world: World, robot: str, position: Any = (0, 0, 0), **options: Any) -> Robot:
    """Add a robot by its registered name, the name of a bundled one, or a file.

    Args:
        world: for the robot.
        robot: "r1", "arm7", "my_robot.urdf".
        position: (3,) of its root frame (m).
        options: of `roboyard.add_robot`.
    """
    if not is_robot_file(robot) and robot not in REGISTERED_ROBOTS and robot in ROBOTS:
        robot = str(asset_path(robot))
    return add_robot(world, robot, position, **options)


def arm_name(robot: Robot, arm: str = "default") -> str:
    """Return the name of an arm; the first by default.

    Raises:
        ConfigError: the robot has none.
    """
    if robot.manipulation is None:
        raise ConfigError(f"robot {robot.name!r} has no arm; choose one that has, such as 'arm7' or 'r1'")
    return robot.manipulation.arm(arm)


def arm_actions(
    robot: Robot, arm: str, control: str, *, gripper: bool = False, holds: bool = True
) -> Mapping[str, Action]:
    """Return the actions of an arm.

    "joints" changes joint positions, "tip" the end effector's position, "pose" its position and orientation.

    Args:
        robot: with the arm.
        arm: its name.
        control: "joints", "tip" or "pose".
        gripper: whether the gripper opens and closes, if there is one.
        holds: whether the end effector keeps its orientation, with "tip".

    Raises:
        ConfigError: `control` is something else.
    """
    kinds: dict[str, Action] = {
        "joints": JointDelta(0.1),
        "tip": TipDelta(0.05, keeps_orientation=holds),
        "pose": TipDelta(0.05, turn=0.2),
    }
    if control not in kinds:
        raise ConfigError(f"control must be 'joints', 'tip' or 'pose', got {control!r}")
    found: dict[str, Action] = {f"arm_{arm}": kinds[control]}
    if gripper and f"gripper_{arm}" in robot.groups:
        found[f"gripper_{arm}"] = GripperOpening()
    return found


def base_action(robot: Robot) -> Mapping[str, Action]:
    """Return the action that moves the robot over the floor: a twist, or joints of legs.

    Raises:
        ConfigError: the robot stays where it is.
    """
    if "base" not in robot.groups:
        raise ConfigError(
            f"robot {robot.name!r} has no base that moves; choose one that has, such as 'rover'"
        )
    group = robot.groups["base"]
    if type(group.controller).__name__ == "JointController":
        return {"base": JointTarget(0.5)}
    return {"base": BaseTwist()}
