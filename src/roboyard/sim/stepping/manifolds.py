"""Contact points that pairs of convex shapes keep from step to step, as an impulse engine does.

MuJoCo finds all points of such a pair in each step, in the direction of a face where it finds several. Bullet
finds the deepest point only and keeps up to four of earlier steps: a robot that touches an edge is first
pushed at one point, straight away from the surface, and a body that comes to rest has all its points after a
few steps.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.stepping.manifold_kernels")

_MULTIPLE = int(mujoco.mjtDisableBit.mjDSBL_MULTICCD)


@dataclass(frozen=True, slots=True)
class KeptPoints:
    """The points of all pairs after a step."""

    owners: np.ndarray
    """(n, 2, 3) body, link and place in the link of the pairs' shapes."""
    counts: np.ndarray
    """(n,) number of points."""
    points: Array
    """(n, 4, 15) places in the frames of both links (m) and the contact frame."""


class Manifolds:
    """The points that pairs of hulls, cylinders and boxes keep in a world with rigid contacts.

    Worlds with fixed concave meshes are left as they are: their triangles have points of their own.
    """

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self._kinds = _kinds_that_keep()
        self._bound: _Bound | None = None
        self._kept: KeptPoints | None = None
        """The points until arrays are bound again, where bodies were added or removed."""
        self._count = 0
        self._now, self._next = _Table(0), _Table(0)
        self._source, self._extra = np.zeros(0, np.int32), np.zeros((0, 13))
        self._fresh, self._ends = np.zeros(15), np.zeros(1, np.int32)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or that bodies were added or removed."""
        if self._bound is not None:
            self._kept = self.save()
            self._bound = None

    def save(self) -> KeptPoints | None:
        """Return a copy of all points; None where there are none."""
        bound, count = self._bound, self._count
        if bound is None:
            return self._kept
        if not count:
            return None
        keys, now = self._now.keys[:count], self._now
        pairs = np.stack([keys // len(bound.owners), keys % len(bound.owners)], axis=1)
        return KeptPoints(bound.owners[pairs], now.counts[:count].copy(), now.points[:count].copy())

    def restore(self, kept: KeptPoints | None) -> None:
        """Go on with the points that were saved, or with none."""
        self._kept, self._bound = kept, None

    def prepare(self, model: Any, data: Any) -> None:
        """Let MuJoCo find one point of a pair where points are kept, before mj_step1."""
        if self._bound is None:
            self._bind(model, data)

    def update(self, model: Any, data: Any, found: StepRows, margins: Array, reaches: Array) -> bool:
        """Keep the points of the contacts found and add those of earlier steps, after mj_collision.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts, of which there are some.
            margins: (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes.
            reaches: (ngeom,) gaps (m) from which on the geom's contacts do not push.

        Returns:
            Whether contacts were added, so that constraints have to be made again.
        """
        bound = self._bound
        if bound is None or not bound.keeps:
            return False
        count = self._keep(bound, found, margins, reaches)
        if not count:
            return False
        added, contacts = 0, data.contact
        for source in self._source[:count].tolist():
            if mujoco.mj_addContact(model, data, contacts[source]):
                break  # MuJoCo's memory is full; it has warned, and grows before the next step
            added += 1
        total = found.look()[0]
        kernels().write_points(found.contacts, total, added, self._extra)
        return True

    def forget(self) -> None:
        """Forget all points: in this step there are no contacts."""
        self._count = 0

    def _keep(self, bound: _Bound, contacts: StepRows, margins: Array, reaches: Array) -> int:
        """Update the points of all pairs; return the number of those besides MuJoCo's."""
        count = contacts.counts[0]
        if len(self._next.keys) < count:
            self._next = _Table(2 * count)
        if len(self._source) < 4 * count:
            self._source, self._extra = np.zeros(8 * count, np.int32), np.zeros((8 * count, 13))
        now, following = self._now, self._next
        extra = kernels().keep_points(
            *(contacts.contacts, count, self._kinds, *bound.geoms),
            *(*bound.frames, margins, reaches, bound.seen, self._count, now.keys, now.counts, now.points),
            *(following.keys, following.counts, following.points),
            *(self._fresh, self._source, self._extra, self._ends),
        )
        self._now, self._next = following, now
        self._count = self._ends.item()
        return extra

    def _bind(self, model: Any, data: Any) -> None:
        world = self._world
        keeps = not any(r.windows for body in world.body_by_id.values() for r in body.built.links)
        if keeps:
            model.opt.disableflags |= _MULTIPLE
        else:
            model.opt.disableflags &= ~_MULTIPLE
        self._bound = _Bound(
            keeps=keeps,
            geoms=(model.geom_type, model.geom_bodyid),
            frames=(data.xpos, data.xmat),
            owners=_owners(world, model.ngeom),
            seen=2 * world.profile.contact_margin,
        )
        kept, self._kept, self._count = self._kept, None, 0
        if kept is not None and keeps:
            self._take(kept, self._bound.owners)

    def _take(self, kept: KeptPoints, owners: np.ndarray) -> None:
        """Write points under the present numbers of their geoms; those of bodies that are gone end."""
        number = {tuple(owner): geom for geom, owner in enumerate(owners.tolist())}
        table = _Table(len(kept.counts))
        for row, (one, two) in enumerate(kept.owners.tolist()):
            a, b = number.get(tuple(one)), number.get(tuple(two))
            if a is None or b is None:
                continue
            at = self._count
            table.keys[at] = a * len(owners) + b
            table.counts[at], table.points[at] = kept.counts[row], kept.points[row]
            self._count += 1
        self._now = table


@dataclass(frozen=True, slots=True)
class _Bound:
    """MuJoCo's arrays, which hold until the next compile."""

    keeps: bool
    """Whether points are kept in this world."""
    geoms: tuple[np.ndarray, ...]
    frames: tuple[Array, ...]
    owners: np.ndarray
    """(ngeom, 3) body, link and place in the link of each geom."""
    seen: float
    """Gap (m) up to which MuJoCo finds contacts."""


class _Table:
    """Points of so many pairs."""

    def __init__(self, count: int) -> None:
        self.keys, self.counts = np.zeros(count, np.int64), np.zeros(count, np.int32)
        self.points = np.zeros((count, 4, 15))


def _owners(world: Engine[Body], count: int) -> np.ndarray:
    """Return (ngeom, 3) body, link and place in the link of each geom; -1 where it is of no body."""
    owners = np.full((count, 3), -1)
    for body in world.body_by_id.values():
        for link, record in enumerate(body.built.links):
            for place, geom in enumerate(record.geoms):
                owners[geom.id] = body.id, link, place
    return owners


def _kinds_that_keep() -> np.ndarray:
    """Return (8, 8) 1 for pairs of geom types of which MuJoCo then finds one point, but for round ones."""
    kinds = mujoco.mjtGeom
    capsule, box = int(kinds.mjGEOM_CAPSULE), int(kinds.mjGEOM_BOX)
    convex = [capsule, int(kinds.mjGEOM_ELLIPSOID), int(kinds.mjGEOM_CYLINDER), box, int(kinds.mjGEOM_MESH)]
    keep = np.zeros((8, 8), np.uint8)
    keep[np.ix_(convex, convex)] = 1
    keep[np.ix_([capsule, box], [capsule, box])] = 0  # of these it finds several points
    return keep
