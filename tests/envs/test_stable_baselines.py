"""Environments for Stable-Baselines3."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import roboyard.envs as envs


def test_episodes_are_reported_and_the_policy_is_the_models() -> None:
    sb3 = pytest.importorskip("stable_baselines3")  # here, as it takes seconds to load
    from roboyard.envs.stable_baselines import StableBaselinesEnv, policy_of

    env = StableBaselinesEnv(envs.make_vec("roboyard/Reach-v0", 4, limit=5, control="tip"))
    env.seed(1)
    first = env.reset()
    np.testing.assert_array_equal(first, env.envs.reset(seed=1)[0])
    infos: list[Any] = []
    observed: Any = first
    ended = np.zeros(4, dtype=bool)
    for _ in range(5):
        observed, reward, ended, infos = env.step(np.full((4, 3), 0.1))
        assert observed.shape == (4, 17) and reward.shape == (4,)
    assert ended.all()
    assert all(info["TimeLimit.truncated"] and info["episode"]["l"] == 5 for info in infos)
    assert not np.array_equal(infos[0]["terminal_observation"], observed[0])
    model = sb3.PPO("MlpPolicy", env, n_steps=8, batch_size=32, n_epochs=1, device="cpu", seed=0)
    model.learn(64)
    policy = policy_of(model, "roboyard/Reach-v0", {"control": "tip"})
    expected, _ = model.predict(first, deterministic=True)
    np.testing.assert_allclose(policy(first), np.clip(expected, -1, 1), atol=1e-5)
