"""Meanings of actions: compared with the controllers of a robot, and with closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import roboyard.envs as envs
from roboyard import World, add_robot
from roboyard.assets import asset_path
from roboyard.errors import ConfigError


def after(env: envs.BatchEnv, command: np.ndarray, steps: int) -> np.ndarray:
    """Observations after so many steps of one action."""
    observed = np.zeros(0)
    for _ in range(steps):
        observed = env.step(command)[0]
    return observed


def test_changes_of_joints_are_those_of_the_robots_own_controller(make_arm_task: Any) -> None:
    task = make_arm_task(limit=100)
    env = envs.BatchEnv(task, 1)
    env.reset(seed=0)
    action = envs.JointDelta(0.1)
    world = World(timestep=task.timestep)
    world.add_plane()
    robot = add_robot(world, str(asset_path("arm7")), control_freq=task.control_freq)
    robot.reload_controllers({"arm_0": action.controller(robot, "arm_0")})
    robot.joint_positions = [0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0]
    random = np.random.default_rng(0)
    worst = 0.0
    for _ in range(12):
        command = random.uniform(-1, 1, 7)
        observed = env.step(command[None])[0]
        robot.apply_action(command)
        world.step(task.substeps)
        worst = max(worst, float(np.abs(observed[0, :7] - robot.joint_positions).max()))
    # the robot's gains follow the inertia of the present posture, those of environments do not
    assert worst < 1e-3


def test_joint_targets_are_reached_around_the_rest_posture(make_arm_task: Any) -> None:
    env = envs.BatchEnv(make_arm_task(actions={"arm_0": envs.JointTarget(0.4)}, limit=100), 2)
    env.reset(seed=0)
    command = np.array([[0.5, 0.2, -0.3, 0.4, 0.1, -0.6, 0.7], [0, 0, 0, 0, 0, 0, 0]])
    observed = after(env, command, 60)
    rest = env.runner.env.robot.rest
    np.testing.assert_allclose(observed[:, :7], rest + 0.4 * command, atol=0.005)


def test_joint_velocities(make_arm_task: Any) -> None:
    env = envs.BatchEnv(make_arm_task(actions={"arm_0": envs.JointVelocity(0.1)}, limit=100), 1)
    start = env.reset(seed=0)[0][0, :7]
    command = np.array([[1.0, 0, 0, 0, 0, 0, -1.0]])
    observed = after(env, command, 30)
    wanted = 0.1 * env.runner.env.robot.robot.limits.velocity * command[0]
    np.testing.assert_allclose(observed[0, :7] - start, wanted, atol=0.05 * np.abs(wanted).max())


@pytest.mark.parametrize("turn", [None, 0.1])
def test_the_tip_moves_as_commanded(make_arm_task: Any, turn: float | None) -> None:
    task = make_arm_task(
        actions={"arm_0": envs.TipDelta(0.02, turn=turn)},
        observations={"p": lambda e: e.robot.tip().position, "r": lambda e: e.robot.tip().quaternion},
        limit=200,
    )
    env = envs.BatchEnv(task, 2)
    start = env.reset(seed=0)[0]
    size = 3 if turn is None else 6
    command = np.zeros((2, size))
    command[0, :3] = [0.5, -1.0, -0.5]
    command[1, 2] = 1.0
    env.step(command)
    observed = after(env, np.zeros((2, size)), 40)
    np.testing.assert_allclose(observed[:, :3] - start[:, :3], 0.02 * command[:, :3], atol=5e-4)
    np.testing.assert_allclose(np.abs((observed[:, 3:] * start[:, 3:]).sum(axis=1)), 1.0, atol=1e-3)


def test_a_rotation_of_the_tip(make_arm_task: Any) -> None:
    task = make_arm_task(
        actions={"arm_0": envs.TipDelta(0.02, turn=0.1)},
        observations={"r": lambda e: e.robot.tip().quaternion},
        limit=200,
    )
    env = envs.BatchEnv(task, 1)
    start = env.reset(seed=0)[0][0]
    observed = start
    for k in range(60):
        command = np.zeros((1, 6))
        command[0, 5] = 1.0 if k == 0 else 0.0
        observed = env.step(command)[0][0]
    angle = 2 * np.arccos(min(1.0, abs(float(observed @ start))))
    assert angle == pytest.approx(0.1, abs=0.003)


@pytest.mark.parametrize("robot", ["rover", "r1"])
def test_a_base_drives_with_the_commanded_twist(robot: str) -> None:
    def build(world: Any) -> Any:
        world.add_plane()
        return add_robot(world, robot)

    task = envs.Task(
        build=build,
        actions={"base": envs.BaseTwist(speed=0.5, turn=0.5)},
        observations={
            "p": lambda e: e.robot.base.position,
            "v": lambda e: e.robot.base.to_local(e.robot.base.linear_velocity),
            "w": lambda e: e.robot.base.angular_velocity,
        },
        limit=100,
    )
    env = envs.BatchEnv(task, 2)
    env.reset(seed=0)
    size = env.runner.action_size
    command = np.zeros((2, size))
    command[0, 0], command[1, 0], command[1, -1] = 1.0, 0.6, 1.0
    observed = after(env, command, 60)
    assert observed[0, 3] == pytest.approx(0.5, abs=0.03)
    assert observed[1, 3] == pytest.approx(0.3, abs=0.03)
    assert observed[1, 8] == pytest.approx(0.5, abs=0.05)
    assert abs(observed[0, 1]) < 0.02


def test_a_gripper_opens_and_closes() -> None:
    def build(world: Any) -> Any:
        world.add_plane()
        return add_robot(world, "r1")

    task = envs.Task(
        build=build,
        actions={"gripper_left": envs.GripperOpening()},
        observations={"q": lambda e: e.robot.q},
        limit=100,
    )
    env = envs.BatchEnv(task, 2)
    env.reset(seed=0)
    observed = after(env, np.array([[1.0], [-1.0]]), 60)
    arrays = env.runner.env.robot
    fingers = arrays.indices_of(arrays.robot.groups["gripper_left"].joints)
    opened, closed = arrays.robot.groups["gripper_left"].controller.postures  # type: ignore[attr-defined]
    np.testing.assert_allclose(observed[0, fingers], opened, atol=0.002)
    np.testing.assert_allclose(observed[1, fingers], closed, atol=0.002)


def test_actions_that_do_not_fit_the_group_are_errors() -> None:
    def build(world: Any) -> Any:
        return add_robot(world, "r1")

    for actions, message in (
        ({"base": envs.GripperOpening()}, "no gripper"),
        ({"base": envs.TipDelta()}, "no arm"),
        ({"arm_left": envs.BaseTwist()}, "BaseTwist"),
        ({}, "at least one"),
    ):
        task = envs.Task(build=build, actions=actions, observations={"q": lambda e: e.robot.q})
        with pytest.raises(ConfigError, match=message):
            envs.BatchEnv(task, 1)


@pytest.mark.parametrize("turn", [None, 0.1])
@pytest.mark.parametrize("keeps", [True, False])
def test_steps_of_the_tip_are_damped_least_squares(
    make_arm_task: Any, turn: float | None, keeps: bool
) -> None:
    action = envs.TipDelta(0.03, turn=turn, keeps_orientation=keeps)
    noise = (envs.JointNoise(position=0.3),)
    env = envs.BatchEnv(make_arm_task(actions={"arm_0": action}, limit=100, randomize=noise), 3)
    env.reset(seed=0)
    robot, random = env.runner.env.robot, np.random.default_rng(0)
    size = 3 if turn is None else 6
    start = Rotation.from_quat(robot.tip().quaternion)
    dt, dofs = env.runner.env.dt, np.arange(7)
    command = random.uniform(-1, 1, (3, size))
    base = Rotation.from_quat(robot.base.quaternion)
    error = base.apply(command[:, :3] * 0.03)
    goal = start if turn is None else Rotation.from_rotvec(base.apply(command[:, 3:] * turn)) * start
    rows = np.concatenate(robot.tip().jacobian(dofs), axis=1)
    if turn is None and not keeps:
        rows = rows[:, :3]
    else:
        error = np.concatenate([error, (goal * start.inv()).as_rotvec()], axis=1)
    pull = 0.5 * dt * (robot.rest - robot.q)
    q = robot.q.copy()
    env.step(command)
    for i, jac in enumerate(rows):
        inverse = jac.T @ np.linalg.inv(jac @ jac.T + 0.05**2 * np.eye(len(jac)))
        step = inverse @ (min(1.0, 25.0 * dt) * error[i]) + pull[i] - inverse @ (jac @ pull[i])
        step /= max(1.0, (np.abs(step) / (robot.robot.limits.velocity * dt)).max())
        wanted = np.clip(q[i] + step, robot.lower, robot.upper)
        found = env.runner.actions.drives["robot"].position[i]
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12)
