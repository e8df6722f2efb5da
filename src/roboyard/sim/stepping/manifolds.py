"""Contact points that pairs of convex shapes keep from step to step, as an impulse engine does.

MuJoCo finds all points of such a pair in each step, in the direction of a face where it finds several. Bullet
finds the deepest point only and keeps up to four of earlier steps: a robot that touches an edge is first
pushed at one point, straight away from the surface, and a body that comes to rest has all its points after a
few steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._mujoco import mujoco
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.stepping.broad_phase.box_tree import ENTERED, ENTRY
from roboyard.sim.stepping.impulses.records import (
    EXTRA,
    HELD,
    LINKS,
    PAIRS,
    REFRESHED,
    SHAPES,
    TABLE,
)  # fmt: skip
from roboyard.sim.stepping.points.bound_points import BoundPoints
from roboyard.sim.stepping.shape_forms import ShapeForms
from roboyard.sim.stepping.step_rows import StepRows
from roboyard.sim.stepping.triangle_windows import TriangleWindows
from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.stepping.manifold_kernels")
edge_kernels = lazy_module("roboyard.sim.stepping.narrow_phase.edge_kernels")
changes = lazy_module("roboyard.sim.stepping.manifold_changes")

_BLANK = mujoco.MjContact()
"""Given to MuJoCo for contacts that are written then."""


FirstBoxes = Callable[[Sequence[int]], "tuple[Sequence[int], Array, Array]"]
"""Returns which of some bodies, by id, were made at known places, (n, 5, 3) boxes around all their links in
the bases' frames (m), and the (n, 7) pose of the base for each link, as for `write_first_boxes`."""


class Manifolds(BoundPoints):
    """The points that pairs of hulls, cylinders and boxes keep in a world with rigid contacts.

    Worlds where triangles of concave meshes have slots are left as they are: each has points of its own.
    """

    def __init__(self, world: Engine[Body], windows: TriangleWindows) -> None:
        super().__init__(world, windows)
        self.first_boxes: FirstBoxes | None = None
        """Looks up the boxes in which the shapes of bodies were made; without it, these are where the shapes
        are at the first step."""

    def prepare(self, model: Any, data: Any) -> None:
        """Let MuJoCo find one point of a pair where points are kept, before mj_step1."""
        if self._bound is None:
            self._bind(model, data)
        if self._new:
            self._write_first_boxes()
        if self._has_old_turns:
            self._write_turns(model.geom_bodyid)

    @property
    def is_prepared(self) -> bool:
        """Whether `prepare` has nothing to do."""
        return self._bound is not None and not (self._new or self._has_old_turns)

    def _write_turns(self, links_of_geoms: np.ndarray) -> None:
        """Write the turns in which links enter the broad phase, also those that do so in the next step."""
        points, notes = self.points, self.points.notes
        changes().write_turns(
            *(points.links, notes.item(LINKS), points.refreshed, notes.item(REFRESHED), points.leaves),
            *(points.ties, ENTRY, points.tree.item(ENTERED), points.turns[: notes.item(SHAPES)]),
            *(links_of_geoms, np.zeros(len(points.leaves), np.int32), points.entered),
        )
        self._has_old_turns = False

    def _write_first_boxes(self) -> None:
        """Write the boxes in which new links were made, for the next step."""
        points = self.points
        if self.first_boxes is not None:
            bodies, boxes, poses = self.first_boxes(list(self._new))
            if len(bodies):
                links = np.concatenate([self._new[body] for body in bodies])
                changes().write_first_boxes(links, boxes, poses, points.leaves, points.bounds)
        self._new.clear()

    def move(
        self,
        model: Any,
        data: Any,
        found: StepRows,
        margins: Array,
        forms: ShapeForms,
    ) -> bool:
        """Move contacts to where shapes are closest, and those across gaps that do not count.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts, of which there are some.
            margins: (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes.
            forms: of the shapes; see the loops `place_contacts` and `drop_gaps`.

        Returns:
            Whether a contact was moved, so that constraints have to be made again.
        """
        contacts = found.contacts, found.counts[0], model.geom_type, model.geom_bodyid, data.xpos, data.xmat
        moved = edge_kernels().place_contacts(
            *contacts, forms.boxes, forms.rounding, forms.hulls, forms.spans, forms.compound,
            self.points.entered, margins, int(self.keeps), self.points.fresh,
        )  # fmt: skip
        kernels().drop_gaps(*contacts, margins, forms.parts, forms.compound, int(self.keeps))
        return moved == 1

    def update(
        self,
        model: Any,
        data: Any,
        found: StepRows,
        margins: Array,
        reaches: Array,
        anchors: np.ndarray,
        forms: ShapeForms,
    ) -> bool:
        """Keep the points of the contacts found and add those of earlier steps, after mj_collision.

        Args:
            model: MjModel.
            data: MjData.
            found: the contacts, of which there are some.
            margins: (ngeom,) widths (m) by which surfaces lie outside MuJoCo's shapes.
            reaches: (ngeom,) gaps (m) from which on the geom's contacts do not push.
            anchors: (ngeom,) 1 for surfaces with anchors.
            forms: of the shapes, of none where gaps do not matter.

        Returns:
            Whether contacts were added or moved to anchors, so that constraints have to be made again.
        """
        bound = self._bound
        if bound is None or not bound.keeps:
            return False
        count = found.counts[0]
        self.grow(count)
        points = self.points
        now = int(points.notes[TABLE])
        before, after = ((points.keys[k], points.counts[k], points.points[k]) for k in (now, 1 - now))
        extra = kernels().keep_points(
            *(found.contacts, count, points.kinds, *bound.geoms, *bound.frames, margins, reaches),
            *(anchors, bound.seen),
            *(int(points.notes[PAIRS]), *before, *after, points.fresh, points.source, points.extra),
            *(points.slots, points.notes, forms.boxes, forms.compound, points.entered),
            *(forms.rounding, forms.hulls, forms.spans, bound.fields),
        )
        points.notes[TABLE], points.notes[EXTRA] = 1 - now, extra
        held = bool(points.notes[HELD])
        return (extra > 0 and self.add(model, data, found)) or held

    def add(self, model: Any, data: Any, found: StepRows) -> bool:
        """Add the points that the last update found besides MuJoCo's contacts, which they are copies of."""
        points, contacts = self.points, None if found.is_direct else data.contact
        added = 0
        for source in points.source[: points.notes[EXTRA]].tolist():
            if mujoco.mj_addContact(model, data, _BLANK if contacts is None else contacts[source]):
                break  # MuJoCo's memory is full; it has warned, and grows before the next step
            added += 1
        total = found.look()[0]
        if contacts is None:
            kernels().copy_contacts(found.words, found.search.contact // 4, total, added, points.source)
        kernels().write_points(found.contacts, total, added, points.extra)
        return True

    def forget(self) -> None:
        """Forget all points: in this step there are no contacts."""
        if self._bound is not None:
            self.points.notes[PAIRS] = 0
