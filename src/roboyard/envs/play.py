"""Running a trained policy: its episodes one after another, in a film or in the browser."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from roboyard.envs.gym_env import TaskEnv
from roboyard.envs.pictures.task_view import SIZE
from roboyard.envs.policy import Policy
from roboyard.envs.registration import make_task
from roboyard.errors import ConfigError


@dataclass(frozen=True, kw_only=True, slots=True)
class Episode:
    """The result of one episode."""

    number: int
    steps: int
    reward: float
    success: bool | None
    """Whether the goal was reached at the end; None where the task has none."""
    end: str
    """Cause of the end: "limit", or the name of a termination."""


def play(
    policy: Policy,
    *,
    steps: int | None = None,
    seed: int = 0,
    record: Path | None = None,
    viewer: bool = False,
    host: str = "127.0.0.1",
    port: int = 8080,
    open_browser: bool = False,
) -> Generator[Episode]:
    """Run a policy and yield the result of each episode.

    Args:
        policy: to run.
        steps: actions in all; None: without end.
        seed: of the first episode.
        record: film to write (.gif or .mp4).
        viewer: show a page in the browser, at the speed of the clock.
        host: address of the page.
        port: first port to try for the page.
        open_browser: open a browser on the page if there is a display.

    Raises:
        ConfigError: the policy does not fit its task.
    """
    task = make_task(policy.task, **dict(policy.options))
    env = TaskEnv(task)
    inputs, outputs = policy.layers[0][0].shape[1], policy.layers[-1][0].shape[0]
    size = sum(env.runner.observer.sizes.values()), env.runner.action_size
    if (inputs, outputs) != size:
        raise ConfigError(
            f"the policy has {inputs} inputs and {outputs} outputs, the task {policy.task} {size[0]} and "
            f"{size[1]}"
        )
    page = _open(env, host, port, open_browser=open_browser) if viewer else None
    writer = _Film(record, env) if record is not None else None
    observed, _ = env.reset(seed=seed)
    number, total, count, start, begun = 1, 0.0, 0, 0, time.monotonic()
    try:
        while steps is None or count < steps:
            observed, reward, terminated, truncated, info = env.step(policy(observed).astype(np.float32))
            count, total = count + 1, total + reward
            if page is not None:
                _ = env.world
                page.sync()
                time.sleep(max(0.0, begun + count * env.runner.env.dt - time.monotonic()))
            if writer is not None:
                writer.add(count)
            if terminated or truncated or count == steps:
                causes = [name for name in task.terminations if info.get(name)]
                cause = "diverged" if info["diverged"] else (causes or ["limit"])[0]
                yield Episode(
                    number=number,
                    steps=count - start,
                    reward=total,
                    success=info.get("success"),
                    end=cause if terminated or truncated else "stopped",
                )
                observed, _ = env.reset()
                number, total, start = number + 1, 0.0, count
    finally:
        if writer is not None:
            writer.close()
        if page is not None:
            page.close()


def film(file: Path | str, policy: Policy, *, seconds: float = 6.0, seed: int = 0) -> None:
    """Write a film of a policy in its task, with a camera that follows the robot.

    Args:
        file: GIF or MP4.
        policy: to show.
        seconds: length, in simulated time (s).
        seed: of the first episode.
    """
    task = make_task(policy.task, **dict(policy.options))
    steps = round(seconds / (task.substeps * task.timestep))
    for _ in play(policy, steps=steps, seed=seed, record=Path(file)):
        pass


def _open(env: TaskEnv, host: str, port: int, *, open_browser: bool) -> Any:
    from roboyard.viewer import Viewer

    page = Viewer(env.world, host, port, follow_steps=False)
    if open_browser:
        from roboyard.viewer.page.browser import open_page

        open_page(page.url)
    return page


class _Film:
    """A film that follows the robot."""

    def __init__(self, file: Path, env: TaskEnv) -> None:
        from roboyard.recording import VideoWriter

        self._env = env
        self._every = max(1, round(1.0 / (20 * env.runner.env.dt)))
        self._writer = VideoWriter(file, fps=1.0 / (self._every * env.runner.env.dt))
        self._start: np.ndarray | None = None

    def add(self, count: int) -> None:
        """Add a picture, if one is due after so many actions."""
        from roboyard.rendering import Camera

        if count % self._every:
            return
        env = self._env
        here = env.runner.env.robot.base.position[0].copy()
        self._start = here if self._start is None else self._start
        moved = here - self._start
        moved[2] = 0.0
        eye, target = (np.array(point) + moved for point in env.runner.task.view)
        camera = Camera.look_at(eye, target, width=SIZE[0], height=SIZE[1])
        self._writer.add(env.world.render(camera))

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()
