"""Render a state log as a video."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from roboyard.errors import ConfigError
from roboyard.recording.scene_setup import SceneSetup, set_up
from roboyard.recording.state_log import StateLog
from roboyard.recording.video import VideoWriter


def frame_indices(log: StateLog, fps: float) -> Iterator[int]:
    """Yield for each picture of a video the index of the last recorded state at or before its time.

    Jumps back in time, which a reset causes, are removed.

    Args:
        log: the recorded states.
        fps: pictures a second.
    """
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
    scene_setup: SceneSetup | None = None,
) -> int:
    """Write a video of a log, by the camera of its scene, and return the number of pictures.

    Args:
        log: the recorded states.
        path: the .gif or .mp4 file to write.
        fps: pictures a second.
        width: width of the pictures (pixels).
        height: height of the pictures (pixels).
        scene_setup: the scene to show them in; set up again from the log by default.

    Raises:
        ConfigError: the log has no setup and `scene_setup` is not given, or the scene has other joints.
    """
    if scene_setup is None:
        if not log.setup:
            raise ConfigError(
                f"the log of {len(log)} states has no setup to build its scene from; "
                "call replay_video with scene_setup"
            )
        scene_setup = set_up(log.setup)
    world = scene_setup.scene.world
    log.check_fits(world)
    camera = scene_setup.scene.camera(width=width, height=height)
    with VideoWriter(path, fps=fps) as video:
        for k in frame_indices(log, fps):
            log.restore(world, k)
            video.add(world.render(camera))
        return video.count
