"""Environments on Ray actors, on one machine or a cluster, as a `gymnasium.vector.VectorEnv`.

Each actor has a part of the environments in one batch. Environments start with the same seeds as in one
process. An actor that dies is replaced: its environments start new episodes, the others go on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from roboyard.envs.batch_physics import check_count
from roboyard.envs.ray_worker import Worker, WorkerDied, WorkerLine, ray
from roboyard.envs.registration import make_task
from roboyard.envs.task import Task
from roboyard.errors import ConfigError, RoboyardError

ATTEMPTS = 3
"""Actors that are tried in place of one that died."""


class RayEnv(VectorEnv[Any, np.ndarray, np.ndarray]):
    """n environments of a task on several Ray actors; otherwise as `BatchEnv` in the mode "same_step".

    `info["restarted"]`, (n,), names the environments whose actor was replaced in this step: their reward is
    0, their episode is cut off, and the observation is the first of a new one.
    """

    def __init__(
        self,
        task: str | tuple[str, Mapping[str, Any]] | Callable[[], Task],
        num_envs: int,
        *,
        workers: int = 2,
        threads: int = 1,
        obs_modalities: Sequence[str] | None = None,
    ) -> None:
        """Start the actors; `ray.init()` is called where Ray is not connected yet.

        Args:
            task: an id, (id, options), or a function that returns a task; Ray sends it to the actors.
            num_envs: n.
            workers: number of actors.
            threads: of the processor, for each actor.
            obs_modalities: as in `BatchEnv`.

        Raises:
            ConfigError: there are more workers than environments, or the task is wrong.
            MissingExtraError: Ray is not installed.
            Exception: what the function raises in an actor.
            RoboyardError: actors die while they start, or run on machines that cannot be reached from here.
        """
        check_count(num_envs)
        if not 1 <= workers <= num_envs:
            raise ConfigError(
                f"workers must be from 1 to {num_envs}, the number of environments, got {workers}"
            )
        if not ray.is_initialized():
            ray.init(include_dashboard=False, configure_logging=True, log_to_driver=False)
        self.num_envs = num_envs
        bounds = np.linspace(0, num_envs, workers + 1).astype(int)
        self._parts = [slice(int(a), int(b)) for a, b in pairwise(bounds)]
        self._make = _maker(task)
        self._threads, self._modalities = threads, obs_modalities
        remote: Any = ray.remote  # whose types lack `enable_task_events`
        self._actor: Any = remote(num_cpus=threads, max_restarts=0, enable_task_events=False)(Worker)
        self._workers = [self._start(k) for k in range(workers)]
        observation, action = self._spaces()
        self.single_observation_space, self.single_action_space = observation, action
        self.observation_space = batch_space(observation, num_envs)
        self.action_space = batch_space(action, num_envs)
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}
        self.render_mode = None
        self.restarts = 0
        """Number of actors that were replaced."""
        self._is_reset = False

    def _start(self, k: int) -> WorkerLine:
        part = self._parts[k]
        size = part.stop - part.start
        actor = self._actor.remote(self._make, size, part.start, self._threads, self._modalities)
        return WorkerLine(actor, k)

    def _spaces(self) -> tuple[Any, Any]:
        try:
            self._workers[0].send("spaces")
            return self._workers[0].receive()
        except BaseException as error:
            self.close()
            if isinstance(error, WorkerDied):
                raise RoboyardError("worker 0 died while it started; see Ray's logs") from None
            raise

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start new episodes in all environments; seeds as in `BatchEnv.reset`."""
        if seed is not None and not isinstance(seed, int | np.integer) and len(seed) != self.num_envs:
            raise RoboyardError(f"give one seed for each of {self.num_envs} environments, got {len(seed)}")
        asked = [self._ask(k, "reset", _seeds_of(seed, part)) for k, part in enumerate(self._parts)]
        observed = []
        for k, is_asked in enumerate(asked):
            try:
                observed.append(self._result(k, is_asked))
            except WorkerDied:
                observed.append(self._replace(k, seed))
        self._is_reset = True
        return _joined(observed), {}

    def step(self, actions: np.ndarray) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance all n environments by actions (n, a); as `BatchEnv.step`, with `info["restarted"]`."""
        if not self._is_reset:
            raise RoboyardError("call reset() before the first step()")
        given = np.asarray(actions)
        expected = (self.num_envs, *self.single_action_space.shape)  # type: ignore[misc]
        if given.shape != expected:
            raise RoboyardError(f"actions must have shape {expected}, got {given.shape}")
        given = np.ascontiguousarray(given, dtype=float)
        asked = [self._ask(k, "step", given[part]) for k, part in enumerate(self._parts)]
        restarted = np.zeros(self.num_envs, dtype=bool)
        results: list[Any] = []
        for k, is_asked in enumerate(asked):
            try:
                results.append(self._result(k, is_asked))
            except WorkerDied:
                part = self._parts[k]
                restarted[part] = True
                size = part.stop - part.start
                cut = np.ones(size, dtype=bool)
                results.append((self._replace(k, None), np.zeros(size), np.zeros(size, dtype=bool), cut, {}))
        observed, reward, terminated, truncated = (
            _joined([result[i] for result in results]) for i in range(4)
        )
        info = _joined_info([result[4] for result in results], self._parts, self.num_envs)
        info["restarted"] = restarted
        return observed, reward, terminated, truncated, info

    def _ask(self, k: int, name: str, argument: Any) -> bool:
        """Send a request to a worker; return False if it has died."""
        try:
            self._workers[k].send(name, argument)
        except WorkerDied:
            return False
        return True

    def _result(self, k: int, is_asked: bool) -> Any:
        if not is_asked:
            raise WorkerDied
        return self._workers[k].receive()

    def _replace(self, k: int, seed: Any) -> Any:
        """Start another actor in place of one that died, and its episodes; return the observations.

        Raises:
            RoboyardError: the new ones died, too.
        """
        for _ in range(ATTEMPTS):
            self.restarts += 1
            self._workers[k].close()
            self._workers[k] = self._start(k)
            if self._ask(k, "reset", _seeds_of(seed, self._parts[k])):
                try:
                    return self._workers[k].receive()
                except WorkerDied:
                    continue
        raise RoboyardError(f"worker {k} died {ATTEMPTS} times while it started; see Ray's logs")

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the actors."""
        for worker in self._workers:
            worker.close()
        self._workers = []


def _seeds_of(seed: Any, part: slice) -> Any:
    """Return the seeds of a part of the environments; one seed is that of the first of all."""
    return seed if seed is None or isinstance(seed, int | np.integer) else list(seed[part])


class _Registered:
    """Makes a task by id, in another process."""

    def __init__(self, task: str, options: Mapping[str, Any]) -> None:
        self.task, self.options = task, dict(options)

    def __call__(self) -> Task:
        return make_task(self.task, **self.options)


def _maker(task: Any) -> Callable[[], Task]:
    if isinstance(task, str):
        task = (task, {})
    if isinstance(task, tuple):
        make_task(task[0], **task[1])  # errors are raised here, not in an actor
        return _Registered(*task)
    if isinstance(task, Task) or not callable(task):
        raise ConfigError("give Ray an id, (id, options), or a function that returns a task")
    return cast("Callable[[], Task]", task)


def _joined(parts: Sequence[Any]) -> Any:
    if isinstance(parts[0], dict):
        return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    return np.concatenate(parts)


def _joined_info(infos: Sequence[dict[str, Any]], parts: Sequence[slice], count: int) -> dict[str, Any]:
    """Return the information of all parts as arrays with n rows; zeros where a part has none."""
    found: dict[str, Any] = {}
    for info, part in zip(infos, parts, strict=True):
        for key, value in info.items():
            if isinstance(value, dict):
                inner = found.setdefault(key, {})
                for name, array in value.items():
                    _put(inner, name, array, part, count)
            else:
                _put(found, key, value, part, count)
    return found


def _put(found: dict[str, Any], key: str, value: Any, part: slice, count: int) -> None:
    array = np.asarray(value, dtype=object if isinstance(value, list) else None)
    if key not in found:
        empty = None if array.dtype == object else 0
        found[key] = np.full((count, *array.shape[1:]), empty, dtype=array.dtype)
    found[key][part] = array
