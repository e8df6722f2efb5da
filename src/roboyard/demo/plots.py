"""The plot joints.png: position and velocity of every joint over time, one row for each joint."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roboyard.demo.motion_sequence import Record
from roboyard.demo.plan import Plan
from roboyard.description.model import RobotDescription
from roboyard.transforms import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_POINTS = 1500
"""Largest number of points in a line, about its width in pixels."""
ROW = 0.62
"""Height of a row (inches)."""
POSITION, TARGET, VELOCITY, LIMITS = "#1f5fa8", "#e07b24", "#2c8f5b", "#dfe5ec"


def plot_joints(path: Path, record: Record, plan: Plan, description: RobotDescription) -> None:
    """Write the plot: position with target and limits on the left, velocity on the right.

    Args:
        path: the PNG file to write.
        record: the recorded motion.
        plan: names the joints that were moved, in their order.
        description: the robot, for the joints' limits and units.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    names = list(plan.sweeps) or list(record.joints)
    every = max(len(record.times) // MOST_POINTS, 1)
    times = np.array(record.times[::every])
    columns = {name: k for k, name in enumerate(record.joints)}
    positions, velocities, targets = (
        np.array(rows[::every]).reshape(len(times), -1)
        for rows in (record.positions, record.velocities, record.targets)
    )
    rows = max(len(names), 1)
    figure = Figure(figsize=(11.0, ROW * rows + 1.3), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False)
    figure.subplots_adjust(
        left=0.2,
        right=0.985,
        top=1 - 0.75 / figure.get_figheight(),
        bottom=0.5 / figure.get_figheight(),
        hspace=0.28,
    )
    for row, name in enumerate(names):
        k = columns[name]
        sliding = description.joint_by_name[name].type == "prismatic"
        left, right = axes[row]
        limits = description.joint_by_name[name].position_limits()
        _draw_position(left, times, positions[:, k], targets[:, k], limits)
        right.plot(times, velocities[:, k], color=VELOCITY, linewidth=1.0)
        right.axhline(0.0, color="#b0b7c0", linewidth=0.6)
        unit = "m" if sliding else "rad"
        left.set_ylabel(
            f"{_short(name)}\n[{unit}]", rotation=0, ha="right", va="center", fontsize=8, labelpad=6
        )
        for axis in (left, right):
            _tidy(axis)
    if not names:
        for axis in axes[0]:
            axis.text(0.5, 0.5, "this robot has no driven joints", ha="center", transform=axis.transAxes)
    axes[0, 0].set_title("position (blue), target (orange), limits (grey); rad or m", fontsize=9, loc="left")
    axes[0, 1].set_title("velocity; rad/s or m/s", fontsize=9, loc="left")
    for axis in axes[-1]:
        axis.set_xlabel("time [s]", fontsize=8)
    if len(times):
        axes[0, 0].set_xlim(0.0, times[-1])
    figure.suptitle(
        f"{description.name}: {len(names)} joints through their ranges",
        fontsize=11, x=0.02, y=1 - 0.12 / figure.get_figheight(), ha="left", va="top",
    )  # fmt: skip
    figure.savefig(path)


def _draw_position(
    axis: Axes, times: Array, position: Array, target: Array, limits: tuple[float, float] | None
) -> None:
    low = min(position.min(), target.min()) if len(times) else 0.0
    high = max(position.max(), target.max()) if len(times) else 1.0
    pad = max(0.08 * (high - low), 1e-3)
    if limits is not None:
        axis.axhspan(limits[0], limits[1], color=LIMITS, linewidth=0)
    axis.plot(times, target, color=TARGET, linewidth=1.6)
    axis.plot(times, position, color=POSITION, linewidth=0.9)
    axis.set_ylim(low - pad, high + pad)


def _tidy(axis: Axes) -> None:
    axis.tick_params(labelsize=7, length=2)
    axis.locator_params(axis="y", nbins=3)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


def _short(name: str, most: int = 28) -> str:
    return name if len(name) <= most else name[: most - 1] + "…"
