"""The line along which a link moves in a planned motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard.kinematics import forward_kinematics
from roboyard.viewer.scene.drawings import SceneLines

if TYPE_CHECKING:
    from roboyard.planning import Planner, Trajectory

RGB = np.array([0.1, 0.45, 0.9])
POINTS = 60


def tool_way(planner: Planner, trajectory: Trajectory, link: str) -> SceneLines:
    """Return the line, in the world frame, along which a link moves in a motion of a planner."""
    root = planner.obstacles.root
    times = np.linspace(0.0, trajectory.duration, POINTS)
    rows = np.array([planner.vector(q) for q in trajectory.at(times)[0]])
    points = (root @ forward_kinematics(planner.robot.chain, rows, link))[:, :3, 3]
    return SceneLines(start=points[:-1], end=points[1:], rgb=np.tile(RGB, (len(points) - 1, 1)), width=3.0)
