"""Videos and saved moments of a page that drives a robot."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from roboyard.errors import ConfigError
from roboyard.recording import Recorder, SceneSetup, VideoWriter
from roboyard.recording.state_log import StateLog, load_log
from roboyard.rendering import Camera

FPS = 15.0
"""Frames per second of simulated time."""
WIDTH, HEIGHT = 480, 360
"""Size of a video (pixels)."""


def endings() -> tuple[str, ...]:
    """Return the file name endings of the video formats that can be written here."""
    return ("gif", "mp4") if find_spec("imageio_ffmpeg") else ("gif",)


def free_file(folder: Path, stem: str, ending: str) -> Path:
    """Return `<stem>-1.<ending>`, or the first higher number whose file does not exist."""
    number = 1
    while (path := folder / f"{stem}-{number}.{ending}").exists():
        number += 1
    return path


class VideoRecording:
    """At most one video, recorded in simulated time."""

    def __init__(self) -> None:
        """Start without a video."""
        self.writer: VideoWriter | None = None
        self._next = 0.0

    def start(self, path: Path, time: float) -> None:
        """Start a video at the simulated `time` (s); raises as `VideoWriter` does."""
        self.stop()
        self.writer, self._next = VideoWriter(path, fps=FPS), time

    def add_frame(self, setup: SceneSetup, camera: Camera) -> None:
        """Add a frame if one is due."""
        time = setup.scene.world.time
        if self.writer is None or self._next - 2.0 / FPS <= time < self._next - 1e-9:
            return
        self.writer.add(setup.scene.world.render(camera))
        self._next = max(self._next, time - 1e-9) + 1.0 / FPS
        if self._next > time + 2.0 / FPS:  # an earlier state was restored
            self._next = time + 1.0 / FPS

    def stop(self) -> Path | None:
        """Finish the video; returns its path, or None without a video or without frames."""
        writer, self.writer = self.writer, None
        return None if writer is None else writer.close()


def moment_of(setup: SceneSetup) -> StateLog:
    """Return a log with the current state of a scene alone."""
    recorder = Recorder(setup.scene.world, setup=setup.setup)
    recorder.record()
    return recorder.log()


def read_moment(file: Path) -> StateLog:
    """Read a state log, whose last state can be restored.

    Raises:
        ConfigError: the file is no state log, is empty, or names no scene.
    """
    log = load_log(file)
    if not len(log) or not log.setup:
        raise ConfigError(f"{file.name}: no state of a named scene; save a moment on this page")
    return log


def is_same_scene(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    """Return whether two setups name the same scene and robot; controllers may differ."""
    return all(a.get(key) == b.get(key) for key in ("scene", "robot"))
