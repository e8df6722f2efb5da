"""Films and saved moments of a page that drives."""

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
WIDTH, HEIGHT = 480, 360
"""pixels of a film"""


def endings() -> tuple[str, ...]:
    """Kinds of films that can be written here."""
    return ("gif", "mp4") if find_spec("imageio_ffmpeg") else ("gif",)


def free_file(folder: Path, stem: str, ending: str) -> Path:
    """`<stem>-1.<ending>`, or the first number above whose file does not exist."""
    number = 1
    while (path := folder / f"{stem}-{number}.{ending}").exists():
        number += 1
    return path


class Filming:
    """A film that runs along with the world, or none."""

    def __init__(self) -> None:
        self.film: VideoWriter | None = None
        self._next = 0.0

    def start(self, path: Path, time: float) -> None:
        """Begin a film; raises as `VideoWriter` does."""
        self.stop()
        self.film, self._next = VideoWriter(path, fps=FPS), time

    def take(self, stage: SceneSetup, camera: Camera) -> None:
        """Add a picture, when one is due."""
        time = stage.scene.world.time
        if self.film is None or self._next - 2.0 / FPS <= time < self._next - 1e-9:
            return
        self.film.add(stage.scene.world.render(camera))
        self._next = max(self._next, time - 1e-9) + 1.0 / FPS
        if self._next > time + 2.0 / FPS:  # someone turned the clock back
            self._next = time + 1.0 / FPS

    def stop(self) -> Path | None:
        """Finish the film; its path, None where there was none or it has no picture."""
        film, self.film = self.film, None
        return None if film is None else film.close()


def moment_of(stage: SceneSetup) -> StateLog:
    """The present moment."""
    recorder = Recorder(stage.scene.world, setup=stage.setup)
    recorder.take()
    return recorder.log()


def read_moment(file: Path) -> StateLog:
    """The last moment of a state log is what is restored.

    Raises:
        ConfigError: the file is no state log, is empty, or does not say what it is of.
    """
    log = load_log(file)
    if not len(log) or not log.setup:
        raise ConfigError(f"{file.name}: has no moment of a known scene; save one on this page")
    return log


def same_words(a: Mapping[str, Any], b: Mapping[str, Any]) -> bool:
    """Whether two stages have the same scene and robot in them (controllers may differ)."""
    return all(a.get(key) == b.get(key) for key in ("scene", "robot"))
