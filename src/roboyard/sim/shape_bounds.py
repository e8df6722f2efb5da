"""Boxes around the shapes of bodies in a compiled world."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.transforms import Array


def shape_bounds(model: Any, data: Any, mujoco_ids: np.ndarray) -> Array:
    """Return the (2, 3) bounding box of all shapes of some bodies, but planes, in the world frame (m).

    Args:
        model: MjModel.
        data: its MjData, with positions that agree with qpos.
        mujoco_ids: (k,) rows of bodies; their origins are within the box.
    """
    of_body = np.isin(model.geom_bodyid, mujoco_ids)
    plane = model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE)
    mesh = model.geom_type == int(mujoco.mjtGeom.mjGEOM_MESH)
    rows = np.flatnonzero(of_body & ~plane & ~mesh)
    corners = [data.xpos[mujoco_ids]]
    for row in np.flatnonzero(of_body & mesh):  # MuJoCo's own boxes follow principal axes: too large
        first, count = (int(a[model.geom_dataid[row]]) for a in (model.mesh_vertadr, model.mesh_vertnum))
        points = model.mesh_vert[first : first + count] @ data.geom_xmat[row].reshape(3, 3).T
        corners.append(points.min(axis=0)[None] + data.geom_xpos[row])
        corners.append(points.max(axis=0)[None] + data.geom_xpos[row])
    if len(rows):
        rotation = data.geom_xmat[rows].reshape(-1, 3, 3)
        box = model.geom_aabb[rows]
        centre = data.geom_xpos[rows] + np.einsum("nij,nj->ni", rotation, box[:, :3])
        half = np.einsum("nij,nj->ni", np.abs(rotation), box[:, 3:])
        corners += [centre - half, centre + half]
    points = np.concatenate(corners)
    return np.stack([points.min(axis=0), points.max(axis=0)])
