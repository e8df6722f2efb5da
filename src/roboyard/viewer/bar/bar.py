"""`Bar`: the same controls on every page."""

from __future__ import annotations

import base64
import json
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from roboyard.viewer.page.page_script import PageScript

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Speeds that the page offers (simulated seconds per second)."""
VIEWS = {
    "front": (1.0, 0.0, 0.15), "back": (-1.0, 0.0, 0.15), "left": (0.0, 1.0, 0.15),
    "right": (0.0, -1.0, 0.15), "top": (-0.02, 0.0, 1.0), "corner": (1.0, -0.75, 0.5),
}  # fmt: skip
"""Name of a view to its direction from the target to the camera, in the world frame; robots face +x."""
PERIOD = 0.25
"""Least time between two messages with the simulated time (s)."""
WINDOW = 1.0
"""Time over which the real-time factor is measured (s)."""

_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="7" '
    'fill="#2660a4"/><path d="M8 26V6h9a6 6 0 0 1 2 11.600L25 26h-5l-5-8h-2.500v8zM12.500 10v4.500H17a2.200 '
    '2.200 0 0 0 0-4.500z" fill="#fff"/></svg>'
)


@dataclass(frozen=True, kw_only=True, slots=True)
class Controls:
    """Actions of the buttons; called in the event loop of the server, so they must return quickly."""

    play: Callable[[bool], None]
    """Run or pause."""
    step: Callable[[], None]
    """Pause and simulate one step."""
    reset: Callable[[], None]
    """Restore the initial state."""
    set_speed: Callable[[float | None], None]
    """Set simulated seconds per second; None: as fast as possible."""
    home: Callable[[Any], None]
    """Move the camera of a `viser.ClientHandle` back to its first view."""
    refresh: Callable[[], None]
    """Show the world again, with or without contact forces."""


class Bar:
    """The bar of all pages of a server."""

    def __init__(self, server: Any, title: str, controls: Controls, *, speed: float | None) -> None:
        """Show the bar.

        Args:
            server: a `viser.ViserServer`.
            title: what is shown; "Roboyard" is added to it in the name of the tab.
            controls: what the buttons do.
            speed: the speed at the start; None: as fast as possible.
        """
        self._server = server
        self.controls = controls
        self.on_quality: Callable[[int, str], None] = lambda *_: None
        """Called with the number of a page's client and its quality: low, normal or high."""
        self._state: dict[str, Any] = {
            "playing": True,
            "speed": speed,
            "time": "0.00",
            "factor": "1.00",
            "forces": False,
            "visible": True,
            "title": title if "Roboyard" in title else f"{title} - Roboyard",
        }
        self._lock = threading.Lock()
        """Held while the state changes: the simulation shows its time while the event loop shows a pause."""
        self._passed: list[tuple[float, float]] = []
        self._next = 0.0
        speeds = [("max", "fastest"), *((f"{s:g}", f"{s:g}\u00d7") for s in SPEEDS)]
        views = [("", "view"), ("home", "first view"), *((name, name) for name in VIEWS)]
        icon = "data:image/svg+xml;base64," + base64.b64encode(_ICON.encode()).decode()
        source = (Path(__file__).parent / "bar.js").read_text(encoding="utf-8")
        for word, value in (("SPEEDS", speeds), ("VIEWS", views), ("ICON;", icon)):
            source = source.replace(word, json.dumps(value) + (";" if word.endswith(";") else ""))
        self._script = PageScript(server, "bar", source, self._on_message)
        self._script.send(self._state)

    @property
    def state(self) -> dict[str, Any]:
        """Names and values that the bar shows: playing, speed, time, factor, forces, visible, title."""
        return dict(self._state)

    @property
    def shows_forces(self) -> bool:
        """Whether contact forces are drawn."""
        return bool(self._state["forces"])

    def show(self, **changes: Any) -> None:
        """Change what the bar shows: playing, speed, forces, visible; from any thread."""
        with self._lock:
            state = {**self._state, **changes}
            if state != self._state:
                self._state = state
                self._script.send(state)

    def show_time(self, time: float) -> None:
        """Show the simulated time (s), and measure how fast it passes; call it once per frame."""
        now = perf_counter()
        passed = self._passed
        if passed and (time < passed[-1][1] or not self._state["playing"]):
            passed.clear()
        passed.append((now, time))
        while len(passed) > 2 and now - passed[1][0] > WINDOW:
            passed.pop(0)
        text = f"{time:.2f}"
        if text == self._state["time"] or now < self._next:
            return
        self._next = now + PERIOD
        wall, simulated = now - passed[0][0], time - passed[0][1]
        factor = simulated / wall if wall > 0.2 else None
        self.show(time=text, **({} if factor is None else {"factor": f"{factor:.2f}"}))

    def _on_message(self, client: int, value: Any) -> None:
        match value:
            case ["play", bool(playing)]:
                self.controls.play(playing)
            case ["step"]:
                self.controls.step()
            case ["reset"]:
                self.controls.reset()
            case ["speed", None]:
                self.controls.set_speed(None)
            case ["speed", float(speed) | int(speed)] if float(speed) in SPEEDS:
                self.controls.set_speed(float(speed))
            case ["forces", bool(forces)]:
                self.show(forces=forces)
                self.controls.refresh()
            case ["quality", "low" | "normal" | "high" as quality]:
                self.on_quality(client, quality)
            case ["view", str(view)]:
                self._look(client, view)

    def _look(self, number: int, view: str) -> None:
        """Move the camera of one page to a named view."""
        client = self._server.get_clients().get(number)
        if client is None:
            return
        if view == "home":
            self.controls.home(client)
        elif view in VIEWS:
            camera = client.camera
            target = np.array(camera.look_at, dtype=float)
            distance = float(np.linalg.norm(np.array(camera.position) - target))
            direction = np.array(VIEWS[view]) / math.hypot(*VIEWS[view])
            with client.atomic():
                camera.up_direction = (0.0, 0.0, 1.0)
                camera.position = target + distance * direction
                camera.look_at = target
