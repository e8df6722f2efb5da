"""A camera position from which all bodies of a world are in the picture."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.rendering import fitted_viewpoint
from roboyard.sim.body import Body
from roboyard.transforms import Array

FOVY = math.radians(45.0)
"""Vertical opening angle (rad) of the camera that `viewpoint` assumes."""
FILL = 0.82
"""Share of the picture's width and height that the bodies may cover."""
VIEW_FROM = (1.0, -0.75, 0.5)
"""Direction from the target to the camera; robots face +x."""
LEAST_EXTENT, MOST_EXTENT = 0.2, 12.0
"""Smallest and largest diagonal (m) of the box that `viewpoint` fits into the picture."""
_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
_DIRECTIONS = np.array([d for d in itertools.product((-1, 0, 1), repeat=3) if any(d)], dtype=float)


def viewpoint(bodies: Iterable[Body], aspect: float = 1.5) -> tuple[Array, Array]:
    """Return the camera's position and target, each (3,) in the world frame (m).

    A camera there with a vertical opening angle of `FOVY` and this ratio of width to height has all bodies
    in its picture, with a margin; infinite planes are ignored, and scenes beyond `MOST_EXTENT` are shown in
    part.
    """
    return fitted_viewpoint(fitted_points(bodies), VIEW_FROM, aspect=aspect, fovy=FOVY, fill=FILL)


def fitted_points(bodies: Iterable[Body]) -> Array:
    """Return the (n, 3) points in the world frame (m) that a picture of all bodies has in its frame.

    These are the outermost points of all shapes; of scenes beyond `MOST_EXTENT` the corners of a box around
    their centre.
    """
    found = list(bodies)
    lower, upper = extent(found)
    centre = 0.5 * (lower + upper)
    diagonal = float(np.linalg.norm(upper - lower))
    points = extreme_points(found)
    if not LEAST_EXTENT <= diagonal <= MOST_EXTENT or not len(points):
        half = 0.5 * np.clip(diagonal, LEAST_EXTENT, MOST_EXTENT) / math.sqrt(3.0)
        return centre + half * (2.0 * _CORNERS - 1.0)
    return points


def extreme_points(bodies: Iterable[Body]) -> Array:
    """Return (n, 3) outermost points of all shapes of finite size, in the world frame (m).

    Each mesh gives its vertices that lie farthest in 26 directions, every other shape the corners of its box.
    """
    found: list[Array] = []
    for body in bodies:
        body.world.show_triangles()
        data, model = body.world.kinematics(), body.world.live_model
        for geom in np.flatnonzero(np.isin(model.geom_bodyid, body.mujoco_ids)):
            if model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_PLANE):
                continue
            if model.geom_type[geom] == int(mujoco.mjtGeom.mjGEOM_MESH):
                mesh = model.geom_dataid[geom]
                first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
                points = outermost(model.mesh_vert[first : first + count])
            else:
                box = model.geom_aabb[geom]
                points = box[:3] + box[3:] * (2.0 * _CORNERS - 1.0)
            found.append(points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(found) if found else np.zeros((0, 3))


def outermost(points: Array) -> Array:
    """Return those of (n, 3) points, at least one, that lie farthest in 26 directions."""
    return points[np.unique(np.argmax(points @ _DIRECTIONS.T, axis=0))]


def extent(bodies: Iterable[Body]) -> Array:
    """Return the (2, 3) bounding box of all bodies of finite size, in the world frame (m)."""
    boxes = [body.bounds for body in bodies]
    boxes = [box for box in boxes if np.isfinite(box).all() and np.ptp(box, axis=0).max() > 0]
    if not boxes:
        return np.array([[-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]])
    return np.stack([np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)])
