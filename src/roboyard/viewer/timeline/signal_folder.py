"""The folder *Signals* of every page: one signal plotted over the last minute."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from roboyard.transforms import Array
from roboyard.viewer.timeline.moments import Moments
from roboyard.viewer.timeline.playback import Playback
from roboyard.viewer.timeline.signals import KINDS, Line, lines, names_of

NONE = "(none)"
LAST = 1001.0
"""Order of the folder in the panel: below the time line."""
PERIOD = 0.5
"""Least time between two updates of the plot (s)."""
COLORS = ("#1f77b4", "#ff7f0e")


class SignalFolder:
    """Choices, a plot and the value at the shown time."""

    def __init__(self, gui: Any, moments: Moments, playback: Playback) -> None:
        """Add the folder to a `viser` panel."""
        self._gui, self._moments, self._playback = gui, moments, playback
        self._next = 0.0
        self._newest: Any = None
        self._is_chosen = False
        self._labels: tuple[str, ...] = ()
        self.plot: Any = None
        """Handle of the plot; None: no signal is plotted."""
        self.folder = gui.add_folder("Signals", order=LAST, expand_by_default=False)
        with self.folder:
            self.kind = gui.add_dropdown("signal", (NONE, *KINDS), initial_value=NONE)
            self.name = gui.add_dropdown("of", (NONE,), initial_value=NONE, visible=False)
            self.text = gui.add_markdown("")
        self.kind.on_update(self._on_choice)
        self.name.on_update(self._on_choice)

    def tick(self) -> None:
        """Update the plot, at most each `PERIOD`; call it once per frame."""
        now = perf_counter()
        if self._is_chosen:
            self._is_chosen, self._newest = False, None
            self._remove()
        elif now < self._next:
            return
        self._next = now + PERIOD
        self._show()

    def _show(self) -> None:
        kind = self.kind.value
        self.name.visible = kind != NONE
        if kind == NONE:
            self._write("")
            return
        held = self._playback.held
        newest = (held[-1], self._playback.moment) if held else None
        if newest == self._newest:
            return
        self._newest = newest
        names = names_of(kind, held)
        options = names or (NONE,)
        if tuple(self.name.options) != options:
            self.name.options = options
        found = lines(kind, self.name.value, held)
        if not found:
            self._remove()
            self._write("No such signal is recorded." if not names else "Not recorded yet.")
            return
        clocks = np.array([moment.clock for moment in held])
        self._draw(clocks - clocks[-1], found)
        self._write(_value_text(found, clocks - clocks[-1], -self._playback.before_now))

    def _draw(self, times: Array, found: tuple[Line, ...]) -> None:
        data = (times, *(line.values for line in found))
        labels = tuple(line.label for line in found)
        if self.plot is not None and labels == self._labels:
            self.plot.data = data
            return
        self._remove()
        self._labels = labels
        with self.folder:
            self.plot = self._gui.add_uplot(
                data,
                (
                    {"label": "s before now"},
                    *(
                        {"label": label, "stroke": color, "width": 2}
                        for label, color in zip(labels, COLORS, strict=False)
                    ),
                ),
                title=self.name.value,
                scales={"x": {"time": False}},
                legend={"show": True},
                aspect=1.5,
            )

    def _remove(self) -> None:
        if self.plot is not None:
            self.plot.remove()
            self.plot = None
        self._labels = ()

    def _write(self, text: str) -> None:
        if self.text.content != text:
            self.text.content = text

    async def _on_choice(self, _: Any) -> None:
        # the viewer's thread draws
        self._is_chosen = True


def _value_text(found: tuple[Line, ...], times: Array, at: float) -> str:
    """Return the values at a time (s before the newest state) as text."""
    k = int(np.argmin(np.abs(times - at)))
    values = ", ".join(f"{line.label}: {line.values[k]:.4g}" for line in found)
    return f"At {at:.2f} s: {values}" if at < 0 else f"Now: {values}"
