"""Opening a page where someone sits in front of the machine."""

from __future__ import annotations

import os
import sys
import webbrowser


def has_display() -> bool:
    """Whether windows can open here."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_page(url: str) -> bool:
    """Open the user's browser at `url`; False where there is no display or no browser."""
    if not has_display():
        return False
    try:
        return webbrowser.open(url)
    except webbrowser.Error:
        return False
