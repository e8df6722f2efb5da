"""The margins of Bullet's convex hulls, for MuJoCo's shapes, which have none."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from roboyard.description.model import Cylinder
from roboyard.pybullet.bullet_rules.models import BodyModel
from roboyard.pybullet.bullet_rules.shape_bounds import MARGIN


def geom_margins(model: Any, hull_cylinders: Sequence[int] = (), triangles: Sequence[int] = ()) -> np.ndarray:
    """Return the (ngeom,) margins of Bullet's shapes around MuJoCo's (m): 0.001 for hulls, else 0.

    Args:
        model: MjModel; its meshes are convex hulls.
        hull_cylinders: rows of the MuJoCo bodies whose cylinders are hulls in Bullet.
        triangles: rows of the MuJoCo bodies whose meshes are triangles in Bullet, without margin.
    """
    from roboyard._mujoco import mujoco

    kinds = model.geom_type
    margins = np.where(kinds == int(mujoco.mjtGeom.mjGEOM_MESH), MARGIN, 0.0)
    if len(triangles):
        margins[_of_bodies(model, triangles)] = 0.0
    if len(hull_cylinders):
        is_cylinder = kinds == int(mujoco.mjtGeom.mjGEOM_CYLINDER)
        if is_cylinder.any():
            margins[is_cylinder & _of_bodies(model, hull_cylinders)] = MARGIN
    return margins


def margins_of_rows(model: Any, rows: Sequence[int], *, has_cylinders: bool) -> list[float]:
    """Return the margins (m) of some of MuJoCo's geoms, of bodies without triangles.

    Args:
        model: MjModel; its meshes are convex hulls.
        rows: the geoms.
        has_cylinders: whether their cylinders are hulls in Bullet.
    """
    hulls, kind_of = _hull_kinds(has_cylinders), model.geom_type.item
    return [MARGIN if kind_of(row) in hulls else 0.0 for row in rows]


@cache
def _hull_kinds(has_cylinders: bool) -> tuple[int, ...]:
    """Return MuJoCo's types of hulls, those of cylinders among them where asked for."""
    from roboyard._mujoco import mujoco

    mesh, cylinder = int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_CYLINDER)
    return (mesh, cylinder) if has_cylinders else (mesh,)


def special_margins(model: BodyModel) -> tuple[list[int], bool]:
    """Return the links with meshes that are triangles, and whether the body has cylinders that are hulls."""
    links = model.links
    concave = [k for k, link in enumerate(links) if any(shape.concave for shape in link.collisions)]
    shapes = (shape.geometry for link in model.description.links for shape in link.collisions)
    return concave, not model.implicit_cylinder and any(isinstance(shape, Cylinder) for shape in shapes)


def _of_bodies(model: Any, rows: Sequence[int]) -> np.ndarray:
    """Return (ngeom,) whether each geom is of one of these bodies."""
    is_one = np.zeros(model.nbody, bool)
    is_one[rows] = True
    return is_one[model.geom_bodyid]
