"""The tasks that come with Roboyard: simple programs reach their goals, and random actions break nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import roboyard.envs as envs
from roboyard.errors import ConfigError
from roboyard.transforms import conjugate, multiply, rotate


@pytest.mark.parametrize("task", envs.task_ids())
def test_random_actions_break_nothing(task: str) -> None:
    env = envs.make_vec(task, 8)
    env.reset(seed=0)
    random = np.random.default_rng(0)
    for _ in range(60):
        observed, reward, _, _, info = env.step(random.uniform(-1, 1, env.action_space.shape))
        assert np.isfinite(observed).all() and np.isfinite(reward).all()
        assert not info["diverged"].any()


@pytest.mark.parametrize("robot", ["arm7", "r1"])
def test_a_tip_that_moves_straight_reaches(robot: str) -> None:
    env = envs.make_vec("roboyard/Reach-v0", 64, robot=robot, control="tip", limit=100)
    observed, _ = env.reset(seed=0)
    info: dict[str, Any] = {}
    for _ in range(80):
        observed, _, _, _, info = env.step(np.clip(observed[:, -3:] / 0.05, -1, 1))
    assert info["success"].mean() > 0.95


def test_a_tip_turns_while_it_moves() -> None:
    env = envs.make_vec("roboyard/Reach-v0", 4, control="pose", limit=100)
    env.reset(seed=0)
    tip = env.runner.env.robot.tip()
    place, pose = tip.position.copy(), tip.quaternion.copy()
    command = np.tile([0.0, 0.0, 0.5, 0.0, 0.0, 0.5], (4, 1))  # 2.5 cm upwards, 0.1 rad about the vertical
    env.step(command)
    for _ in range(40):
        env.step(np.zeros((4, 6)))
    np.testing.assert_allclose(tip.position - place, np.tile([0, 0, 0.025], (4, 1)), atol=1e-3)
    turned = multiply(tip.quaternion, conjugate(pose))
    wanted = np.tile([0.0, 0.0, np.sin(0.05), np.cos(0.05)], (4, 1))
    np.testing.assert_allclose(turned * np.sign(turned[:, 3:]), wanted, atol=2e-3)


def test_a_cube_is_picked_and_carried() -> None:
    env = envs.make_vec("roboyard/PickAndPlace-v0", 12)
    env.reset(seed=0)
    arrays = env.runner.env
    reached = np.zeros(12, dtype=bool)
    for step in range(120):
        tip, cube = arrays.robot.tip().position, arrays.body("cube").position
        ahead = rotate(arrays.robot.tip().quaternion, np.array([0.0, 0.0, 1.0]))
        goal = cube - 0.1 * ahead if step < 25 else cube
        if step >= 60:
            goal = tip + arrays["goal"] - cube
        action = np.full((12, 4), 1.0 if step < 45 else -1.0)
        action[:, :3] = 0.6 * np.clip(arrays.robot.base.to_local(goal - tip) / 0.05, -1, 1)
        reached |= env.step(action)[4]["success"]
    assert reached.mean() > 0.9


def test_a_rover_that_steers_at_the_goal_arrives() -> None:
    env = envs.make_vec("roboyard/DriveTo-v0", 16, obstacles=0)
    env.reset(seed=0)
    arrays, arrived = env.runner.env, 0
    for _ in range(200):
        gap = arrays["goal"] - arrays.robot.base.position[:, :2]
        ahead = arrays.robot.base.to_local(np.concatenate([gap, np.zeros((16, 1))], axis=1))
        angle = np.arctan2(ahead[:, 1], ahead[:, 0])
        info = env.step(np.stack([np.clip(np.cos(angle), 0, 1), np.clip(2 * angle, -1, 1)], axis=1))[4]
        arrived += int(info["success"].sum())
    assert arrived >= 16


def test_the_walker_stands_with_zero_actions() -> None:
    env = envs.make_vec("roboyard/Locomotion-v0", 4, randomize=())
    env.reset(seed=0)
    for _ in range(100):
        terminated = env.step(np.zeros((4, 12)))[2]
        assert not terminated.any()
    assert env.runner.env.robot.base.position[:, 2].min() > 0.27


def test_robots_that_cannot_do_a_task_are_errors() -> None:
    for task, robot, message in (
        ("roboyard/Reach-v0", "rover", "no arm"),
        ("roboyard/PickAndPlace-v0", "arm7", "no gripper"),
        ("roboyard/DriveTo-v0", "arm7", "no base"),
        ("roboyard/Locomotion-v0", "rover", "no legs"),
        ("roboyard/Reach-v0", "arm8", "arm8"),
    ):
        with pytest.raises(ConfigError, match=message):
            envs.make_vec(task, 1, robot=robot)


def test_a_task_of_ones_own_gets_an_id(make_arm_task: Any) -> None:
    import gymnasium

    envs.register_task("test/Own-v0", lambda limit=5: make_arm_task(limit=limit))
    env = gymnasium.make("test/Own-v0", limit=3)
    env.reset(seed=0)
    assert [env.step(np.zeros(7))[3] for _ in range(3)] == [False, False, True]
    with pytest.raises(ConfigError, match="taken"):
        envs.register_task("roboyard/Reach-v0", make_arm_task)
