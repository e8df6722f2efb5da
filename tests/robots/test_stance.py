"""Robots that stand on ankles: gains against the inverted pendulum, and the sway that is left."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.robots import Robot, add_robot
from roboyard.robots.stability.stance import DAMPING_RATIO, STIFFER, stance_of
from roboyard.sim import World

MASS, HEIGHT = 30.0, 0.7
"""Of the body (kg) and of its centre above the ankles (m)."""


def stilts(kind: str = "revolute") -> RobotDescription:
    """Return a body on two legs without knees, with ankles of 50 N m over light feet."""
    tiny = '<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/>'
    body = '<inertia ixx="0.5" ixy="0" ixz="0" iyy="0.5" iyz="0" izz="0.5"/>'
    text = (
        f'<robot name="stilts"><link name="body"><inertial><mass value="{MASS}"/>{body}</inertial>'
        '<collision><geometry><box size="0.2 0.3 0.3"/></geometry></collision></link>'
    )
    for side, y in (("left", 0.12), ("right", -0.12)):
        text += (
            f'<link name="{side}_foot"><inertial><mass value="0.001"/>{tiny}</inertial><collision>'
            '<origin xyz="0.02 0 -0.03"/><geometry><box size="0.16 0.06 0.02"/></geometry></collision></link>'
            f'<joint name="{side}_ankle" type="{kind}"><parent link="body"/><child link="{side}_foot"/>'
            f'<origin xyz="-0.015 {y} {-HEIGHT}"/><axis xyz="0 1 0"/>'
            '<limit lower="-0.8" upper="0.8" effort="50" velocity="20"/></joint>'
        )
    return load_description(text + "</robot>")


def standing(**options: object) -> Robot:
    """Return the robot on a floor."""
    world = World()
    world.add_plane()
    definition = {
        "raw_controller_order": ["base"],
        "default_controllers": {"base": "JointController"},
        "locomotion": {
            "base_joint_names": ["left_ankle", "right_ankle"],
            "floor_touching_base_link_names": ["left_foot", "right_foot"],
        },
    }
    return add_robot(world, stilts(), definition=definition, **options)  # type: ignore[arg-type]


def test_ankles_are_stiffer_than_the_fall_of_the_robot() -> None:
    robot = standing()
    stance = stance_of(robot, np.zeros(2))
    assert stance is not None
    share = robot.mass / 2
    topples, inertia = share * 9.81 * HEIGHT, share * (HEIGHT**2 + 0.015**2)
    np.testing.assert_allclose(stance.stiffness, STIFFER * topples, rtol=1e-3)
    expected = 2 * DAMPING_RATIO * np.sqrt((STIFFER - 1) * topples * inertia)
    np.testing.assert_allclose(stance.damping, expected, rtol=1e-3)


def test_a_robot_on_ankles_does_not_sway() -> None:
    """Gains by the inertia of the feet leave it swaying at 0.08 rad/s after two seconds."""
    robot = standing()
    action = robot.no_op_action()
    for _ in range(60):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
    linear, angular = robot.velocity
    assert np.linalg.norm(linear) < 0.005
    assert np.linalg.norm(angular) < 0.005
    lean = STIFFER - 1  # the lean at which the spring holds the weight that is 15 mm ahead of the ankles
    assert np.abs(robot.joint_positions) == pytest.approx(0.015 / HEIGHT / lean, rel=0.4)


def test_a_fixed_base_carries_itself() -> None:
    robot = standing(fixed_base=True)
    assert stance_of(robot, np.zeros(2)) is None
