"""Keys pressed in any page of a server, as events and as the set of held keys.

>>> keys = Keys(viewer.server)                      # one for each server is enough
>>> keys.subscribe(lambda event: ...)               # KeyEvent(key="a", is_down=True, client=0), in order
>>> keys.held                                       # {"a", "ArrowUp"}

Names are the browser's `KeyboardEvent.key`, letters in lower case: "a", "1", ";", " ", "ArrowUp", "Shift",
"Control", "Alt", "Enter", "Escape", "F1". A held key gives one event, without repeats, and is released under
the name that it was pressed with. Keys typed into a field of the panel are ignored; keys of a page that
loses the focus or closes are released.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from threading import Lock
from typing import Any

from roboyard.viewer.page.page_script import PageScript

MOST_HELD = 32
"""Most keys held in one page; no keyboard reports more."""
LONGEST_NAME = 24
"""Longest name of a key (characters)."""

_SCRIPT = """
  const grabbed = %s, held = new Map();
  const typing = e => {
    const t = e.target;
    return t instanceof HTMLElement && (t.isContentEditable || ["TEXTAREA", "SELECT"].includes(t.tagName)
      || (t.tagName === "INPUT" && !["button", "checkbox", "radio", "range"].includes(t.type)));
  };
  const grab = (e, key) => {
    if (grabbed === null || grabbed.includes(key)) { e.preventDefault(); e.stopImmediatePropagation(); }
  };
  const down = e => {
    if (typing(e) || e.ctrlKey && e.key !== "Control" || e.metaKey) return;
    const key = e.key.length === 1 ? e.key.toLowerCase() : e.key, code = e.code || e.key;
    grab(e, key);
    if (held.has(code)) return;
    held.set(code, key);
    say([[key, true]]);
  };
  const up = e => {
    const code = e.code || e.key, key = held.get(code);
    if (key === undefined) return;
    held.delete(code);
    grab(e, key);
    say([[key, false]]);
  };
  const lose = () => {
    if (held.size) say([...held.values()].map(key => [key, false]));
    held.clear();
  };
  const hide = () => { if (document.hidden) lose(); };
  window.addEventListener("keydown", down, true);
  window.addEventListener("keyup", up, true);
  window.addEventListener("blur", lose);
  document.addEventListener("visibilitychange", hide);
  return () => {
    window.removeEventListener("keydown", down, true);
    window.removeEventListener("keyup", up, true);
    window.removeEventListener("blur", lose);
    document.removeEventListener("visibilitychange", hide);
  };
"""


@dataclass(frozen=True, kw_only=True, slots=True)
class KeyEvent:
    """A key went down or up."""

    key: str
    """Name of the key."""
    is_down: bool
    """Whether it was pressed; False: released."""
    client: int
    """Number of the page's client."""


class Keys:
    """Keys of all pages of a server."""

    def __init__(self, server: Any, grab: Iterable[str] | None = ()) -> None:
        """Receive the keys of every page of `server`, including pages opened later.

        Args:
            server: a `viser.ViserServer`.
            grab: keys that the page itself must ignore (its own w a s d q e and the arrows move the
                camera); None: all of them.
        """
        self._listeners: list[Callable[[KeyEvent], None]] = []
        self._held: dict[int, list[str]] = {}
        self._lock = Lock()
        grabbed = None if grab is None else sorted(set(grab))
        self._script = PageScript(server, "keys", _SCRIPT % json.dumps(grabbed), self._on_message)
        server.on_client_disconnect(self._on_disconnect)

    def subscribe(self, listener: Callable[[KeyEvent], None]) -> None:
        """Call `listener` for each event in a thread of the server; it must return quickly."""
        self._listeners.append(listener)

    @property
    def held(self) -> frozenset[str]:
        """Keys held in any page; readable from any thread."""
        with self._lock:
            return frozenset(key for keys in self._held.values() for key in keys)

    def _on_message(self, client: int, value: Any) -> None:
        for pair in value if isinstance(value, list) else ():
            if not (isinstance(pair, list) and len(pair) == 2):
                return
            key, is_down = pair
            if not (isinstance(key, str) and 0 < len(key) <= LONGEST_NAME and isinstance(is_down, bool)):
                return
            self._handle(KeyEvent(key=key, is_down=is_down, client=client))

    def _handle(self, event: KeyEvent) -> None:
        with self._lock:
            held = self._held.setdefault(event.client, [])
            if event.is_down == (event.key in held) or (event.is_down and len(held) >= MOST_HELD):
                return
            (held.append if event.is_down else held.remove)(event.key)
        for listener in tuple(self._listeners):
            listener(event)

    async def _on_disconnect(self, client: Any) -> None:
        # a coroutine: at exit the thread pool for plain functions ends before the pages close
        self._release(client.client_id)

    def _release(self, client: int) -> None:
        """Release all keys of a closed page."""
        with self._lock:
            held = tuple(self._held.get(client, ()))
        for key in held:
            self._handle(KeyEvent(key=key, is_down=False, client=client))
        with self._lock:
            self._held.pop(client, None)
