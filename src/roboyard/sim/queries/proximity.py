"""Distances between links that need not touch, and bounding boxes of geoms."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link
from roboyard.transforms import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class Proximity:
    """The nearest points of two links."""

    link_a: Link
    link_b: Link
    point_a: Array
    """(3,) point on link_a in the world frame (m)."""
    point_b: Array
    """(3,) point on link_b in the world frame (m)."""
    distance: float
    """Distance (m); negative for an overlap."""

    @property
    def normal(self) -> Array:
        """(3,) unit vector from b to a in the world frame."""
        between = self.point_a - self.point_b if self.distance >= 0 else self.point_b - self.point_a
        length = np.linalg.norm(between)
        return between / length if length > 1e-12 else np.array([0.0, 0.0, 1.0])


def nearest(world: Engine[Body], a: Link, b: Link, largest: float) -> Proximity | None:
    """Return the nearest points of two links within a distance (m); collision shapes only."""
    data = world.kinematics()
    model = world.live_model
    best, ends = largest, None
    fromto = np.zeros(6)
    for one in a.geom_ids:
        for two in b.geom_ids:
            if not _boxes_within(model, data, one, two, best):
                continue
            distance = mujoco.mj_geomDistance(model, data, one, two, best, fromto)
            if distance < best:
                best, ends = distance, fromto.copy()
    if ends is None:
        return None
    return Proximity(link_a=a, link_b=b, point_a=ends[:3], point_b=ends[3:], distance=float(best))


def between_bodies(world: Engine[Body], a: Body, b: Body, largest: float) -> list[Proximity]:
    """Return the nearest points of every pair of links of two bodies within a distance (m)."""
    found = []
    for one in a.links:
        for two in b.links:
            if a is b and one.index >= two.index:
                continue
            near = nearest(world, one, two, largest)
            if near is not None:
                found.append(near)
    return found


def geom_bounds(world: Engine[Body], geoms: list[int]) -> Array:
    """Return the (n, 2, 3) bounding boxes of some MuJoCo geoms (m). Infinite planes are ±inf."""
    data = world.kinematics()
    model = world.live_model
    rotation = data.geom_xmat[geoms].reshape(-1, 3, 3)
    box = model.geom_aabb[geoms]
    centre = data.geom_xpos[geoms] + np.einsum("nij,nj->ni", rotation, box[:, :3])
    half = np.einsum("nij,nj->ni", np.abs(rotation), box[:, 3:])
    half[model.geom_type[geoms] == int(mujoco.mjtGeom.mjGEOM_PLANE)] = np.inf
    return np.stack([centre - half, centre + half], axis=1)


def _boxes_within(model: Any, data: Any, one: int, two: int, distance: float) -> bool:
    """Return whether the bounding spheres of two geoms are within a distance (planes always are)."""
    radius = model.geom_rbound
    if radius[one] == 0 or radius[two] == 0:
        return True
    position = data.geom_xpos
    gap = np.linalg.norm(position[one] - position[two]) - radius[one] - radius[two]
    return bool(gap <= distance)
