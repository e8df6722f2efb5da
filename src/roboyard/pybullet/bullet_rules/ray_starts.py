"""The shapes whose margins a ray may start in, and the hits of such rays."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from struct import Struct
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

import roboyard.pybullet.bullet_rules.ray_kernels as kernels
from roboyard.pybullet.bullet_rules.hull_margins import MARGIN
from roboyard.sim.build.geoms import VISUAL_GROUP
from roboyard.sim.queries.rays import kept_shapes
from roboyard.sim.queries.shape_rays import WORK

if TYPE_CHECKING:
    from roboyard.sim.world import World
    from roboyard.transforms import Array

Triple = tuple[float, ...]
_PACK = Struct("3d").pack_into
_HAS_CORE = np.bincount((kernels.SPHERE, kernels.CAPSULE, kernels.BOX, kernels.CYLINDER), minlength=16) > 0
"""(16,) whether one of MuJoCo's kinds of shapes has a core."""
_MOST_MASKS = 16
_LEAST_RAYS = 16
"""Rays for which there is room at least."""
MOST_HITS = 256
"""Hits of one ray for which there is memory."""
MOST_GRAZING = 20.0
"""Largest shift of a hit at a hull, in margins."""


class GroupFilters(Protocol):
    """Groups of links by body and link."""

    changes: int
    """How often they have changed."""

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
        self._records: Any = None
        """The shapes and cores as arguments of the compiled loop, or None."""
        self._numbering: tuple[np.ndarray, np.ndarray] | None = None
        self.uses = 0
        """Calls with rays since the shapes were looked up."""
        self._bundles: dict[int, tuple[int, Any]] = {}
        """By mask: how often groups of links had changed, and its shapes with memory for rays."""

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

    def enter_first(self, starts: Any, ends: Any, mask: int) -> kernels.Room | None:
        """Return memory with the first shapes that rays enter; None without machine code.

        Args:
            starts: (k, 3) points in the world frame (m).
            ends: (k, 3) points (m).
            mask: of the groups of links that the rays meet.
        """
        bundle = self._bundle_of(starts, ends, mask)
        if bundle is None:
            return None
        kernels.enter_first(bundle, len(starts), MOST_GRAZING)
        return bundle.records[2]

    def enter_numbered(self, starts: Any, ends: Any, mask: int, wanted: int) -> kernels.Room | None:
        """Return memory with the shapes that rays enter as the `wanted`-th of all, from 0; see `enter_first`.

        The link created last comes first. None also for more than `MOST_HITS` of a ray.
        """
        bundle = self._bundle_of(starts, ends, mask)
        if bundle is None:
            return None
        done = kernels.enter_numbered(bundle, len(starts), MOST_GRAZING, wanted, *self.numbering)
        return None if done < 0 else bundle.records[2]

    @property
    def numbering(self) -> tuple[np.ndarray, np.ndarray]:
        """Order of the (ngeom,) shapes in the numbers of hits, and memory for all hits of a ray."""
        if self._numbering is None:
            links, places = np.unique(self._world.geom_owners, axis=0, return_inverse=True)
            self._numbering = len(links) - places.reshape(-1).astype(np.int64), np.zeros((MOST_HITS, 6))
        return self._numbering

    def _bundle_of(self, starts: Any, ends: Any, mask: int) -> Any:
        """Return the first argument of loops over rays, which it holds; None without machine code."""
        count, world, filters = len(starts), self._world, self._filters
        if world.is_stale or self._revision != world.revision or not world.shows_triangles:
            self._look_up()
        self.uses += 1
        if self._records is None:
            return None
        if world.is_moved:
            world.link_frames(keeps_last=True)
        known = self._bundles.get(mask)
        if known is None or known[0] != filters.changes or len(known[1].records[2].starts) < count:
            if len(self._bundles) >= _MOST_MASKS:
                self._bundles.clear()
            shapes, cores = self._records if filters.shows_all(mask) else self._shown_records(mask)
            radii = world.live_model.geom_rbound[shapes.rows]
            room = _room(max(count, _LEAST_RAYS), len(shapes.rows), radii)
            bundle = kernels.FIRST.of(shapes, cores, room)
            known = self._bundles[mask] = filters.changes, bundle
        room = known[1].records[2]
        if count == 1:
            room.starts[0], room.ends[0] = starts[0], ends[0]
        else:
            room.starts[:count], room.ends[:count] = starts, ends
        return known[1]

    def bundle(self, mask: int) -> Any:
        """Return the first argument of the loop over rays with a mask; None where there were none yet."""
        changes, bundle = self._bundles.get(mask, (-1, None))
        return bundle if changes == self._filters.changes else None

    def _shown_records(self, mask: int) -> tuple[Any, Any]:
        """Return the shapes that a mask shows as arguments of the compiled loop."""
        shapes, cores = self._records
        rows = shapes.rows
        rows = rows[self._world.geom_owners[rows, 0] >= 0]
        return (
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
        has_core = _HAS_CORE[model.geom_type]
        there = has_core & (model.geom_group != VISUAL_GROUP) & (world.geom_owners[:, 0] >= 0)
        self._rows, margins = np.flatnonzero(there).astype(np.int32), self._margins()
        self._sizes = model.geom_type, model.geom_size, model.geom_rbound, margins
        cores = kernels.Cores(self._rows, margins)
        self._records = None if shapes is None else (shapes, cores)
        self._bundles.clear()
        self._numbering, self.uses = None, 0
        self._revision = world.revision


def _room(rays: int, shapes: int, radii: Array) -> kernels.Room:
    """Return memory for rays and shapes, whose bounding spheres have radii (k,), 0 for none (m)."""
    near, is_bounded = np.zeros((5, shapes)), radii > 0.0
    near[3] = np.where(is_bounded, radii + kernels.SLACK * (1.0 + radii), np.inf)
    near[4] = np.where(is_bounded, (radii + 2.0 * MARGIN + kernels.SLACK) ** 2, -1.0)
    return kernels.Room(
        *(np.zeros((rays, 3)), np.zeros((rays, 3)), np.zeros(rays, np.int64), np.zeros((rays, 7))),
        *(near, np.zeros(shapes, np.uint8), np.zeros(WORK)),
    )
