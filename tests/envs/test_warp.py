"""Environments on MuJoCo Warp's CPU device against MuJoCo's own batch, step by step from the same states."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco_warp")

import roboyard.envs as envs
from roboyard.envs.on_warp.translation import Translation
from roboyard.errors import ConfigError

pytestmark = [
    pytest.mark.slow,  # Warp compiles its kernels in the first run, for a minute
    pytest.mark.filterwarnings("ignore"),  # of Warp's own
]


def differences(task: Any, count: int = 3, steps: int = 20) -> np.ndarray:
    """Return (steps, 3): largest differences of positions, observations and rewards of each step."""
    ours, theirs = envs.make_vec(task, count), envs.make_vec(task, count, backend="warp", device="cpu")
    assert theirs.single_observation_space == ours.single_observation_space
    assert np.array_equal(ours.reset(seed=3)[0], theirs.reset(seed=3)[0])
    random, found = np.random.default_rng(0), []
    for _ in range(steps):
        theirs.runner.physics.batch.state[:] = ours.runner.physics.batch.state
        theirs.runner.physics.forward()
        actions = random.uniform(-1, 1, ours.action_space.shape)
        (seen, reward, *ends), (other, other_reward, *other_ends) = ours.step(actions), theirs.step(actions)
        for k in range(2):
            assert np.array_equal(ends[k], other_ends[k])
        q, other_q = (one.runner.physics.field("qpos") for one in (ours, theirs))
        found.append(
            [np.abs(q - other_q).max(), np.abs(seen - other).max(), np.abs(reward - other_reward).max()]
        )
    return np.array(found)


def test_an_arm_moves_as_in_the_batch() -> None:
    found = differences("roboyard/Reach-v0")
    assert found[:, 0].max() < 2e-4, "rad, single precision, 8 time steps"
    assert found.max() < 1e-3


def test_feet_touch_the_ground_as_in_the_batch() -> None:
    found = differences("roboyard/Locomotion-v0")
    assert np.median(found, axis=0).max() < 1e-4
    assert found[:, 0].max() < 1e-3


def test_masses_gains_and_gravity_differ_there_too() -> None:
    changes = (envs.Mass("robot", (0.5, 3.0)), envs.Gains(stiffness=(0.2, 2.0)), envs.Gravity((-3.0, 3.0)))
    task = replace(envs.make_task("roboyard/Reach-v0", limit=8), randomize=changes)
    assert differences(task)[:, 0].max() < 5e-4  # over ends of episodes, too
    plain = envs.make_vec("roboyard/Reach-v0", 3)
    other = envs.make_vec(task, 3)
    plain.reset(seed=3)
    other.reset(seed=3)
    other.runner.physics.batch.state[:] = plain.runner.physics.batch.state
    for one in (plain, other):
        one.step(np.full((3, 7), 0.5))
    gap = np.abs(plain.runner.physics.field("qpos") - other.runner.physics.field("qpos")).max()
    assert gap > 5e-3, "the differences matter"


def test_inputs_give_the_effort_of_a_drive() -> None:
    task_env = envs.TaskEnv(envs.make_task("roboyard/Reach-v0"))
    world = task_env.world
    translation = Translation(world)
    random = np.random.default_rng(0)
    ctrl, q, v = random.normal(size=(2, 21)), random.normal(size=7), random.normal(size=7)
    bias = world.model.actuator_biasprm[None]
    kp, kd = -bias[0, :, 1], -bias[0, :, 2]
    expected = kp * (ctrl[:, 0::3] - q) + kd * (ctrl[:, 1::3] - v) + ctrl[:, 2::3]
    model = translation.model
    np.testing.assert_array_equal(model.actuator_biasprm[:, 1], -kp)
    np.testing.assert_allclose(translation.inputs(ctrl, bias) - kp * q - kd * v, expected, atol=1e-9)
    np.testing.assert_array_equal(model.actuator_forcerange, world.model.actuator_forcerange)


def test_devices_are_named() -> None:
    with pytest.raises(ConfigError, match="cpu"):
        envs.make_vec("roboyard/Reach-v0", 2, backend="warp", device="cuda:9")
