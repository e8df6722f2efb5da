"""Arms under task-space control do not tip a robot on wheels over, at any commanded pose."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.kinematics import forward_kinematics
from roboyard.robots import Robot, add_robot
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.robots.control.task import TaskController
from roboyard.robots.stability.support_polygon import support_polygon_of
from roboyard.sim import World

PAYLOAD = 2.0
"""Load in each gripper (kg)."""


def loaded(name: str, **keys) -> Robot:
    """Return R1 with a load in each gripper, its trunk bent forwards to the limit."""
    world = World()
    world.add_plane()
    settings = {
        "name": name,
        "mode": "absolute_pose",
        "command_input_limits": None,
        "command_output_limits": None,
        **keys,
    }
    robot = add_robot(
        world, "r1", action_normalize=False, controllers={"arm_left": settings, "arm_right": settings}
    )
    for side in ("left", "right"):
        world.model.body_mass[robot.body.link(f"{side}_arm_link6").mujoco_id] += PAYLOAD
    mujoco.mj_setConst(world.model, mujoco.MjData(world.model))
    action = robot.no_op_action()
    action[robot.controller_action_idx["trunk"]] = 0, 0.1, 0, 0
    for _ in range(120):
        robot.apply_action(action)
        world.step(robot.steps_per_control)
    return robot


def worst_tilt(robot: Robot, seed: int) -> float:
    """Return the largest tilt (rad) while both arms are commanded to random reachable poses."""
    draw, action, worst = np.random.default_rng(seed), robot.no_op_action(), 0.0
    for _ in range(10):
        for name in ("arm_left", "arm_right"):
            group = robot.groups[name]
            controller = group.controller
            assert isinstance(controller, TaskController)
            posture = draw.uniform(controller.limits.lower, controller.limits.upper)
            pose = robot.loop.state_of(group).mount @ forward_kinematics(controller.chain, posture)
            action[robot.controller_action_idx[name]] = *pose[:3, 3], *vector_of_matrix(pose[:3, :3])
        for _ in range(20):
            robot.apply_action(action)
            robot.world.step(robot.steps_per_control)
            worst = max(worst, float(np.abs(robot.joint_positions[3:5]).max()))
    return worst


@pytest.mark.parametrize("name", ["InverseKinematicsController", "OperationalSpaceController"])
def test_fast_arms_with_loads_do_not_tip_a_bent_robot(name: str) -> None:
    assert worst_tilt(loaded(name), seed=2) < 0.1


@pytest.mark.parametrize("name", ["InverseKinematicsController", "OperationalSpaceController"])
def test_without_keep_balance_they_do(name: str) -> None:
    assert worst_tilt(loaded(name, keep_balance=False), seed=2) > 0.2


@pytest.mark.parametrize("speed", [1.0, 3.0])
def test_swing_of_a_turning_robot_is_its_centrifugal_shift(speed: float) -> None:
    """The moment that MuJoCo asks for, against the closed form of a rigid body that turns about its base."""
    world = World()
    world.add_plane()
    robot = add_robot(world, "r1")
    world.step(60)
    robot.joint_arrays.v = np.where(np.array(robot.joint_names) == "base_footprint_rz_joint", speed, 0.0)
    robot.joint_arrays.refresh()
    support_polygon = support_polygon_of(robot)
    assert support_polygon is not None
    balance = support_polygon.balance(np.arange(3))
    assert balance is not None
    pushed = balance.push(np.array([0.0, 0.0, speed]), np.zeros(3))
    assert np.abs(pushed).max() > 1e-3
    assert balance.swing == pytest.approx(pushed, abs=1e-4)
