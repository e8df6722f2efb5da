"""The shapes whose margins a ray may start in, and the hits of such rays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import isfinite
from struct import Struct
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

import roboyard.pybullet.bullet_rules.ray_kernels as kernels
from roboyard.sim.build.geoms import VISUAL_GROUP
from roboyard.sim.queries.rays import kept_shapes
from roboyard.sim.queries.shape_rays import WORK

if TYPE_CHECKING:
    from roboyard.sim.world import World
    from roboyard.transforms import Array

Triple = tuple[float, ...]
_PACK = Struct("3d").pack_into
_WITH_CORE = kernels.SPHERE, kernels.CAPSULE, kernels.BOX, kernels.CYLINDER
_MOST_MASKS = 16
MOST_GRAZING = 20.0
"""Largest shift of a hit at a hull, in margins."""


class GroupFilters(Protocol):
    """Groups of links by body and link."""

    groups: dict[tuple[int, int], tuple[int, int]]
    """Group and mask of those that do not have the default ones."""

    def shows_all(self, mask: int) -> bool:
        """Return whether the groups of all links share a bit with a mask."""
        ...


class MarginShapes:
    """Spheres, capsules, boxes and cylinders of a world, whose margins reach inwards."""

    def __init__(
        self,
        world: World,
        margins: Callable[[], np.ndarray],
        shown: Callable[[np.ndarray, int], np.ndarray],
        filters: GroupFilters,
    ) -> None:
        """Look them up when they are first needed.

        Args:
            world: the world.
            margins: returns (ngeom,) by which Bullet's shapes are larger than MuJoCo's (m).
            shown: returns those of some MuJoCo geoms that a mask shows.
            filters: groups of links, from which that follows.
        """
        self._world, self._margins, self._shown, self._filters = world, margins, shown, filters
        self._revision = -1
        self._rows = np.zeros(0, dtype=np.int32)
        self._start, self._way = np.zeros((1, 3)), np.zeros((1, 3))
        self._words = self._start.data.cast("B"), self._way.data.cast("B")
        self._found, self._normal = np.zeros(1, dtype=np.int32), np.zeros((1, 3))
        self._first: Any = None
        self._masked: dict[int, tuple[dict[Any, Any], Any]] = {}
        """By mask: groups of links, and the shapes that it shows of these."""
        self._work, self._hit = np.zeros(WORK), np.zeros(7)

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

    def around_one(self, start: Triple, way: Triple, mask: int) -> tuple[int, Triple] | None:
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

    def first(
        self, start: Triple, way: Triple, length: float, mask: int
    ) -> tuple[int, Sequence[float]] | None:
        """Return the first shape (MuJoCo geom) that a ray enters, and fraction, point and normal of the hit.

        The shape is -1 for a miss. None where the ray leaves a shape before, or without machine code.

        Args:
            start: (3,) point in the world frame (m).
            way: (3,) vector from there to the ray's end (m).
            length: of that, finite and above 0 (m).
            mask: of the groups of links that the ray meets.
        """
        world, filters = self._world, self._filters
        if world.is_stale or self._revision != world.revision or not world.shows_triangles:
            self._look_up()
        if world.is_moved:
            world.link_frames(keeps_last=True)
        shapes = self._first
        if shapes is None:
            return None
        if not filters.shows_all(mask):
            known = self._masked.get(mask)
            if known is None or known[0] != filters.groups:
                known = self._masked[mask] = filters.groups.copy(), self._shapes_of(mask)
            shapes = known[1]
        geom = kernels.enter_first(shapes, *start, *way, length, MOST_GRAZING, self._work, self._hit)
        return None if geom == kernels.LEAVES else (geom, self._hit.tolist())

    def _shapes_of(self, mask: int) -> Any:
        """Return the shapes that a mask shows as arguments of the compiled loop."""
        shapes, cores = self._first.records
        rows = shapes.rows
        rows = rows[self._world.geom_owners[rows, 0] >= 0]
        if len(self._masked) >= _MOST_MASKS:
            self._masked.clear()
        return kernels.FIRST.of(
            shapes._replace(rows=np.ascontiguousarray(self._shown(rows, mask))),
            cores._replace(rows=np.ascontiguousarray(self._shown(cores.rows, mask))),
        )

    def _find(self, starts: Array, ways: Array, mask: int, found: np.ndarray, normals: Array) -> int:
        world = self._world
        data = world.link_frames(keeps_last=True)
        if self._revision != world.revision:
            self._look_up()
        rows = self._shown(self._rows, mask)
        if not len(rows):
            return 0
        return kernels.start_within(
            *(starts, ways, rows, *self._sizes, data.geom_xpos, data.geom_xmat, found, normals)
        )

    def _look_up(self) -> None:
        world = self._world
        shapes = kept_shapes(world)
        model = world.live_model
        has_core = np.isin(model.geom_type, _WITH_CORE)
        there = has_core & (model.geom_group != VISUAL_GROUP) & (world.geom_owners[:, 0] >= 0)
        self._rows, margins = np.flatnonzero(there).astype(np.int32), self._margins()
        self._sizes = model.geom_type, model.geom_size, model.geom_rbound, margins
        cores = kernels.Cores(self._rows, margins)
        self._first = None if shapes is None else kernels.FIRST.of(shapes, cores)
        self._masked.clear()
        self._revision = world.revision
