"""MP4 videos of the visualizer's camera, in simulated time."""

from __future__ import annotations

import sys
from collections.abc import Generator
from typing import TYPE_CHECKING, Any

from roboyard.errors import install_command
from roboyard.pybullet.face.errors import failure

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client
    from roboyard.pybullet.logs.log_set import Recorder

FRAMES_PER_SECOND = 60
WIDTH, HEIGHT = 640, 480


def open_video(client: Client, name: str, frames_per_second: float = FRAMES_PER_SECOND) -> Recorder:
    """Return a recorder that writes an MP4 file; without the encoder, a warning and one that writes nothing.

    Raises:
        error: the file cannot be written.
    """
    try:
        path = client.output_files.path(name)
    except OSError as problem:
        raise failure("startStateLogging failed.", str(problem)) from None
    try:
        from imageio_ffmpeg import write_frames
    except ImportError:
        print(
            f"roboyard: {name} is not written; videos need an encoder: {install_command('video')}",
            file=sys.stderr,
        )
        return _NoVideo()
    return _Video(client, str(path), write_frames, frames_per_second)


class _NoVideo:
    def record(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class _Video:
    def __init__(self, client: Client, name: str, write_frames: Any, frames_per_second: float) -> None:
        self._client, self._name = client, name
        self._writer: Generator[None, bytes | None, None] = write_frames(
            name, (WIDTH, HEIGHT), fps=frames_per_second, macro_block_size=16, ffmpeg_log_level="error"
        )
        try:
            self._writer.send(None)
        except OSError as problem:
            raise failure("startStateLogging failed.", f"cannot write {name}: {problem}") from None
        self._period = 1.0 / frames_per_second
        self._time = self._due = 0.0

    def record(self) -> None:
        """Add the frames that are due at the current simulated time."""
        client = self._client
        self._time += client.scene.time_step
        image = None
        while self._due <= self._time + 1e-9:
            if image is None:
                image = client.getCameraImage(WIDTH, HEIGHT, shadow=1)[2][..., :3].tobytes()
            try:
                self._writer.send(image)
            except OSError as problem:
                raise failure("stepSimulation failed.", f"cannot write {self._name}: {problem}") from None
            self._due += self._period

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()
