"""Plots of training: what a policy achieves over the time that its training took."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path


def plot_learning(
    file: Path | str,
    curves: Mapping[str, Sequence[tuple[float, float]]],
    what: str,
    *,
    goal: float | None = None,
) -> None:
    """Draw learning curves as a picture.

    Args:
        file: PNG or SVG.
        curves: label to (seconds of CPU time, value).
        what: label of the values.
        goal: drawn as a line.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.add_subplot()
    for label, points in curves.items():
        axes.plot([x for x, _ in points], [y for _, y in points], label=label)
    if goal is not None:
        axes.axhline(goal, color="0.6", linestyle="--", linewidth=1)
    axes.set_xlabel("CPU time of the training (s)")
    axes.set_ylabel(what)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.savefig(file, dpi=120)
