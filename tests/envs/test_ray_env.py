"""Environments on Ray actors: as in one process, and actors that die take only their own episodes."""

from __future__ import annotations

import gc
import socket
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

ray = pytest.importorskip("ray")

import roboyard.envs as envs  # noqa: E402
from roboyard.envs import ray_worker  # noqa: E402
from roboyard.envs.ray_env import RayEnv  # noqa: E402
from roboyard.errors import ConfigError  # noqa: E402

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


def wait_until_free(count: float) -> None:
    """Wait until no actor takes one of so many CPUs."""
    until = time.monotonic() + 30.0
    while ray.available_resources().get("CPU", 0) < count and time.monotonic() < until:
        time.sleep(0.2)
    assert ray.available_resources()["CPU"] == count


def test_actors_agree_with_one_process_and_one_that_dies_is_replaced(cluster: None) -> None:
    """Environments that are then dropped leave no actor."""
    free = ray.cluster_resources()["CPU"]
    options: dict[str, Any] = {"limit": 20}
    many = envs.make_vec("roboyard/Reach-v0", 6, backend="ray", workers=2, **options)
    alone = envs.make_vec("roboyard/Reach-v0", 6, **options)
    assert np.array_equal(many.reset(seed=3)[0], alone.reset(seed=3)[0])
    random = np.random.default_rng(0)
    for _ in range(25):
        actions = random.uniform(-1, 1, (6, 7))
        ours, theirs = many.step(actions), alone.step(actions)
        for part in range(4):
            assert np.array_equal(ours[part], theirs[part])
        assert np.array_equal(ours[4]["success"], theirs[4]["success"])
    ray.kill(many._workers[0].actor)
    until = time.monotonic() + 30.0
    while True:  # Ray takes a moment
        actions = random.uniform(-1, 1, (6, 7))
        ours, theirs = many.step(actions), alone.step(actions)
        if ours[4]["restarted"].any() or time.monotonic() > until:
            break
        assert np.array_equal(ours[0], theirs[0])
    assert ours[4]["restarted"].tolist() == [True] * 3 + [False] * 3
    assert ours[3][:3].all() and not ours[3][3:].any()
    assert np.array_equal(ours[0][3:], theirs[0][3:])
    assert np.isfinite(ours[0]).all() and many.restarts == 1
    ours, theirs = many.step(actions), alone.step(actions)
    assert not ours[4]["restarted"].any() and np.array_equal(ours[0][3:], theirs[0][3:])
    del many
    gc.collect()
    wait_until_free(free)


def test_more_workers_than_environments_are_an_error(cluster: None) -> None:
    with pytest.raises(ConfigError, match="workers"):
        envs.make_vec("roboyard/Reach-v0", 2, backend="ray", workers=3)
    with pytest.raises(ConfigError, match="control"):
        envs.make_vec("roboyard/Reach-v0", 2, backend="ray", controll="tip")


def _fails() -> Any:
    raise ConfigError("this machine has no such robot")


def test_an_error_of_the_task_is_raised_as_it_is_and_no_actor_is_tried_again(cluster: None) -> None:
    with pytest.raises(ConfigError, match="this machine has no such robot") as raised:
        RayEnv(_fails, 2, workers=2)
    assert "Traceback" not in str(raised.value)


def test_an_error_in_a_new_actor_is_not_called_a_death(cluster: None) -> None:
    many = envs.make_vec("roboyard/Reach-v0", 2, backend="ray", workers=2)
    many.reset(seed=0)
    many._make = _fails
    ray.kill(many._workers[1].actor)
    with pytest.raises(ConfigError, match="no such robot"):
        until = time.monotonic() + 30.0
        while time.monotonic() < until:  # Ray takes a moment
            many.step(np.zeros((2, 7)))
    assert many.restarts == 1
    many.close()


def test_actors_on_other_machines_are_reached_over_tcp(
    cluster: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ray_worker, "_node", lambda: "another")
    many = envs.make_vec("roboyard/Reach-v0", 4, backend="ray", workers=2)
    address, secret = ray.get(many._workers[1]._place, timeout=60)
    assert isinstance(address, tuple) and len(secret) == 32
    with socket.create_connection(address, timeout=10) as stranger:
        stranger.sendall(b"GET / HTTP/1.0\r\n\r\n")
    alone = envs.make_vec("roboyard/Reach-v0", 4)
    assert np.array_equal(many.reset(seed=3)[0], alone.reset(seed=3)[0])
    actions = np.random.default_rng(0).uniform(-1, 1, (4, 7))
    assert np.array_equal(many.step(actions)[0], alone.step(actions)[0])
    many.close()
