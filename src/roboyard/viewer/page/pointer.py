"""Mouse events over the scene of any page of a server."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from roboyard.viewer.page.page_script import PageScript

FARTHEST = 100_000.0
"""Largest accepted coordinate (pixels)."""

_SCRIPT = """
  let waiting = [], moved = null, frame = 0;
  const over = e => e.target === window.__viserMutable?.canvas;
  const where = e => {
    const box = window.__viserMutable.canvas.getBoundingClientRect();
    return [Math.round(e.clientX - box.left), Math.round(e.clientY - box.top)];
  };
  const later = () => {
    frame ||= setTimeout(() => {
      frame = 0;
      if (moved) waiting.push(moved);
      moved = null;
      say(waiting.splice(0));
    }, 16);
  };
  const pressed = new Set();
  const move = e => { if (over(e) || pressed.size) { moved = ["move", ...where(e), -1]; later(); } };
  const press = is_down => e => {
    if (is_down ? !over(e) : !pressed.has(e.button)) return;
    if (is_down) pressed.add(e.button); else pressed.delete(e.button);
    if (moved) waiting.push(moved);
    moved = null;
    waiting.push([is_down ? "down" : "up", ...where(e), e.button]);
    later();
  };
  const listeners = {pointermove: move, pointerdown: press(true), pointerup: press(false)};
  for (const [kind, f] of Object.entries(listeners)) window.addEventListener(kind, f, true);
  return () => {
    clearTimeout(frame);
    for (const [kind, f] of Object.entries(listeners)) window.removeEventListener(kind, f, true);
  };
"""

Kind = Literal["move", "down", "up"]


@dataclass(frozen=True, kw_only=True, slots=True)
class PointerEvent:
    """Motion of the mouse, or the press or release of one of its buttons."""

    kind: Kind
    """Motion, press or release."""
    x: float
    """Distance from the left edge of the picture (pixels)."""
    y: float
    """Distance from the upper edge of the picture (pixels)."""
    button: int
    """0 left, 1 middle, 2 right; -1: none."""
    client: int
    """Number of the page's client."""


class Pointer:
    """Mouse of all pages of a server; motion at most 60 times a second."""

    def __init__(self, server: Any, listener: Callable[[PointerEvent], None]) -> None:
        """Call `listener` for each event in the thread of the server's event loop; it must return quickly."""
        self._listener = listener
        self._script = PageScript(server, "pointer", _SCRIPT, self._on_message)

    def _on_message(self, client: int, value: Any) -> None:
        for one in value if isinstance(value, list) else ():
            event = _event(one, client)
            if event is not None:
                self._listener(event)


def _event(value: Any, client: int) -> PointerEvent | None:
    if not (isinstance(value, list) and len(value) == 4):
        return None
    kind, x, y, button = value
    if not (kind in ("move", "down", "up") and isinstance(kind, str)):
        return None
    if not all(isinstance(v, int | float) and -FARTHEST < v < FARTHEST for v in (x, y)):
        return None
    if not (isinstance(button, int) and not isinstance(button, bool) and -1 <= button <= 4):
        return None
    return PointerEvent(kind=kind, x=float(x), y=float(y), button=button, client=client)
