"""Names of the tasks, for `gymnasium.make` and `make_vec`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from roboyard.errors import ConfigError, unknown_name

if TYPE_CHECKING:
    from roboyard.envs.task import Task

TASKS: dict[str, str] = {
    "roboyard/DriveTo-v0": "roboyard.envs.tasks.drive_to:drive_to",
    "roboyard/HuskyTerrain-v0": "roboyard.envs.tasks.husky_terrain:husky_terrain",
    "roboyard/Locomotion-v0": "roboyard.envs.tasks.locomotion:locomotion",
    "roboyard/OpenDrawer-v0": "roboyard.envs.tasks.open_drawer:open_drawer",
    "roboyard/PickAndPlace-v0": "roboyard.envs.tasks.pick_and_place:pick_and_place",
    "roboyard/Push-v0": "roboyard.envs.tasks.push:push",
    "roboyard/Reach-v0": "roboyard.envs.tasks.reach:reach",
}
"""Id to the function that returns the task, as module:function."""
_ADDED: dict[str, Callable[..., Task]] = {}
_ENV_KEYS = ("obs_modalities", "render_mode", "state_folder")


def task_ids() -> tuple[str, ...]:
    """Return the ids of all tasks."""
    return (*TASKS, *_ADDED)


def register_task(id: str, make: Callable[..., Task]) -> None:
    """Give a task a name, for `gymnasium.make` and `make_vec`.

    Args:
        id: such as "my/Pour-v0".
        make: returns the task; its keyword arguments become those of `gymnasium.make`.

    Raises:
        ConfigError: Roboyard has a task of that id.
    """
    if id in TASKS:
        raise ConfigError(f"the id {id!r} is taken")
    _ADDED[id] = make
    _register(id)


def make_task(id: str, **options: Any) -> Task:
    """Return a task by id.

    Args:
        id: such as "roboyard/Reach-v0".
        options: keywords of the function that makes it.

    Raises:
        ConfigError: there is no such task or option; the message lists the nearest.
    """
    if id in _ADDED:
        function = _ADDED[id]
    elif id in TASKS:
        module, name = TASKS[id].split(":")
        function = getattr(import_module(module), name)
    else:
        raise ConfigError(unknown_name("task", id, task_ids()))
    import inspect

    known = inspect.signature(function).parameters
    if not any(p.kind is p.VAR_KEYWORD for p in known.values()):
        for key in options:
            if key not in known:
                raise ConfigError(f"{id}: {unknown_name('option', key, (*known, *_ENV_KEYS))}")
    return function(**options)


def make_env(task_id: str, render_mode: str | None = None, **options: Any) -> Any:
    """Return one environment of a task; `gymnasium.make` calls this.

    Args:
        task_id: of the task.
        render_mode: as in `TaskEnv`.
        options: of `TaskEnv`, and of the task.
    """
    from roboyard.envs.gym_env import TaskEnv

    own = {key: options.pop(key) for key in _ENV_KEYS if key in options}
    return TaskEnv(make_task(task_id, **options), render_mode=render_mode, **own)


def make_vec(
    task: str | Task,
    num_envs: int,
    *,
    backend: str = "batch",
    **options: Any,
) -> Any:
    """Return many environments of a task, as a `gymnasium.vector.VectorEnv`.

    Args:
        task: an id, or a task.
        num_envs: number of environments.
        backend: "batch": threads of this process; "ray": Ray actors on one machine or a cluster, each with a
            batch (extra `cluster`); "warp": MuJoCo Warp on a CUDA GPU, or on its CPU device (extra `warp`).
        options: of the back end (`BatchEnv`, `RayEnv`, `WarpEnv`); others are the task's.

    Raises:
        ConfigError: there is no such task, back end or option.
    """
    from roboyard.envs.task import Task

    makers = {"batch": "vector_env:BatchEnv", "ray": "ray_env:RayEnv", "warp": "on_warp.warp_env:WarpEnv"}
    if backend not in makers:
        raise ConfigError(unknown_name("back end", backend, makers))
    module, name = makers[backend].split(":")
    make = getattr(import_module(f"roboyard.envs.{module}"), name)
    import inspect

    known = inspect.signature(make.__init__).parameters
    own = {key: options.pop(key) for key in tuple(options) if key in known}
    if isinstance(task, Task):
        if options:
            raise ConfigError(unknown_name("option", next(iter(options)), list(known)[3:]))
        return make(task, num_envs, **own)
    if backend == "ray":
        return make((task, options), num_envs, **own)
    return make(make_task(task, **options), num_envs, **own)


def _make_vector(task_id: str, num_envs: int, **options: Any) -> Any:
    options.pop("vectorization_mode", None)
    return make_vec(task_id, num_envs, **options)


def _register(task_id: str) -> None:
    import gymnasium

    if task_id in gymnasium.registry:
        return
    gymnasium.register(
        task_id,
        entry_point=f"{__name__}:{make_env.__name__}",
        vector_entry_point=f"{__name__}:{_make_vector.__name__}",
        kwargs={"task_id": task_id},
        disable_env_checker=False,
    )


def register_all() -> None:
    """Register all tasks with Gymnasium; importing `roboyard.envs` does."""
    for task_id in TASKS:
        _register(task_id)
