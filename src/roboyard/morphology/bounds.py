"""Bounding box of a whole robot."""

from __future__ import annotations

from collections.abc import Mapping
from weakref import WeakKeyDictionary

import numpy as np

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, Geometry, Mesh, RobotDescription, Visual
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.shapes.load import load_mesh
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.transforms import Array

_known: WeakKeyDictionary[TriangleMesh, dict[tuple[object, bytes], Array | None]] = WeakKeyDictionary()
"""Mesh of a file to the boxes round it, by scale and rotation."""


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
            to_root = frame @ shape.origin.matrix()
            box = _turned_bounds(shape.geometry, to_root[:3, :3])
            if box is not None:
                corners += [*(box + to_root[:3, 3])]
    if not corners:
        return None
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)])


def _turned_bounds(geometry: Geometry, rotation: Array) -> Array | None:
    """Return the (2, 3) box round a geometry that is turned by a (3, 3) rotation (m); None where it has none.

    The boxes of mesh files are kept: robots have the same mesh on several legs, and are measured repeatedly.
    """
    if isinstance(geometry, Mesh) and geometry.path is not None and geometry.data is None:
        boxes = _known.setdefault(load_mesh(geometry.path), {})
        key = (tuple(geometry.scale), rotation.tobytes())
        if key not in boxes:
            boxes[key] = _measured(geometry, rotation)
        return boxes[key]
    return _measured(geometry, rotation)


def _measured(geometry: Geometry, rotation: Array) -> Array | None:
    mesh = geometry_mesh(geometry)
    if mesh is None or not len(mesh.faces):
        return None
    return bounding_box(mesh.vertices @ rotation.T)
