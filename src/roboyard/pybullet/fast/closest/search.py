"""The closest points of two bodies' shapes, found in one compiled call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.native import can_call
from roboyard.pybullet.fast.closest import kernels
from roboyard.sim.mujoco_library import mujoco_library

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import Side
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.world import World

Point = tuple[Any, ...]
Places = list[tuple[int, int, int]]
FEW = 4
"""Shapes of both sides up to which only these are placed, not those of all bodies."""
_FIELD = int(mujoco.mjtGeom.mjGEOM_HFIELD)
ZEROS = (0.0, 0.0, 0.0)
"""Forces and directions of friction, which closest points do not have."""


class ClosestSearch:
    """Finds closest points in the arrays of one MjData, of shapes that are no height fields."""

    def __init__(self, scene: PhysicsScene) -> None:
        """Look up MuJoCo's arrays."""
        self.scene = scene
        self._shapes = arrays_of_shapes(scene.world)
        self._room = self.make_room(16)
        self.seen: dict[tuple[int, int], tuple[Side, Any]] = {}
        """Sides of queries by body and link, -2 for all, and what machine code has of each."""

    def make_room(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return arrays for so many pairs: (count, NUMBERS) and (count, 2); see the loop."""
        return np.empty((count, kernels.NUMBERS)), np.empty((count, 2), np.int64)

    def arguments(self) -> tuple[Any, ...]:
        """Return the compiled loop and its first arguments, which are the same while MuJoCo's arrays are."""
        return kernels.closest_points, self._shapes, self.scene.shapes.geom_margins()

    def has_field(self, side: Side) -> bool:
        """Return whether any shape of a side is a height field, which this does not search."""
        model = self.scene.world.live_model
        return bool(model.nhfield) and bool((model.geom_type[side.geoms] == _FIELD).any())

    def points(self, first: Side, second: Side, limit: float) -> tuple[Point, ...]:
        """Return the rows of getClosestPoints of two sides' shapes within a distance (m)."""
        scene, (out, pairs) = self.scene, self._room
        a, b = first.geoms, second.geoms
        count = len(a) * len(b)
        if count > len(out):
            out, pairs = self._room = self.make_room(2 * count)
        world, moved = scene.world, 0
        if world.is_moved:
            moved = int(len(a) + len(b) <= FEW)
            if not moved:
                world.link_frames(keeps_last=True)
        found = kernels.closest_points(
            self._shapes, scene.shapes.geom_margins(), a, b, limit, moved, out, pairs
        )
        return rows_of(first.places, second.places, out, pairs, found)


def arrays_of_shapes(world: World) -> Any:
    """Return MuJoCo's arrays of a compiled world as the argument of the loops."""
    from roboyard.pybullet.state.bodies.link_groups import chain_of

    model, data = world.live_model, world.live_data
    shapes = kernels.Shapes(
        *(model.geom_type, model.geom_bodyid, model.geom_pos, model.geom_quat, data.geom_xpos),
        *(data.geom_xmat, model.geom_rbound, model.geom_size, np.zeros(12), model._address, data._address),
    )
    return kernels.CLOSEST.of(shapes, *chain_of(world).records)


def rows_of(one: Places, two: Places, out: np.ndarray, pairs: np.ndarray, found: int) -> tuple[Point, ...]:
    """Return the rows of getClosestPoints.

    Args:
        one: body, link and geom of each shape of the first side.
        two: those of the second side.
        out: (n, NUMBERS) of each pair; see the loops.
        pairs: (n, 2) places in one and two.
        found: number of pairs.
    """
    if not found:
        return ()
    body_a, body_b = one[0][0], two[0][0]
    return tuple(
        [
            (
                *(0, body_a, body_b, one[i][1], two[j][1], (x, y, z), (u, v, w), (p, q, r), distance),
                *(0.0, 0.0, ZEROS, 0.0, ZEROS),
            )
            for (i, j), (x, y, z, u, v, w, p, q, r, distance) in zip(
                pairs[:found].tolist(), out[:found].tolist(), strict=True
            )
        ]
    )


def closest_search(scene: PhysicsScene) -> ClosestSearch | None:
    """Return the search of a scene whose arrays are made; None without machine code."""
    model = scene.world.live_model
    if not can_call(mujoco_library) or not hasattr(model, "_address"):
        return None
    return ClosestSearch(scene)
