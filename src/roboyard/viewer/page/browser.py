"""Open a page in the default browser of this machine."""

from __future__ import annotations

import os
import sys
import webbrowser


def has_display() -> bool:
    """Return whether this machine has a display."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_page(url: str) -> bool:
    """Open the default browser at `url`; returns False without a display or a browser."""
    if not has_display():
        return False
    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
