"""Environments from OmniGibson's configuration."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard.envs import ConfigEnv
from roboyard.errors import ConfigError

ROVER: dict[str, Any] = {
    "scene": {"type": "Scene"},
    "robots": [
        {
            "type": "Rover",
            "obs_modalities": ["proprio"],
            "action_type": "continuous",
            "action_normalize": True,
            "controller_config": {"base": {"name": "DifferentialDriveController"}},
        }
    ],
    "objects": [
        {
            "type": "PrimitiveObject",
            "name": "block",
            "primitive_type": "Cube",
            "size": 0.1,
            "position": [0, 2, 0.05],
        }
    ],
    "task": {"type": "PointNavigationTask", "goal_pos": [1.5, 0.0, 0.0], "max_steps": 120},
}


def test_a_rover_drives_to_its_goal() -> None:
    env = ConfigEnv(ROVER)
    observed, _ = env.reset(seed=0)
    assert env.observation_space.contains(observed)
    np.testing.assert_allclose(observed["task"]["low_dim"][:2], [1.5, 0.0], atol=0.02)
    total, done, steps = 0.0, False, 0
    while not done:
        observed, reward, done, truncated, info = env.step(np.array([0.5, 0.0]))
        assert not truncated
        total, steps = total + reward, steps + 1
    assert info["success"] and env.observation_space.contains(observed)
    # the way driven, and the bonus of the goal
    assert total == pytest.approx(
        1.5 - float(np.linalg.norm(observed["task"]["low_dim"][:2])) + 10.0, abs=0.03
    )
    again, _ = env.reset()
    np.testing.assert_allclose(again["task"]["low_dim"], [1.5, 0.0, again["task"]["low_dim"][2]], atol=0.02)


def test_pictures_and_controllers_of_r1() -> None:
    env = ConfigEnv(
        {
            "scene": {"scene_model": "tabletop"},
            "robots": [
                {
                    "type": "R1",
                    "obs_modalities": ["rgb", "proprio"],
                    "controller_config": {"arm_left": {"name": "JointController"}},
                }
            ],
            "env": {"action_frequency": 20, "physics_frequency": 200},
            "task": {"type": "DummyTask", "max_steps": 2},
        }
    )
    observed, _ = env.reset(seed=0)
    assert env.observation_space.contains(observed)
    assert any(name.endswith("::rgb") for name in observed["r1"])
    assert type(env.robots[0].controllers["arm_left"]).__name__ == "JointController"
    start = env.world.time
    assert [env.step(env.robots[0].no_op_action())[3] for _ in range(2)] == [False, True]
    assert env.world.time - start == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scenes": {}}, "did you mean 'scene'"),
        ({"robots": []}, "robots"),
        ({"robots": [{"type": "Rovr"}]}, "did you mean 'rover'"),
        ({"robots": [{"type": "Rover", "action_type": "discrete"}]}, "continuous"),
        ({"robots": [{"type": "Rover", "obs_modality": []}]}, "did you mean 'obs_modalities'"),
        ({"task": {"type": "GraspTask"}}, "GraspTask"),
        ({"task": {"type": "PointNavigationTask"}}, "goal_pos"),
        ({"env": {"action_frequency": 33, "physics_frequency": 240}}, "multiple"),
        ({"objects": [{"type": "DatasetObject"}]}, "PrimitiveObject"),
    ],
)
def test_what_is_unknown_is_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        ConfigEnv({**ROVER, **change})
