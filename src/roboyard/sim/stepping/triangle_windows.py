"""Shows MuJoCo the triangles of concave meshes that moving bodies may touch in the next step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.body import Body
from roboyard.sim.build.records import BuiltLink, windows_of
from roboyard.sim.build.triangle_windows import (
    FEWEST,
    HALF_THICKNESS,
    MOST,
    TriangleWindow,
    add_slots,
    show_hull,
    show_slots,
)
from roboyard.sim.engine import Engine
from roboyard.sim.soft.soft_bodies import SoftBodies
from roboyard.sim.stepping.surfaces import Surfaces

if TYPE_CHECKING:
    from roboyard.sim.stepping.narrow_phase.field_contacts import FieldContacts

kernels = lazy_module("roboyard.sim.stepping.triangle_kernels")
field_contacts = lazy_module("roboyard.sim.stepping.narrow_phase.field_contacts")

LOOKAHEAD = 0.01
"""Distance from a moving body up to which triangles get a slot (m); contacts are detected within 4 mm."""


class TriangleWindows:
    """The windows of one world: `update` before each step, `correct_contacts` before its constraints."""

    def __init__(self, world: Engine[Body], surfaces: Surfaces, soft: SoftBodies) -> None:
        self._world, self._surfaces, self._soft = world, surfaces, soft
        self._fields: FieldContacts | None = None
        self._windows: list[TriangleWindow] = []
        self._located: list[_Located] | None = None
        self.is_outdated = False
        """Whether MuJoCo's arrays are new since the last `update`."""

    @property
    def is_active(self) -> bool:
        """Whether any body of the last compile has a concave mesh."""
        return bool(self._windows)

    @property
    def shows_slots(self) -> bool:
        """Whether steps need slots: not where all triangles are searched."""
        if not self._windows:
            return False
        return any(window.whole is None for window in self._windows) or not self._are_searched()

    @property
    def fields(self) -> FieldContacts:
        """Room for the points of shapes on height fields; worlds without any do not load it."""
        found = self._fields
        if found is None:
            found = self._fields = field_contacts().FieldContacts()
        return found

    def may_search(self) -> bool:
        """Return whether the triangles of meshes can be searched where the forms of all shapes are known."""
        is_known = self._world.profile.hard_contacts and self._surfaces.forms_of is not None
        return is_known and field_contacts().is_installed()

    def _are_searched(self) -> bool:
        """Return whether the points of all shapes on height fields are found here."""
        world = self._world
        if not world.hard_contacts or self._soft.by_id:
            return False
        model, data = world.live_model, world.live_data
        return self.fields.leaves_room(model, self._surfaces.forms(model, data)) and self.fields.finds_all

    def invalidate(self) -> None:
        """Look up the windows of all bodies: MuJoCo's arrays are new."""
        self._windows = windows_of(self._world.body_by_id.values())
        self._located = None
        self.is_outdated = bool(self._windows)
        if any(window.whole is None for window in self._windows):
            self._all_located()  # rays look in the boxes of their slots

    def update(self, reach: float = LOOKAHEAD, *, everything: bool = False) -> None:
        """Give slots to all triangles near moving bodies; compile with more slots where they do not suffice.

        Args:
            reach: distance up to which triangles are near (m). Halved until the largest window suffices.
            everything: consider the other fixed bodies, too.
        """
        world = self._world
        world.ensure_compiled()
        if self.shows_slots and any(window.whole is not None for window in self._windows):
            self._show_slots()
        wanted = True
        while wanted:
            data, wanted = world.kinematics(), False
            for located in self._all_located():
                needed = located.update(data, reach, everything=everything)
                while needed > MOST and everything:
                    reach /= 2
                    needed = located.update(data, reach, everything=True)
                wanted |= located.grow(needed)
            if wanted:
                world.mark_stale()
                world.ensure_compiled()
        self.is_outdated = False

    def correct_contacts(self, data: Any) -> None:
        """Correct the distances of contacts on the velocity level, before they become constraints."""
        if not data.ncon:
            return
        contact = data.contact
        for located in self._all_located():
            located.correct(contact.geom, contact.frame, contact.dist)

    def inset(self, one: int, two: int) -> float:
        """Return the distance (m) by which a prism is thicker than what the other geom touches."""
        return sum(located.inset(one, two) for located in self._all_located())

    def hides(self, geom: int) -> bool:
        """Return whether a geom is a slot whose triangle was not near in the last `update`."""
        return any(located.hides(geom) for located in self._all_located())

    def _show_slots(self) -> None:
        """Give slots to meshes that were shown as a whole, or hulls, on bodies that move.

        The points of some shape are not found here.
        """
        world = self._world
        for record in (record for body in world.body_by_id.values() for record in body.built.links):
            show = show_slots if record.is_static else show_hull
            for window in record.windows:
                if window.whole is not None:
                    element, geoms, meshes = record.element, record.geoms, record.meshes
                    show(window, world.raw_spec, element, geoms, meshes, world.assets)
            if not record.is_static:
                record.windows.clear()
        world.mark_stale()
        world.ensure_compiled()

    def _all_located(self) -> list[_Located]:
        """Return all windows with their rows in MuJoCo's arrays, which are looked up on first use."""
        if self._located is None:
            self._located = [
                _Located(self._world, body, index, record, window)
                for body in self._world.body_by_id.values()
                for index, record in enumerate(body.built.links)
                for window in record.windows
            ]
        return self._located


class _Located:
    """One window and its rows in MuJoCo's arrays."""

    def __init__(
        self, world: Engine[Body], body: Body, index: int, record: BuiltLink, window: TriangleWindow
    ) -> None:
        model = world.live_model
        self._world, self._record, self._window = world, record, window
        self._row = int(body.mujoco_ids[index])
        self.geoms = np.array([geom.id for geom in window.slots], dtype=np.int32)
        tree = self._tree = window.tree
        self._slot_of = np.full(len(tree), -1, dtype=np.int32)
        self._triangle_of = np.full(len(self.geoms), -1, dtype=np.int32)
        self._seen, self._mark = np.zeros(len(tree), dtype=np.int64), 0
        self._kept = np.full(len(self.geoms), -1, dtype=np.int64)
        self._stack, self._turn = np.zeros(128, dtype=np.int64), np.zeros((3, 3))
        self._smooth: np.ndarray | None = None
        """The tree's `smooth`, once a contact needs it: to find seams takes as long as all else of a tree."""
        self._found, self._changed = np.zeros(len(tree), dtype=np.int32), np.zeros_like(self.geoms)
        self._slot_of_geom = np.full(model.ngeom, -1, dtype=np.int32)
        self._slot_of_geom[self.geoms] = np.arange(len(self.geoms))
        is_round = model.geom_type == int(mujoco.mjtGeom.mjGEOM_SPHERE)
        self._inset = np.where(is_round | window.is_file, HALF_THICKNESS, 0.0)
        """Bullet's margin around triangles holds for meshes in memory, and not for spheres."""
        moving = model.body_weldid[model.geom_bodyid] != 0
        self._movers = np.flatnonzero(moving)
        self._others = np.flatnonzero(
            (model.geom_bodyid != self._row) & (model.geom_type != int(mujoco.mjtGeom.mjGEOM_PLANE))
        )
        self._boxes = self._boxes_of_slots(model)
        self._least = np.array([[np.inf] * 3, [-np.inf] * 3])
        """(2, 3) box (m) that rays look at before the body's geoms."""
        if world.shows_triangles:
            trees = [each.tree for each in record.windows]
            self._least[0] = np.min([tree.lower[0] for tree in trees], axis=0)
            self._least[1] = np.max([tree.upper[0] for tree in trees], axis=0)
        model.geom_quat[self.geoms] = (1.0, 0.0, 0.0, 0.0)
        model.geom_sameframe[self.geoms] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
        self._assign(model, np.arange(len(self.geoms), dtype=np.int32), len(self.geoms))

    def update(self, data: Any, reach: float, *, everything: bool) -> int:
        """Give slots to the triangles near bodies; return the number of triangles that need one."""
        model, tree = self._world.live_model, self._tree
        self._mark += 1
        movers = self._others if everything else self._movers
        shapes = model.geom_contype, model.geom_conaffinity, model.geom_aabb, data.geom_xpos, data.geom_xmat
        count = 0
        for geoms, arrays in ((movers, shapes), *_soft_bodies(model, data)):
            near = kernels().near_triangles(
                *(geoms, *arrays, data.xpos[self._row], data.xmat[self._row], reach),
                *(tree.lower, tree.upper, tree.first, tree.corners, self._seen, self._mark),
                *(self._found[count:], self._stack, self._turn),
            )
            count += int(near)
        if count:
            self._assign(model, self._found, count)
        return count

    def grow(self, needed: int) -> bool:
        """Add slots where more are needed than there are, up to `MOST`; return whether any were added."""
        now = len(self.geoms)
        wanted = min(max(needed, 2 * now, FEWEST), len(self._tree), MOST)
        if needed <= now or wanted <= now:
            return False
        record = self._record
        add_slots(self._window, record.element, record.geoms, record.meshes, self._world.assets, wanted - now)
        return True

    def correct(self, geom: np.ndarray, frame: np.ndarray, dist: np.ndarray) -> None:
        """Correct the distances (k,) of contacts between geoms (k, 2) with frames (k, 9)."""
        tree = self._tree
        if self._smooth is None:
            if not (self._slot_of_geom[geom] >= 0).any():
                return
            self._smooth = tree.smooth.view(np.uint8)
        kernels().correct_contacts(
            *(self._slot_of_geom, self._triangle_of, tree.normals, tree.sides, self._smooth),
            *(self._world.live_data.xmat[self._row], self._inset, geom, frame, dist),
        )

    def inset(self, one: int, two: int) -> float:
        """Return by how much a prism is thicker than what the other geom touches (m)."""
        if self._slot_of_geom[one] >= 0:
            return float(self._inset[two])
        return float(self._inset[one]) if self._slot_of_geom[two] >= 0 else 0.0

    def hides(self, geom: int) -> bool:
        """Return whether a geom is a slot whose triangle was not near in the last update."""
        slot = int(self._slot_of_geom[geom])
        return slot >= 0 and self._seen[self._triangle_of[slot]] != self._mark

    def _assign(self, model: Any, found: np.ndarray, count: int) -> None:
        number = kernels().assign_slots(
            found, count, self._slot_of, self._triangle_of, self._kept, self._mark, self._changed
        )
        if not number:
            return
        number = int(number)
        self._world.mark_moved()  # the slots
        tree = self._tree
        kernels().write_prisms(
            *(self._changed[:number], self._triangle_of, self.geoms, HALF_THICKNESS),
            *(tree.corners, tree.normals, model.geom_pos, model.geom_aabb, model.geom_rbound),
            *(model.mesh_vertadr, model.mesh_vert, model.mesh_polyadr, model.mesh_polynum),
            *(model.mesh_polyvertadr, model.mesh_polyvertnum, model.mesh_polyvert),
            *(model.mesh_polynormal, model.geom_dataid),
        )
        start, count = int(model.body_bvhadr[self._row]), int(model.body_bvhnum[self._row])
        kernels().refit_boxes(
            start,
            count,
            model.bvh_child,
            self._boxes,
            model.geom_pos,
            model.geom_aabb,
            LOOKAHEAD,
            self._least,
            model.bvh_aabb,
        )

    def _boxes_of_slots(self, model: Any) -> np.ndarray:
        """Return the slot's geom for each node of the body's tree of boxes; -1 for other nodes."""
        start, count = int(model.body_bvhadr[self._row]), int(model.body_bvhnum[self._row])
        nodes = np.array(model.bvh_nodeid[start : start + count]) if count else np.zeros(0, dtype=np.int32)
        nodes[~np.isin(nodes, [geom.id for window in self._record.windows for geom in window.slots])] = -1
        return nodes.astype(np.int32)


def _soft_bodies(model: Any, data: Any) -> list[tuple[np.ndarray, tuple[np.ndarray, ...]]]:
    """Return numbers and boxes of all soft bodies as those of geoms in the world's frame."""
    count = model.nflex
    if not count:
        return []
    boxes = np.zeros((count, 6))
    for flex in range(count):
        first = model.flex_vertadr[flex]
        places = data.flexvert_xpos[first : first + model.flex_vertnum[flex]]
        low, high = places.min(axis=0), places.max(axis=0)
        boxes[flex, :3], boxes[flex, 3:] = (low + high) / 2, (high - low) / 2 + model.flex_radius[flex]
    turns = np.tile(np.eye(3).ravel(), (count, 1))
    collide = np.ones(count, np.int32)
    return [(np.arange(count), (collide, collide, boxes, np.zeros((count, 3)), turns))]
