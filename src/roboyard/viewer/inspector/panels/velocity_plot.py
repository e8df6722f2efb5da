"""Plot of the joint speeds over the last seconds."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._arrays import NDArray

WINDOW = 10.0
"""Time span of the plot (s)."""
RATE = 10.0
"""Rate of samples and updates (Hz)."""
AT_REST = 0.01
"""Speed below which a joint is at rest (rad/s or m/s)."""
MAX_SERIES = 12
"""Joints with a line each; beyond that the fastest alone is plotted."""
COLORS = (
    *("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b"),
    *("#e377c2", "#7f7f7f", "#bcbd22", "#17becf", "#003f5c", "#ffa600"),
)


class VelocityPlot:
    """One line per joint, or the fastest joint alone for robots with many joints."""

    def __init__(self, gui: Any, joint_names: tuple[str, ...]) -> None:
        self._each = 0 < len(joint_names) <= MAX_SERIES
        names = joint_names if self._each else ("fastest joint",)
        self._rows: list[tuple[float, NDArray[np.float64]]] = []
        self._still_since: float | None = None
        self.text = gui.add_markdown("")
        self.plot = gui.add_uplot(
            (np.zeros(1), *(np.zeros(1) for _ in names)),
            (
                {"label": "s"},
                *({"label": n, "stroke": COLORS[k % len(COLORS)], "width": 2} for k, n in enumerate(names)),
            ),
            title="joint velocities (rad/s, m/s)",
            scales={"x": {"time": False}},
            legend={"show": self._each},
            aspect=1.4,
        )

    def sample(self, time: float, velocities: NDArray[np.float64]) -> None:
        """Add joint velocities (n,) (rad/s or m/s) at a time (s); samples above `RATE` are skipped."""
        if self._rows and time < self._rows[-1][0]:
            self.clear()
        if self._rows and time - self._rows[-1][0] < 1.0 / RATE:
            return
        speed = float(np.abs(velocities).max(initial=0.0))
        self._rows.append((time, velocities.copy() if self._each else np.array([speed])))
        while time - self._rows[0][0] > WINDOW:
            self._rows.pop(0)
        if speed > AT_REST:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = time
        self.plot.data = (
            np.array([row[0] for row in self._rows]),
            *np.array([row[1] for row in self._rows]).T.copy(),
        )
        self.text.content = (
            f"moving, at most {speed:.3g}"
            if self._still_since is None
            else f"**at rest** for {time - self._still_since:.1f} s (below {AT_REST})"
        )

    def clear(self) -> None:
        """Drop all samples."""
        self._rows.clear()
        self._still_since = None
