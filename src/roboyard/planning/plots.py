"""A plot of a trajectory: position, velocity, acceleration and jerk of each joint against their limits."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from roboyard.planning.trajectory import Trajectory
from roboyard.transforms import Array

ROWS = ("position", "velocity", "acceleration", "jerk")
POINTS = 1500
"""Points of a line, about its width in pixels."""


def plot_trajectory(path: Path, trajectory: Trajectory, limits: Array, bounds: tuple[Array, Array]) -> None:
    """Write a PNG with one row for each derivative; positions are shares of each joint's range.

    Args:
        path: the file to write.
        trajectory: the motion.
        limits: (3, n) limits of velocity, acceleration and jerk, in the trajectory's order of joints.
        bounds: (n,) lower and upper position limits (rad or m).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    times = np.union1d(np.linspace(0.0, trajectory.duration, POINTS), trajectory.t)
    values = trajectory.at(times)
    lower, upper = bounds
    shares = [2.0 * (values[0] - lower) / np.maximum(upper - lower, 1e-9) - 1.0]
    shares += [row / limit for row, limit in zip(values[1:], limits, strict=True)]
    figure = Figure(figsize=(10.0, 9.0), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(ROWS), 1, sharex=True)
    figure.subplots_adjust(left=0.09, right=0.8, top=0.94, bottom=0.06, hspace=0.14)
    for k, (axis, name) in enumerate(zip(axes, ROWS, strict=True)):
        for j, joint in enumerate(trajectory.joint_names):
            style = "steps-post" if name == "jerk" else "default"
            axis.plot(times, shares[k][:, j], linewidth=1.3, label=joint, drawstyle=style)
        for edge in (-1.0, 1.0):
            axis.axhline(edge, color="#b03030", linewidth=0.9, linestyle="--")
        axis.set_ylim(-1.12, 1.12)
        axis.set_ylabel(f"{name} / limit" if k else "position in range", fontsize=9)
        axis.grid(color="#e3e7ec", linewidth=0.6)
        axis.tick_params(labelsize=8)
    axes[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1.02), fontsize=8, frameon=False)
    axes[-1].set_xlabel("time (s)", fontsize=9)
    figure.suptitle(f"{trajectory.duration:.2f} s; dashed: limits of each joint", fontsize=10)
    figure.savefig(path)
