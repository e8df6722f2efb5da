"""Many environments: the same as one, at any number of threads; starts and ends of episodes."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

import roboyard.envs as envs
from roboyard.errors import ModelError, RoboyardError


def test_each_row_is_a_single_environment_bit_for_bit() -> None:
    many = envs.make_vec("roboyard/Reach-v0", 3, limit=12, threads=2)
    observed, _ = many.reset(seed=5)
    single = [envs.TaskEnv(envs.make_task("roboyard/Reach-v0", limit=12)) for _ in range(3)]
    for row, env in enumerate(single):
        assert np.array_equal(env.reset(seed=5 + row)[0], observed[row])
    random = np.random.default_rng(0)
    for _ in range(30):
        actions = random.uniform(-1, 1, (3, 7))
        observed, reward, terminated, truncated, info = many.step(actions)
        for row, env in enumerate(single):
            alone = env.step(actions[row])
            ended = terminated[row] or truncated[row]
            seen = info["final_obs"][row] if ended else observed[row]
            assert np.array_equal(alone[0], seen)
            assert alone[1:4] == (reward[row], terminated[row], truncated[row])
            if ended:
                assert np.array_equal(env.reset()[0], observed[row])


@pytest.mark.parametrize("task", [*envs.task_ids(), "tip"])
def test_the_number_of_threads_changes_nothing(task: str) -> None:
    options = {"control": "tip"} if task == "tip" else {}

    def play(threads: int) -> np.ndarray:
        env = envs.make_vec("roboyard/Reach-v0" if options else task, 8, threads=threads, limit=7, **options)
        seen = [env.reset(seed=1)[0]]
        random = np.random.default_rng(0)
        for _ in range(10):
            observed, reward, *_ = env.step(random.uniform(-1, 1, env.action_space.shape))
            seen.append(np.concatenate([observed, reward[:, None]], axis=1))
        return np.concatenate([rows.ravel() for rows in seen])

    first = play(1)
    assert np.array_equal(first, play(2))
    assert np.array_equal(first, play(3))


def stepped_alone(env: Any, model: mujoco.MjModel, count: int) -> Iterator[mujoco.MjData]:
    """Step two environments at random; yield what MuJoCo alone makes of the second one's state."""
    physics, data = env.runner.physics, mujoco.MjData(model)
    kind = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    random = np.random.default_rng(1)
    for _ in range(count):
        state = physics.batch.state[1].copy()
        env.step(random.uniform(-1, 1, env.action_space.shape))
        mujoco.mj_setState(model, data, state, kind)
        data.ctrl[:] = physics.field("ctrl")[1]
        for _ in range(env.runner.task.substeps):
            mujoco.mj_step(model, data)
        yield data


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
def test_the_physics_is_that_of_mujocos_own_step(make_arm_task: Any, cone: str) -> None:
    env = envs.BatchEnv(make_arm_task(cone=cone), 2, threads=1)
    env.reset(seed=0)
    physics = env.runner.physics
    model = physics.batch.model
    assert model.opt.cone == {"elliptic": 1, "pyramidal": 0}[cone]
    for data in stepped_alone(env, model, 5):
        assert np.array_equal(data.qpos, physics.field("qpos")[1])
        assert np.array_equal(data.qvel, physics.field("qvel")[1])


def test_the_numbers_are_those_with_mujocos_islands() -> None:
    """One tree is one island at most, so that the search for it is skipped."""
    env = envs.make_vec("roboyard/Locomotion-v0", 2, threads=1, randomize=())
    env.reset(seed=0)
    physics = env.runner.physics
    model = copy.deepcopy(physics.world.model)
    flag = int(mujoco.mjtDisableBit.mjDSBL_ISLAND)
    assert model.opt.disableflags & flag
    model.opt.disableflags &= ~flag
    for data in stepped_alone(env, model, 10):
        assert data.nisland == 1
        assert np.array_equal(data.qvel, physics.field("qvel")[1])


def test_a_box_slides_alike_in_the_batch_and_in_its_world(make_arm_task: Any) -> None:
    """With pyramids, a world's own steps leave sliding to MuJoCo, as the batch does."""
    env = envs.BatchEnv(make_arm_task(cone="pyramidal"), 1, threads=1)
    env.reset(seed=0)
    env.runner.env.body("box").set_velocity(np.array([0]), np.array([3.0, 1.0, 0.0]))
    world = env.runner.show(0)
    world.step(env.runner.task.substeps)
    env.step(np.zeros((1, 7)))
    assert np.allclose(world.data.qpos, env.runner.physics.field("qpos")[0], atol=1e-12)


def test_a_function_of_the_state_is_computed_once_between_changes(make_arm_task: Any) -> None:
    calls: list[int] = []

    def middle(env: Any) -> np.ndarray:
        calls.append(len(env.steps))
        return env.robot.q.mean(axis=1)

    def play(of: Any) -> np.ndarray:
        task = make_arm_task(
            observations={"a": of, "b": lambda env: 2.0 * of(env)},
            rewards={"a": of},
            terminations={"high": lambda env: of(env) > 0.08},
            limit=4,
        )
        env = envs.BatchEnv(task, 2)
        seen = [env.reset(seed=0)[0]]
        calls.clear()
        random = np.random.default_rng(0)
        for _ in range(9):
            observed, reward, *_, info = env.step(random.uniform(-1, 1, (2, 7)))
            seen += [observed, reward, info.get("final_obs", observed)]
        return np.concatenate([rows.ravel() for rows in seen])

    plain, plain_calls = play(middle), 4 * 9
    assert len(calls) >= plain_calls
    assert np.array_equal(play(lambda env: env.once(middle)), plain)
    assert 9 <= len(calls) <= 18  # a step, and the starts of episodes


def test_modes_of_autoreset(make_arm_task: Any) -> None:
    still = np.zeros((2, 7))
    same = envs.BatchEnv(make_arm_task(limit=2), 2)
    assert same.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    first, _ = same.reset(seed=0)
    same.step(still + 1)
    observed, _, _, truncated, info = same.step(still + 1)
    assert truncated.all() and info["_final_obs"].all()
    np.testing.assert_array_equal(observed, first)  # nothing is random in this task
    assert np.abs(info["final_obs"] - first).max() > 1e-3
    assert info["final_info"]["episode_length"].tolist() == [2, 2]

    later = envs.BatchEnv(make_arm_task(limit=2), 2, autoreset="next_step")
    later.reset(seed=0)
    later.step(still + 1)
    observed, _, _, truncated, _ = later.step(still + 1)
    assert truncated.all() and np.abs(observed - first).max() > 1e-3
    observed, reward, _, truncated, _ = later.step(still + 1)
    np.testing.assert_array_equal(observed, first)
    assert not reward.any() and not truncated.any()

    never = envs.BatchEnv(make_arm_task(limit=2), 2, autoreset="disabled")
    never.reset(seed=0)
    never.step(still)
    never.step(still)
    with pytest.raises(RoboyardError, match="reset_mask"):
        never.step(still)
    never.reset(options={"reset_mask": np.array([True, True])})
    never.step(still)


def test_a_mask_starts_episodes_of_some_environments(make_arm_task: Any) -> None:
    env = envs.BatchEnv(make_arm_task(), 3)
    first, _ = env.reset(seed=0)
    moved = first
    for _ in range(3):
        moved = env.step(np.ones((3, 7)))[0]
    observed, _ = env.reset(options={"reset_mask": np.array([False, True, False])})
    np.testing.assert_array_equal(observed[1], first[1])
    np.testing.assert_array_equal(observed[[0, 2]], moved[[0, 2]])


def test_worlds_with_rules_that_copies_cannot_follow_are_refused(make_arm_task: Any) -> None:
    plain = make_arm_task().build

    def bouncing(world: Any) -> Any:
        bodies = plain(world)
        bodies["box"].links[0].restitution = 0.5
        return bodies

    with pytest.raises(ModelError, match="restitution"):
        envs.BatchEnv(make_arm_task(build=bouncing), 2)


def test_a_simulation_that_diverges_ends_its_episode_alone(make_arm_task: Any, tmp_path: Any) -> None:
    from roboyard.envs.divergence import replay

    env = envs.BatchEnv(make_arm_task(), 3, state_folder=tmp_path)
    env.reset(seed=0)
    env.step(np.zeros((3, 7)))
    env.runner.physics.field("qvel")[1, 0] = 1e12
    observed, reward, terminated, truncated, info = env.step(np.zeros((3, 7)))
    assert info["diverged"].tolist() == terminated.tolist() == [False, True, False]
    assert np.isfinite(observed).all() and np.isfinite(reward).all() and np.isfinite(info["final_obs"]).all()
    assert not truncated.any()
    velocity = replay(env.runner.world, info["diverged_file"][1])
    assert not np.abs(velocity).max() < 1e6
    for _ in range(3):
        assert np.isfinite(env.step(np.ones((3, 7)))[0]).all()


@pytest.mark.parametrize("task", envs.task_ids())
def test_gymnasiums_own_vector_environment_gives_the_same(task: str) -> None:
    ours = envs.make_vec(task, 2, limit=6, autoreset="next_step")
    theirs = gymnasium.make_vec(task, num_envs=2, vectorization_mode="sync", limit=6)
    assert theirs.single_observation_space == ours.single_observation_space
    first, second = ours.reset(seed=4)[0], theirs.reset(seed=4)[0]
    assert np.array_equal(first, second)
    random = np.random.default_rng(0)
    for _ in range(15):
        actions = random.uniform(-1, 1, ours.action_space.shape).astype(np.float32)
        a, b = ours.step(actions), theirs.step(actions)
        for part in range(4):
            assert np.array_equal(a[part], b[part])
        assert ours.observation_space.contains(a[0])
    theirs.close()


def test_gymnasiums_wrappers_take_the_environments() -> None:
    counted = RecordEpisodeStatistics(envs.make_vec("roboyard/Reach-v0", 3, limit=7))
    counted.reset(seed=1)
    total, info = np.zeros(3), {}
    for _ in range(7):
        _, reward, _, _, info = counted.step(np.full((3, 7), 0.1, dtype=np.float32))
        total += reward
    np.testing.assert_allclose(info["episode"]["r"], total)
    assert info["episode"]["l"].tolist() == [7, 7, 7]
    scaled = NormalizeObservation(envs.make_vec("roboyard/Reach-v0", 3, autoreset="next_step"))
    scaled.reset(seed=1)
    assert np.isfinite(scaled.step(np.zeros((3, 7), dtype=np.float32))[0]).all()
