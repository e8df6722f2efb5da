"""Write pictures to a GIF or MP4 video."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.rendering import Image, save_gif

if TYPE_CHECKING:
    from numpy.typing import NDArray

ENDINGS = (".gif", ".mp4")
"""File endings of videos."""


class VideoWriter:
    """Writes a video picture by picture; a context manager, or call `close` at the end.

    An MP4 is encoded while pictures are added, a GIF when it is closed.
    """

    def __init__(self, path: str | Path, *, fps: float = 20.0) -> None:
        """Begin a video.

        Args:
            path: the .gif file to write, or .mp4 with the extra "video".
            fps: pictures a second; at most 50 in a GIF and 240 in an MP4.

        Raises:
            ConfigError: `path` has another ending or its folder is missing, or `fps` is out of range.
            MissingExtraError: an MP4 without imageio-ffmpeg installed.
        """
        self.path = Path(path)
        ending = self.path.suffix.lower()
        if ending not in ENDINGS:
            raise ConfigError(f"the file of a video must end in .gif or .mp4, got {str(path)!r}")
        most = 50.0 if ending == ".gif" else 240.0
        if not 0 < fps <= most:
            raise ConfigError(f"{self.path.name}: fps must be above 0 and at most {most:g}, got {fps:g}")
        if not self.path.parent.is_dir():
            raise ConfigError(f"{self.path}: folder {str(self.path.parent)!r} not found; create it")
        self.fps = fps
        self.count = 0
        """Number of pictures so far."""
        self._frames: list[NDArray[np.uint8]] = []
        self._shape: tuple[int, ...] | None = None
        self._ffmpeg = _ffmpeg() if ending == ".mp4" else None
        self._pipe: Any = None

    def add(self, picture: Image | NDArray[np.uint8]) -> None:
        """Append a picture.

        Args:
            picture: an image, or (h, w, 3 or 4) uint8 colours, of the size of the first picture.

        Raises:
            ValueError: it has another size than the first.
        """
        pixels = np.ascontiguousarray((picture.rgba if isinstance(picture, Image) else picture)[..., :3])
        if self._shape is None:
            self._shape = pixels.shape
        if pixels.shape != self._shape:
            raise ValueError(
                f"pictures of a video must have one size, got {pixels.shape} after {self._shape}"
            )
        self.count += 1
        if self._ffmpeg is None:
            self._frames.append(pixels)
            return
        if self._pipe is None:
            h, w = pixels.shape[:2]
            self._pipe = self._ffmpeg.write_frames(
                str(self.path), (w, h), fps=self.fps, macro_block_size=2, quality=7, ffmpeg_log_level="error"
            )
            self._pipe.send(None)
        self._pipe.send(pixels)

    def close(self) -> Path | None:
        """Finish the file and return its path, or None if no picture was added."""
        if self._pipe is not None:
            self._pipe.close()
            self._pipe = None
        elif self._frames:
            save_gif(self.path, self._frames, fps=self.fps)
            self._frames = []
        return self.path if self.count else None

    def __enter__(self) -> VideoWriter:
        """Return the writer."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the file."""
        self.close()


def _ffmpeg() -> Any:
    from importlib import import_module

    try:
        return import_module("imageio_ffmpeg")
    except ImportError:
        raise MissingExtraError("imageio-ffmpeg", "video", "writing MP4") from None
