"""On-screen joysticks in the corner of each page, for mouse and touch.

>>> joysticks = Joysticks(viewer.server)
>>> joysticks.show(("move", "turn"))
>>> joysticks.values                       # {"move": (0.0, 0.8), "turn": (0.0, 0.0)}
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from threading import Lock
from typing import Any

from roboyard.viewer.page.page_script import PageScript

CENTRE = (0.0, 0.0)
"""Deflection of a released joystick."""

_SCRIPT = """
  const build = names => {
    const size = 104, knob = 44, timers = [];
    const box = document.createElement("div");
    box.className = "roboyard-sticks";
    box.style.cssText = "position:fixed;left:20px;bottom:20px;z-index:50;display:flex;gap:20px;" +
      "touch-action:none;user-select:none;font:12px sans-serif;color:#345;text-align:center";
    document.body.appendChild(box);
    for (const name of names) {
      const cell = document.createElement("div"), pad = document.createElement("div");
      const dot = document.createElement("div"), label = document.createElement("div");
      pad.dataset.stick = name;
      pad.style.cssText = `position:relative;width:${size}px;height:${size}px;border-radius:50%;` +
        "cursor:grab;background:rgba(255,255,255,.75);border:2px solid rgba(38,96,164,.55);" +
        "box-shadow:0 1px 6px rgba(0,0,0,.2);touch-action:none";
      dot.style.cssText = `position:absolute;width:${knob}px;height:${knob}px;border-radius:50%;` +
        "background:rgba(38,96,164,.85);pointer-events:none";
      label.textContent = name;
      label.style.cssText = "margin-top:4px;text-shadow:0 0 4px #fff";
      pad.appendChild(dot); cell.appendChild(pad); cell.appendChild(label); box.appendChild(cell);
      let value = [0, 0], sent = "[0,0]", pointer = null;
      const put = (x, y) => {
        const far = Math.max(1, Math.hypot(x, y));
        value = [Math.round(1000 * x / far) / 1000, Math.round(1000 * y / far) / 1000];
        const middle = (size - knob) / 2 - 2, reach = (size - knob) / 2;
        dot.style.left = `${middle + value[0] * reach}px`;
        dot.style.top = `${middle - value[1] * reach}px`;
      };
      const send = () => {
        const now = JSON.stringify(value);
        if (now !== sent) { sent = now; say([name, value[0], value[1]]); }
      };
      const pull = e => {
        if (e.pointerId !== pointer) return;
        const b = pad.getBoundingClientRect(), reach = (size - knob) / 2;
        put((e.clientX - b.x - b.width / 2) / reach, (b.y + b.height / 2 - e.clientY) / reach);
      };
      const release = e => { if (e.pointerId === pointer) { pointer = null; put(0, 0); send(); } };
      pad.addEventListener("pointerdown", e => {
        pointer = e.pointerId; try { pad.setPointerCapture(pointer); } catch {}
        pull(e); send(); e.preventDefault(); e.stopPropagation();
      });
      pad.addEventListener("pointermove", pull);
      pad.addEventListener("pointerup", release);
      pad.addEventListener("pointercancel", release);
      put(0, 0);
      timers.push(setInterval(send, 33));
    }
    return () => { timers.forEach(clearInterval); box.remove(); };
  };
  let clear = null;
  listen(names => { clear?.(); clear = build(names); });
  return () => clear?.();
"""


class Joysticks:
    """Joysticks of all pages of a server; the page that moved one last controls it."""

    def __init__(self, server: Any) -> None:
        """Start without joysticks; `server` is a `viser.ViserServer`."""
        self._names: tuple[str, ...] = ()
        self._pulled: dict[str, tuple[int, float, float]] = {}
        self._lock = Lock()
        self._script = PageScript(server, "sticks", _SCRIPT, self._on_message)
        server.on_client_disconnect(self._on_disconnect)

    def show(self, names: Sequence[str]) -> None:
        """Show joysticks of these names in every page, replacing the previous ones."""
        if tuple(names) == self._names:
            return
        self._names = tuple(names)
        with self._lock:
            self._pulled.clear()
        self._script.send(list(names))

    @property
    def values(self) -> dict[str, tuple[float, float]]:
        """Joystick to its deflection to the right and up, each from -1 to 1; readable from any thread."""
        with self._lock:
            pulled = {name: (x, y) for name, (_, x, y) in self._pulled.items()}
        return {name: pulled.get(name, CENTRE) for name in self._names}

    def _on_message(self, client: int, value: Any) -> None:
        if not (isinstance(value, list) and len(value) == 3 and value[0] in self._names):
            return
        name, x, y = value
        if not all(isinstance(v, int | float) and math.isfinite(v) and abs(v) <= 1 for v in (x, y)):
            return
        with self._lock:
            self._pulled[name] = (client, float(x), float(y))

    async def _on_disconnect(self, client: Any) -> None:
        # a coroutine: at exit the thread pool for plain functions ends before the pages close
        self._release(client.client_id)

    def _release(self, client: int) -> None:
        """Centre the joysticks held by a closed page."""
        with self._lock:
            for name in [name for name, pulled in self._pulled.items() if pulled[0] == client]:
                del self._pulled[name]
