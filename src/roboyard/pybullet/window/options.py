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
"""Background of PyBullet's window (red, green, blue; 0 to 1)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WindowOptions:
    """Options of a window."""

    width: int = 1024
    """Width that getDebugVisualizerCamera reports while no browser is open (pixels)."""
    height: int = 768
    """Height, likewise (pixels)."""
    background: tuple[float, float, float] = BACKGROUND
    """Background (red, green, blue; 0 to 1)."""
    port: int = DEFAULT_PORT
    """First port to try."""
    host: str = "127.0.0.1"
    """Address to listen on."""
    mp4: str = ""
    """File for a video of the whole session; empty for none."""
    mp4fps: float = 60.0
    """Frame rate of the video (1/s of simulated time)."""
    frame_ms: float = 1000.0 / 60.0
    """Shortest time between two frames of the page (ms)."""


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
_RENDERER_OPTIONS = frozenset(
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
    """Parse the options of `connect`; those of PyBullet's renderer are ignored, unknown ones printed.

    Raises:
        error: a value is not valid.
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
            elif name not in _RENDERER_OPTIONS:
                unknown.append(word)
        except ValueError:
            raise failure("connect failed.", f"--{name} must be a number, got {value!r}") from None
    if unknown:
        print(f"roboyard: connect(GUI) has no options {' '.join(unknown)}", file=sys.stderr)
    for name in ("width", "height", "mp4fps", "frame_ms"):
        if getattr(options, name) <= 0:
            raise failure("connect failed.", f"{name} must be positive, got {getattr(options, name)}")
    r, g, b = color
    return replace(options, background=(r, g, b))
