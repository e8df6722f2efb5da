"""Opening PyBullet's GUI as a page in the browser, for connect(GUI).

The page shows the client's world live, with its sliders, buttons, debug lines, points and texts; keys, mouse
and camera of the page are available to the script; bodies can be dragged. A script never waits for a browser,
and a page that is not open costs almost nothing. Without the extra `gui`, or with ROBOYARD_VIEWER=0 in the
environment, a GUI client has no page and works like a DIRECT one.
"""

from __future__ import annotations

import os
import sys

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.pybullet.client import Client

SWITCH = "ROBOYARD_VIEWER"
"""Environment variable; 0 disables the pages of GUI clients."""

_printed: set[str] = set()


def open_window(method: int, options: str) -> Client:
    """Return a client with a page, or without one if the page is disabled or not available.

    Args:
        method: GUI, GUI_SERVER or GUI_MAIN_THREAD.
        options: options of `connect`.

    Raises:
        error: an option is not valid.
    """
    if os.environ.get(SWITCH, "1").strip().lower() in ("0", "no", "off", "false"):
        return Client(method)
    from roboyard.pybullet.window.client import WindowClient
    from roboyard.pybullet.window.options import parse_options

    try:
        return WindowClient(method, parse_options(options))
    except MissingExtraError as problem:
        _print_once(f"GUI runs without a window: {problem}")
    except ConfigError as problem:
        _print_once(
            f"GUI runs without a window: {problem}; choose a port by --port=NUMBER in connect's options"
        )
    return Client(method)


def _print_once(text: str) -> None:
    if text not in _printed:
        _printed.add(text)
        print(f"roboyard: {text}", file=sys.stderr)
