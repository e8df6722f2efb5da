"""One environment: Gymnasium's own checks, seeds, and errors."""

from __future__ import annotations

import warnings
from importlib.util import find_spec
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordVideo, RenderCollection

import roboyard.envs as envs
from roboyard.errors import ConfigError, RoboyardError


@pytest.mark.parametrize("task", envs.task_ids())
def test_every_task_passes_gymnasiums_checks(task: str) -> None:
    env = gymnasium.make(task, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of observations without bounds
        # the check opens the page of render_mode "human", where viser is installed
        check_env(env.unwrapped, skip_render_check=find_spec("viser") is None, skip_close_check=True)
    env.reset(seed=0)
    picture: Any = env.render()
    assert picture.ndim == 3 and picture.dtype == np.uint8 and picture.std() > 5
    env.close()


def test_the_same_seed_gives_the_same_episode() -> None:
    def play() -> list[Any]:
        env = gymnasium.make("roboyard/Reach-v0")
        seen = [env.reset(seed=3)[0]]
        random = np.random.default_rng(0)
        for _ in range(15):
            seen.append(env.step(random.uniform(-1, 1, 7).astype(np.float32))[0])
        seen.append(env.reset()[0])
        return seen

    first, second = play(), play()
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    assert not np.array_equal(first[0], first[-1])


def test_world_and_robot_are_in_the_state_that_is_observed(make_arm_task: Any) -> None:
    env = envs.TaskEnv(make_arm_task())
    env.reset(seed=0)
    observation = np.zeros(0)
    for _ in range(5):
        observation = env.step(np.full(7, 0.5))[0]
    np.testing.assert_allclose(env.robot.joint_positions, observation[:7], atol=1e-6)
    np.testing.assert_allclose(env.world.body("box").position, observation[7:10], atol=1e-6)


def test_misspelt_names_are_errors_when_the_task_is_set_up(make_arm_task: Any) -> None:
    for changes, message in (
        ({"actions": {"arm": envs.JointDelta()}}, "arm_0"),
        ({"observations": {"x": lambda env: env.body("bax").position}}, "did you mean 'box'"),
        ({"observations": {"x": lambda env: env["gaol"]}, "buffers": {"goal": 3}}, "did you mean 'goal'"),
        ({"observations": {"x": lambda env: env.robot.link("tol").position}}, "did you mean 'tool'"),
        ({"rewards": {"r": lambda env: env.robot.q}}, r"reward 'r' has shape \(1, 7\)"),
        ({"terminations": {"t": lambda env: True}}, "termination 't' has shape"),
        ({"randomize": [envs.Mass("bax")]}, "did you mean 'box'"),
        ({"actions": {"arm_0": envs.JointDelta(), "x": envs.JointDelta(names=("joint1",))}}, "both drive"),
    ):
        with pytest.raises(RoboyardError, match=message):
            envs.TaskEnv(make_arm_task(**changes))
    with pytest.raises(ConfigError, match="did you mean 'control'"):
        gymnasium.make("roboyard/Reach-v0", controll="tip")
    with pytest.raises(ConfigError, match="did you mean 'proprio'"):
        gymnasium.make("roboyard/Reach-v0", obs_modalities=["propio"])
    with pytest.raises(ConfigError, match="Reach-v0"):
        envs.make_vec("roboyard/Reech-v0", 2)


def test_actions_of_another_shape_and_steps_after_the_end_are_errors(make_arm_task: Any) -> None:
    env = envs.TaskEnv(make_arm_task(limit=1))
    with pytest.raises(RoboyardError, match="reset"):
        env.step(np.zeros(7))
    env.reset(seed=0)
    with pytest.raises(RoboyardError, match=r"\(7,\)"):
        env.step(np.zeros(6))
    with pytest.raises(RoboyardError, match="finite"):
        env.step(np.full(7, np.nan))
    assert env.step(np.zeros(7))[3]
    with pytest.raises(RoboyardError, match="reset"):
        env.step(np.zeros(7))


def test_each_part_of_the_reward_is_reported() -> None:
    env = gymnasium.make("roboyard/Reach-v0", limit=3)
    env.reset(seed=0)
    sums: dict[str, float] = {}
    truncated, info = False, {}
    for _ in range(3):
        _, reward, _, truncated, info = env.step(np.full(7, 0.3, dtype=np.float32))
        assert reward == pytest.approx(sum(info["rewards"].values()))
        sums = {name: sums.get(name, 0.0) + value for name, value in info["rewards"].items()}
    assert truncated and info["episode_rewards"] == pytest.approx(sums)


def test_pictures_are_observed_by_modality() -> None:
    env = gymnasium.make("roboyard/Reach-v0", robot="r1", obs_modalities=["proprio", "rgb", "depth"])
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    pictures = {name for name in observation if name.endswith("/rgb")}
    assert pictures and "proprio" in observation
    for name in pictures:
        assert observation[name].std() > 1
        assert np.isfinite(observation[name.replace("rgb", "depth")]).any()


def test_gymnasium_records_films(tmp_path: Any) -> None:
    pytest.importorskip("moviepy")
    env = gymnasium.make("roboyard/Reach-v0", render_mode="rgb_array", limit=3)
    filmed = RecordVideo(env, str(tmp_path))
    filmed.reset(seed=0)
    for _ in range(3):
        filmed.step(np.zeros(7, dtype=np.float32))
    filmed.close()
    assert next(tmp_path.glob("*.mp4")).stat().st_size > 1000


def test_pictures_for_films_change_with_the_robot() -> None:
    env = RenderCollection(gymnasium.make("roboyard/Reach-v0", render_mode="rgb_array"), pop_frames=False)
    env.reset(seed=0)
    for _ in range(6):
        env.step(np.full(7, 1.0, dtype=np.float32))
    frames: Any = env.render()
    assert len(frames) == 7 and frames[0].dtype == np.uint8 and frames[0].shape[2] == 3
    assert (frames[0] != frames[-1]).any()
    env.close()
