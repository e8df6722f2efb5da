"""Bounding box of a whole robot."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, RobotDescription, Visual
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.shapes.mesh import bounding_box
from roboyard.transforms import Array


def robot_bounds(
    description: RobotDescription,
    *,
    visual: bool = True,
    collision: bool = True,
    positions: Mapping[str, float] | None = None,
) -> Array | None:
    """Return the lower and upper corner of the box around a robot's shapes.

    Args:
        description: the robot.
        visual: whether visual shapes count.
        collision: whether collision shapes count.
        positions: joint name to position (rad or m); joints not named are at zero.

    Returns:
        (2, 3) corners in the root link's frame (m); None where no finite shape counts.

    Raises:
        MeshError: a mesh file cannot be read.
    """
    frames = forward_kinematics(description, positions)
    corners = []
    for link in description.links:
        shapes: list[Visual | Collision] = [*link.visuals] if visual else []
        shapes += link.collisions if collision else ()
        frame = frames[link.name]
        for shape in shapes:
            mesh = geometry_mesh(shape.geometry)
            if mesh is None or not len(mesh.faces):
                continue
            to_root = frame @ shape.origin.matrix()
            points = mesh.vertices @ to_root[:3, :3].T + to_root[:3, 3]
            corners += [*bounding_box(points)]
    if not corners:
        return None
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)])
