"""The closest points of collision shapes that belong to no body, found among copies in a world of their own.

To place a shape in the world of the bodies would take a change of that world for each query. Shapes and
bodies that are used again are copied once instead, and each query places the copies as the bodies are then.
"""

from __future__ import annotations

from functools import partial
from math import isfinite, sqrt
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.description.model import Collision, Heightfield, Link, RobotDescription
from roboyard.native import can_call
from roboyard.pybullet.bullet_rules.hull_margins import geom_margins
from roboyard.pybullet.fast.closest import kernels
from roboyard.pybullet.fast.closest.search import Point, arrays_of_shapes, rows_of
from roboyard.pybullet.state.query_shapes import QUERY_LINK, pose_of
from roboyard.sim.mujoco_library import mujoco_library
from roboyard.sim.physics_profile import BULLET
from roboyard.sim.world import World

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import Side
    from roboyard.pybullet.state.physics_scene import PhysicsScene
    from roboyard.sim.body import Body

FEW = 4
"""Queries of a shape or of a body after which it is copied, which takes as long as they do."""
MOST = 1000
"""Queries of different bodies, links and shapes that are known."""
_BODY, _SHAPE = -1, -3
_PACK = Struct("7d").pack_into
_NO_POSE = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


Key = tuple[tuple[int, int, int], tuple[int, int, int]]
"""Body, link and shape of both sides, -1 for none."""
Poses = tuple[tuple[Any, Any], tuple[Any, Any]]
"""Position (m) and orientation (x, y, z, w) of both sides, None for none."""


class _Copied(NamedTuple):
    """Copies of the shapes of one side."""

    geoms: np.ndarray
    """(k,) in the world of the copies."""
    sources: np.ndarray
    """(k,) in the world of the bodies; -1 for a shape that belongs to none."""
    places: list[tuple[int, int, int]]
    """Body, link and a geom of each."""


class _Plan(NamedTuple):
    """Results of a query, for the next one with the same bodies, links and shapes."""

    revision: int
    """Of the bodies' world."""
    revision_of_copies: int
    owners: tuple[tuple[int, Any], ...]
    """Ids of shapes, and the shapes."""
    before: tuple[Any, ...]
    """Arguments of the loop before the distance."""
    places: tuple[list[tuple[int, int, int]], list[tuple[int, int, int]]]
    """Body, link and a geom of each shape of both sides."""


class _Owner:
    """A body, or the shapes of an id, and its copies."""

    def __init__(self, owner: Any) -> None:
        self.owner = owner
        self.calls = 0
        self.copies: list[Body] | None = None
        """A fixed body for each link; none where it has no copies yet."""
        self.is_refused = False
        """Whether its shapes cannot be copied."""
        self.sides: dict[int, tuple[Side | None, int, _Copied]] = {}
        """By link: the shapes in the world of the bodies, the revision of the other world, and the copies."""


class ClosestCopies:
    """Finds closest points of shapes at poses and of bodies."""

    def __init__(self, scene: PhysicsScene) -> None:
        self._scene = scene
        self._world = World(profile=BULLET, visual_geoms=False)
        self._owners: dict[tuple[int, int], _Owner] = {}
        """By the place of a shape in the query, `_BODY` for bodies, and its id."""
        self._arrays: Any = None
        """Revision of the copies' world, and its arrays and margins for the loop."""
        self._room = np.empty((16, kernels.NUMBERS)), np.empty((16, 2), np.int64)
        self._poses = _NO_POSE.copy(), _NO_POSE.copy()
        self._plans: dict[Key, _Plan] = {}
        self._prepared: set[Any] = set()
        """Keys of the queries that machine code knows."""

    def release(self) -> None:
        """Free MuJoCo's arrays."""
        self._world.release()
        vars(self).clear()

    def points(self, key: Key, poses: Poses, limit: float) -> tuple[Point, ...] | None:
        """Return the rows of getClosestPoints of a query that is planned; None of another one.

        Args:
            key: of the query.
            poses: of shapes at poses; others are ignored.
            limit: distance (m).
        """
        plan = self._plans.get(key)
        if plan is None or not self._is_valid(plan):
            return None
        for (_, _, shape), pose, into in zip(key, poses, self._poses, strict=True):
            if shape >= 0 and not _write_pose(pose, into):
                return None
        if self._scene.world.is_moved:
            self._scene.world.link_frames(keeps_last=True)
        room = self._room
        found = kernels.closest_copies(*plan.before, limit, *room)
        return rows_of(*plan.places, *room, found)

    def plan(self, key: Key, shapes: tuple[Side | None, Side | None]) -> bool:
        """Plan a query, if there are copies of what it asks for; return whether there are.

        Args:
            key: of the query.
            shapes: of each side in the world of the bodies; None for a shape at a pose.
        """
        plan = self._plan(key, shapes)
        if plan is None:
            return False
        if len(self._plans) > MOST:
            self._plans.clear()
        self._plans[key] = plan
        return True

    def prepare(self, key: Key) -> None:
        """Let machine code find the points of a query that is planned."""
        from roboyard.pybullet.fast.closest.entries import KIND, ShapePlan

        scene, plan = self._scene, self._plans[key]
        world = scene.world
        known: Any = world.prepared.get(KIND)
        number = key[0] + key[1]
        if known is None or number in known or world.is_stale or len(known) > MOST:
            return
        owners = dict(plan.owners)
        has_body = any(shape < 0 for _, _, shape in key)
        known[number] = ShapePlan(
            world=world,
            update=partial(world.link_frames, keeps_last=True) if has_body else None,
            shapes=scene.collision_shapes,
            owners=(key[0][2], owners.get(key[0][2]), key[1][2], owners.get(key[1][2])),
            loop=kernels.closest_copies,
            arguments=(*plan.before, *self._room),
            out=self._room[0],
            places=self._room[1].reshape(-1),
            poses=self._poses,
            first=tuple(place[1] for place in plan.places[0]),
            second=tuple(place[1] for place in plan.places[1]),
            bodies=tuple(side[0][0] if side else _BODY for side in plan.places),
        )
        self._prepared.add(number)

    def _forget_prepared(self) -> None:
        """Drop the queries of machine code, before copies come or go."""
        known: Any = self._scene.world.prepared.get("closest", {})
        for number in self._prepared:
            known.pop(number, None)
        self._prepared.clear()

    def _is_valid(self, plan: _Plan) -> bool:
        """Return whether a query has the same answer as then, but for poses."""
        scene = self._scene
        world, shapes = scene.world, scene.collision_shapes
        if world.is_stale or world.revision != plan.revision:
            return False
        if self._world.is_stale or self._world.revision != plan.revision_of_copies:
            return False
        return all(shapes.get(number) is owner for number, owner in plan.owners)

    def _plan(self, sides: Key, shapes: tuple[Side | None, Side | None]) -> _Plan | None:
        """Return what a query needs; None where there are no copies."""
        first, second = (self._owner_of(place, *side) for place, side in enumerate(sides))
        if first is None or second is None or not self._are_copied(first, second):
            return None
        one, two = self._copied(first, sides[0][1], shapes[0]), self._copied(second, sides[1][1], shapes[1])
        if one is None or two is None:
            return None
        count = len(one.geoms) * len(two.geoms)
        if count > len(self._room[0]):
            self._room = np.empty((2 * count, kernels.NUMBERS)), np.empty((2 * count, 2), np.int64)
        arrays = *self._own_arrays(), *self._arrays_of_sources()
        return _Plan(
            self._scene.world.revision,
            self._world.revision,
            tuple(
                (shape, side.owner)
                for (_, _, shape), side in zip(sides, (first, second), strict=True)
                if shape >= 0
            ),
            (*arrays, one.geoms, two.geoms, one.sources, two.sources, *self._poses),
            (one.places, two.places),
        )

    def _owner_of(self, place: int, body: int, _: int, shape: int) -> _Owner | None:
        """Return what is known of a side's body or shape; None where there is none."""
        key = (place, shape) if shape >= 0 else (_BODY, body)
        owner = self._there(*key)
        if owner is None:
            return None
        found = self._owners.get(key)
        if found is None or found.owner is not owner:
            if found is not None:
                self._remove(found)
            found = self._owners[key] = _Owner(owner)
        found.calls += 1
        return found

    def _are_copied(self, *owners: _Owner) -> bool:
        """Return whether all have copies, which those get that were asked for a few times."""
        if any(owner.is_refused or owner.calls <= FEW for owner in owners):
            return False
        for owner in owners:
            if owner.copies is None:
                self._copy(owner)
        return not any(owner.is_refused for owner in owners)

    def _copy(self, owner: _Owner) -> None:
        """Copy the shapes of an owner, if they are such as can be."""
        self._forget_removed()
        self._forget_prepared()
        what = owner.owner
        if hasattr(what, "model"):
            links: list[tuple[Collision, ...]] = [link.collisions for link in what.model.description.links]
        else:
            links = [what.shapes]
        is_soft = getattr(what, "soft", None) is not None
        if is_soft or not can_call(mujoco_library) or not all(map(_are_plain, links)):
            owner.is_refused = True
            return
        owner.copies = [
            self._world.add_description(
                RobotDescription(name="shape", links=(Link(name="shape", collisions=shapes),)),
                fixed_base=True,
                drives=False,
            )
            for shapes in links
        ]

    def _forget_removed(self) -> None:
        """Remove the copies of bodies and shapes that are no longer there."""
        for key, found in list(self._owners.items()):
            if self._there(*key) is not found.owner:
                self._remove(found)
                del self._owners[key]

    def _there(self, place: int, number: int) -> Any:
        """Return the body or the shapes of an id; None where there are none."""
        scene = self._scene
        known: Any = scene.bodies if place == _BODY else scene.collision_shapes
        return known.get(number)

    def _remove(self, owner: _Owner) -> None:
        self._forget_prepared()
        for body in owner.copies or ():
            self._world.remove(body)

    def _copied(self, owner: _Owner, link: int, shapes: Side | None) -> _Copied | None:
        """Return the copies of a side's shapes; None where they are not as those in the other world."""
        self._world.ensure_compiled()
        link = _SHAPE if shapes is None else link
        kept = owner.sides.get(link)
        if kept is not None and kept[0] is shapes and kept[1] == self._world.revision:
            return kept[2]
        assert owner.copies is not None
        if shapes is None:
            geoms = owner.copies[0].links[0].geom_ids
            places = [(-1, QUERY_LINK, geom) for geom in geoms]
            sources = np.full(len(geoms), -1, np.int64)
        else:
            places, sources = shapes.places, np.ascontiguousarray(shapes.geoms, np.int64)
            in_order = sorted({place[1] for place in places})
            geoms = [geom for index in in_order for geom in owner.copies[index + 1].links[0].geom_ids]
            ours, theirs = self._world.live_model, self._scene.world.live_model
            if len(geoms) != len(sources) or not all(
                np.array_equal(getattr(ours, name)[geoms], getattr(theirs, name)[sources])
                for name in ("geom_type", "geom_size", "geom_rbound")
            ):
                owner.is_refused = True
                return None
        made = _Copied(np.array(geoms, np.int64), sources, places)
        owner.sides[link] = shapes, self._world.revision, made
        return made

    def _own_arrays(self) -> tuple[Any, Any]:
        """Return the arrays of the copies, and their margins (m)."""
        world = self._world
        if self._arrays is None or self._arrays[0] != world.revision:
            model = world.live_model
            self._arrays = world.revision, arrays_of_shapes(world), geom_margins(model)
        return self._arrays[1:]

    def _arrays_of_sources(self) -> tuple[Any, Any, Any]:
        """Return where the bodies' shapes are, and their margins (m)."""
        scene, world = self._scene, self._scene.world
        world.ensure_compiled()
        data = world.live_data
        return data.geom_xpos, data.geom_xmat, scene.shapes.geom_margins()


def _are_plain(shapes: tuple[Collision, ...]) -> bool:
    """Return whether shapes never change, and each is one of MuJoCo's."""
    return not any(shape.concave or isinstance(shape.geometry, Heightfield) for shape in shapes)


def _write_pose(given: tuple[Any, Any], into: np.ndarray) -> bool:
    """Write the pose of a shape (7,); return whether it can be used as it is."""
    (x, y, z), (i, j, k, w) = pose_of(*given)
    length = sqrt(i * i + j * j + k * k + w * w)
    if length == 0.0 or not isfinite(x + y + z + length):
        return False
    _PACK(into.data, 0, x, y, z, i / length, j / length, k / length, w / length)
    return True
