"""The options of connect(GUI): one string, `--name=value --name ...`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from roboyard.pybullet.face.errors import failure
from roboyard.viewer.page.server import DEFAULT_PORT

BACKGROUND = (0.7, 0.7, 0.8)
"""rgb, 0 to 1, of PyBullet's window"""


@dataclass(frozen=True, kw_only=True, slots=True)
class WindowOptions:
    """What a script asked its window to be."""

    width: int = 1024
    """pixels; told by getDebugVisualizerCamera while no browser is open"""
    height: int = 768
    background: tuple[float, float, float] = BACKGROUND
    """rgb, 0 to 1"""
    port: int = DEFAULT_PORT
    """First port to try."""
    host: str = "127.0.0.1"
    """Address to listen at."""
    mp4: str = ""
    """File of a film of the whole session."""
    mp4fps: float = 60.0
    """Its pictures a second of simulated time."""
    frame_ms: float = 1000.0 / 60.0
    """Least time between two pictures of the page; ms"""


_FIELDS: dict[str, tuple[str, Callable[[str], Any]]] = {
    "width": ("width", int),
    "height": ("height", int),
    "port": ("port", int),
    "host": ("host", str),
    "mp4": ("mp4", str),
    "mp4fps": ("mp4fps", float),
    "minGraphicsUpdateTimeMs": ("frame_ms", float),
}
_COLORS = ("background_color_red", "background_color_green", "background_color_blue")
_OF_ITS_RENDERER = frozenset(
    {
        *(
            "opengl2",
            "window_backend",
            "render_device",
            "max_num_object_capacity",
            "tracing",
            "fixed_timestep",
        ),
        *(
            "max_shape_capacity_in_bytes",
            "mouse_move_multiplier",
            "mouse_wheel_multiplier",
            "start_demo_name",
        ),
        *("disable_shadow", "enable_pngoutput", "png_skip_frames", "shared_memory_key", "sharedMemoryKey"),
    }
)
"""Options of PyBullet's own window that have no counterpart in a browser."""


def parse_options(text: str) -> WindowOptions:
    """Read connect's options; those of PyBullet's renderer mean nothing here, others are named on stderr.

    Raises:
        error: a value is not of the kind its option takes.
    """
    options, unknown = WindowOptions(), []
    color = list(options.background)
    for word in shlex.split(text):
        name, _, value = word.removeprefix("--").partition("=")
        try:
            if name in _COLORS:
                color[_COLORS.index(name)] = float(value)
            elif name in _FIELDS:
                field, kind = _FIELDS[name]
                options = replace(options, **{field: kind(value)})
            elif name not in _OF_ITS_RENDERER:
                unknown.append(word)
        except ValueError:
            raise failure("connect failed.", f"--{name} takes a number, not {value!r}") from None
    if unknown:
        print(f"roboyard: connect(GUI) has no options {' '.join(unknown)}", file=sys.stderr)
    for name in ("width", "height", "mp4fps", "frame_ms"):
        if getattr(options, name) <= 0:
            raise failure("connect failed.", f"{name} is positive; got {getattr(options, name)}")
    r, g, b = color
    return replace(options, background=(r, g, b))
