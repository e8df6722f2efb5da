"""A state log as a film."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from roboyard.errors import ConfigError
from roboyard.recording.scene_setup import SceneSetup, set_up
from roboyard.recording.state_log import StateLog
from roboyard.recording.video import VideoWriter


def moments(log: StateLog, fps: float) -> Iterator[int]:
    """For each picture of a film, the last moment at or before its time; jumps back in time are cut out."""
    if not len(log):
        return
    steps = np.diff(log.time)
    steps[steps < 0] = np.median(steps[steps >= 0]) if (steps >= 0).any() else 0.0
    played = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(np.floor(played[-1] * fps + 1e-9)) + 1
    for k in range(count):
        yield max(int(np.searchsorted(played, k / fps + 1e-9, side="right")) - 1, 0)


def replay_video(
    log: StateLog,
    path: str | Path,
    *,
    fps: float = 20.0,
    width: int = 480,
    height: int = 360,
    stage: SceneSetup | None = None,
) -> int:
    """Film a log in its world, from the scene's own view; returns how many pictures.

    Args:
        log: what to show.
        path: .gif or .mp4.
        fps: pictures a second.
        width: pixels.
        height: pixels.
        stage: the world; set up again from the log by default.

    Raises:
        ConfigError: the log does not say how its world was set up, or the world is another one now.
    """
    if stage is None:
        if not log.setup:
            raise ConfigError("the log does not say how its world was set up; only who made it can show it")
        stage = set_up(log.setup)
    world = stage.scene.world
    log.check_fits(world)
    camera = stage.scene.camera(width=width, height=height)
    with VideoWriter(path, fps=fps) as film:
        for k in moments(log, fps):
            log.restore(world, k)
            film.add(world.render(camera))
        return film.count
