"""Distances of shapes with round edges, as Bullet has them.

Its boxes and cylinders are smaller by a margin, which is the radius of balls around all their points.
"""

from __future__ import annotations

from typing import Any

from roboyard._mujoco import mujoco
from roboyard.pybullet.bullet_rules.shape_bounds import MARGIN
from roboyard.transforms import Array

_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
_CYLINDER, _BOX = int(mujoco.mjtGeom.mjGEOM_CYLINDER), int(mujoco.mjtGeom.mjGEOM_BOX)


def edge_radius(model: Any, geom: int, margin: float) -> float:
    """Return the radius of the edges of one of MuJoCo's geoms (m), 0 where it has none.

    Args:
        model: MjModel.
        geom: the shape.
        margin: by which Bullet's shape is larger (m); with one, it is a convex hull.
    """
    kind = model.geom_type.item(geom)
    if kind not in (_CYLINDER, _BOX) or margin:
        return 0.0
    sizes = model.geom_size[geom, : 3 if kind == _BOX else 2]
    return MARGIN if sizes.min() > MARGIN else 0.0


def gap_of(
    model: Any, data: Any, one: int, two: int, reach: float, edges: tuple[float, float], ends: Array
) -> float:
    """Return the distance of two geoms (m) that are smaller by the radii of their edges.

    Planes, and a geom and itself, are taken as they are, with edges of 0.

    Args:
        model: MjModel, of which nothing stays changed.
        data: MjData, in which both are where they are.
        one: first geom.
        two: second geom.
        reach: distance (m) up to which points are looked for.
        edges: radii of both (m).
        ends: (6,) receives the point on each (m).
    """
    sizes = model.geom_size
    before = sizes[[one, two]]
    sizes[one] -= edges[0]
    sizes[two] -= edges[1]
    try:
        return float(mujoco.mj_geomDistance(model, data, one, two, reach, ends))
    finally:
        sizes[[one, two]] = before


def edges_of_pair(model: Any, one: int, two: int, margins: tuple[float, float]) -> tuple[float, float]:
    """Return the radii of the edges of two geoms, with these margins, against each other (m)."""
    kinds = model.geom_type
    if one == two or _PLANE in (kinds.item(one), kinds.item(two)):
        return 0.0, 0.0
    return edge_radius(model, one, margins[0]), edge_radius(model, two, margins[1])
