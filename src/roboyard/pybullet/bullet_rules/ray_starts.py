"""The shapes whose margins a ray may start in, and the hits of such rays."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from struct import Struct
from typing import TYPE_CHECKING

import numpy as np

from roboyard.pybullet.bullet_rules.ray_kernels import BOX, CAPSULE, CYLINDER, SPHERE, start_within
from roboyard.sim.build.geoms import VISUAL_GROUP

if TYPE_CHECKING:
    from roboyard.sim.world import World
    from roboyard.transforms import Array

_PACK = Struct("3d").pack_into


class MarginShapes:
    """Spheres, capsules, boxes and cylinders of a world, whose margins reach inwards."""

    def __init__(
        self,
        world: World,
        margins: Callable[[], np.ndarray],
        shown: Callable[[np.ndarray, int], np.ndarray],
    ) -> None:
        """Look them up when they are first needed.

        Args:
            world: the world.
            margins: returns (ngeom,) by which Bullet's shapes are larger than MuJoCo's (m).
            shown: returns those of some MuJoCo geoms that a mask shows.
        """
        self._world, self._margins, self._shown = world, margins, shown
        self._revision = -1
        self._rows = np.zeros(0, dtype=np.int32)
        self._start, self._way = np.zeros((1, 3)), np.zeros((1, 3))
        self._words = self._start.data.cast("B"), self._way.data.cast("B")
        self._found, self._normal = np.zeros(1, dtype=np.int32), np.zeros((1, 3))

    def around(self, starts: Array, ways: Array, mask: int) -> tuple[np.ndarray, Array] | None:
        """Return the shapes in whose margins rays start that head inwards; None where no ray does.

        Args:
            starts: (k, 3) points (m).
            ways: (k, 3) from there to the ends (m).
            mask: of the groups of links that rays meet.

        Returns:
            (k,) MuJoCo geoms, -1 for none, and (k, 3) normals outwards.
        """
        found, normals = np.empty(len(starts), dtype=np.int32), np.empty((len(starts), 3))
        return (found, normals) if self._find(starts, ways, mask, found, normals) else None

    def around_one(
        self, start: tuple[float, ...], way: tuple[float, ...], mask: int
    ) -> tuple[int, tuple[float, ...]] | None:
        """Return the shape (MuJoCo geom) around the start (3,) of a ray, and its normal; None without."""
        a, b, c = start
        x, y, z = way
        if not isfinite(a + b + c + x + y + z) or x == y == z == 0.0:
            return None
        _PACK(self._words[0], 0, a, b, c)
        _PACK(self._words[1], 0, x, y, z)
        if not self._find(self._start, self._way, mask, self._found, self._normal):
            return None
        return self._found.item(), tuple(self._normal[0].tolist())

    def _find(self, starts: Array, ways: Array, mask: int, found: np.ndarray, normals: Array) -> int:
        world = self._world
        data = world.kinematics()
        if self._revision != world.revision:
            self._look_up()
        rows = self._shown(self._rows, mask)
        if not len(rows):
            return 0
        return start_within(
            *(starts, ways, rows, *self._sizes, data.geom_xpos, data.geom_xmat, found, normals)
        )

    def _look_up(self) -> None:
        world = self._world
        model = world.live_model
        has_core = np.isin(model.geom_type, (SPHERE, CAPSULE, BOX, CYLINDER))
        there = has_core & (model.geom_group != VISUAL_GROUP) & (world.geom_owners[:, 0] >= 0)
        self._rows = np.flatnonzero(there).astype(np.int32)
        self._sizes = model.geom_type, model.geom_size, model.geom_rbound, self._margins()
        self._revision = world.revision
