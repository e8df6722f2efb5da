"""The margin that Bullet's hulls have around them, for MuJoCo's shapes, which have none."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard.pybullet.bullet_rules.shape_bounds import MARGIN


def margins_of_hulls(
    model: Any, hull_cylinders: Sequence[int] = (), triangles: Sequence[int] = ()
) -> np.ndarray:
    """(ngeom,) m by which Bullet's shapes are larger than those of a MuJoCo model: 1 mm for hulls, else 0.

    Args:
        model: MjModel; its meshes are hulls.
        hull_cylinders: rows of the MuJoCo bodies whose cylinders are hulls in Bullet too.
        triangles: rows of the MuJoCo bodies whose meshes are triangles in Bullet, which have no margin.
    """
    import mujoco

    kinds = model.geom_type
    margins = np.where(kinds == int(mujoco.mjtGeom.mjGEOM_MESH), MARGIN, 0.0)
    if len(triangles):
        margins[np.isin(model.geom_bodyid, triangles)] = 0.0
    if len(hull_cylinders):
        is_cylinder = kinds == int(mujoco.mjtGeom.mjGEOM_CYLINDER)
        margins[is_cylinder & np.isin(model.geom_bodyid, hull_cylinders)] = MARGIN
    return margins
