"""Keyboard and mouse events of a window, stored until a script reads them."""

from __future__ import annotations

from _thread import allocate_lock
from collections import deque
from collections.abc import Mapping

from roboyard.pybullet.face import constants as c

MOUSE_MOVE, MOUSE_BUTTON = 1, 2
MAX_MOUSE_EVENTS = 256
"""Largest number of stored events; older ones are dropped."""

MouseEvent = tuple[int, float, float, int, int]

_NAMED: Mapping[str, int] = {
    "Escape": 27,
    "Tab": 9,
    "ArrowLeft": c.B3G_LEFT_ARROW,
    "ArrowRight": c.B3G_RIGHT_ARROW,
    "ArrowUp": c.B3G_UP_ARROW,
    "ArrowDown": c.B3G_DOWN_ARROW,
    "PageUp": c.B3G_PAGE_UP,
    "PageDown": c.B3G_PAGE_DOWN,
    "End": c.B3G_END,
    "Home": c.B3G_HOME,
    "Insert": c.B3G_INSERT,
    "Delete": c.B3G_DELETE,
    "Backspace": c.B3G_BACKSPACE,
    "Shift": c.B3G_SHIFT,
    "Control": c.B3G_CONTROL,
    "Alt": c.B3G_ALT,
    "Enter": c.B3G_RETURN,
    **{f"F{k}": c.B3G_F1 + k - 1 for k in range(1, 16)},
}


def key_code(name: str) -> int | None:
    """Return PyBullet's code of a browser's key name, or None if PyBullet has none."""
    if len(name) == 1:
        return ord(name.lower())
    return _NAMED.get(name)


class Keyboard:
    """State of the keys since the last call of `take`; safe to use from any thread."""

    def __init__(self) -> None:
        """Start with all keys released."""
        self._states: dict[int, int] = {}
        self._lock = allocate_lock()

    def press(self, code: int) -> None:
        """Record that a key was pressed."""
        with self._lock:
            if not self._states.get(code, 0) & c.KEY_IS_DOWN:
                self._states[code] = self._states.get(code, 0) | c.KEY_IS_DOWN | c.KEY_WAS_TRIGGERED

    def release(self, code: int) -> None:
        """Record that a key was released."""
        with self._lock:
            if self._states.get(code, 0) & c.KEY_IS_DOWN:
                self._states[code] = self._states[code] & ~c.KEY_IS_DOWN | c.KEY_WAS_RELEASED

    def take(self) -> dict[int, int]:
        """Return key code to KEY_... bits; triggered and released keys are reported once."""
        if not self._states:
            return {}
        with self._lock:
            events = self._states
            self._states = {code: c.KEY_IS_DOWN for code, state in events.items() if state & c.KEY_IS_DOWN}
        return events


class Mouse:
    """Mouse events since the last call of `take`; safe to use from any thread."""

    def __init__(self) -> None:
        """Start without events."""
        self._events: deque[MouseEvent] = deque(maxlen=MAX_MOUSE_EVENTS)

    def move(self, x: float, y: float) -> None:
        """Record a move to a position (pixels)."""
        self._events.append((MOUSE_MOVE, x, y, -1, 0))

    def button(self, x: float, y: float, button: int, *, is_down: bool) -> None:
        """Record a button pressed or released at a position (pixels)."""
        state = c.KEY_IS_DOWN | c.KEY_WAS_TRIGGERED if is_down else c.KEY_WAS_RELEASED
        self._events.append((MOUSE_BUTTON, x, y, button, state))

    def take(self) -> tuple[MouseEvent, ...]:
        """Return (MOUSE_MOVE or MOUSE_BUTTON, x, y, button, KEY_... bits) of each event, once."""
        if not self._events:
            return ()
        events = []
        while self._events:
            events.append(self._events.popleft())
        return tuple(events)
