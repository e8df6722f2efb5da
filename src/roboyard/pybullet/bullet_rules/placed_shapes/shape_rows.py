"""Margins, reaches and forms of the shapes of all bodies, of which each has its rows.

A body that takes rows of MuJoCo's arrays, or leaves them, changes its own rows only; all are gathered again
where the arrays are new.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.pybullet.bullet_rules.contact_reaches import contact_reaches
from roboyard.pybullet.bullet_rules.hull_margins import geom_margins, margins_of_rows, special_margins
from roboyard.pybullet.bullet_rules.placed_shapes.boxes import ENDLESS_BOX, ENDLESS_COVER, NO_HULL
from roboyard.pybullet.bullet_rules.placed_shapes.placing import PlacedShapes
from roboyard.pybullet.bullet_rules.placed_shapes.plain_shapes import PlainShape, boxes_of, write_box
from roboyard.sim.stepping.shape_forms import ShapeForms

if TYPE_CHECKING:
    from roboyard.sim.world import World

_SHAPES, _SHAPE_SETS = "shapes of bodies", 4
"""Name in `Engine.of_arrays`, and number of sets of bodies whose shapes are kept."""

Numbers = tuple[np.ndarray, np.ndarray, ShapeForms]
Hulls = dict[int, tuple[int, np.ndarray]]
"""First corner of each hull among those of all, and the hull, by its id; shapes have them in common."""


class PlainPlace(NamedTuple):
    """A body of one plain shape, and where it is in MuJoCo's arrays."""

    shape: PlainShape
    margin: float
    """Of the shape (m)."""
    geom: int
    body: int


class ShapeRows:
    """The numbers of all shapes of one world."""

    def __init__(self) -> None:
        self._revision = -1
        """Revision of the World that they are of."""
        self._model: Any = None
        self._numbers: Any = None
        self._key: Any = None
        """Key of the numbers among those that are kept; None where rows were written since."""
        self._placed: dict[int, Any] = {}
        """The records whose rows are written, by their ids in the World."""
        self._is_complete = True
        """Whether other bodies have the shapes that were written."""
        self._hulls: Hulls = {}
        self.plain: dict[int, PlainPlace] = {}
        """Places of bodies of one plain shape, by their ids in the World, once `numbers` was called."""

    def gather_again(self) -> None:
        """Gather the rows of all bodies when one comes or goes next: those of another one have changed."""
        self._is_complete = False

    def numbers(self, world: World, records: Mapping[int, Any]) -> Numbers:
        """Return margins (ngeom,), reaches (ngeom,) (m) and forms of all shapes.

        Args:
            world: the World.
            records: the records of all bodies by their ids in the World, in order.
        """
        if self._revision == world.revision and not world.is_stale:
            found: Numbers = self._numbers
            return found
        world.ensure_compiled()
        model = world.live_model
        if self._model is not model or not self._is_complete or not self._update(world, model, records):
            self._gather(world, model, records)
            self._placed, self._model, self._is_complete = dict(records), model, True
        self._revision = world.revision
        found = self._numbers
        return found

    def _gather(self, world: World, model: Any, records: Mapping[int, Any]) -> None:
        """Look up the rows of all bodies; the last few sets of bodies are kept, some of which come again."""
        plain, others = dict[int, PlainPlace](), list[Any]()
        for key_of_body, record in records.items():
            place = _plain_place(record)
            if place is None:
                others.append(record)
            else:
                plain[key_of_body] = place
        self.plain = plain
        places = [place.geom for place in plain.values()], [place.body for place in plain.values()]
        key = *map(tuple, places), *(record.shapes.key() for record in others)
        kept = world.of_arrays.setdefault(_SHAPES, {})
        found = kept.get(key)
        if found is None:
            cylinders, triangles = list[int](), list[int]()
            placed = list[tuple[PlacedShapes, np.ndarray]]()
            for record in others:
                rows = record.body.mujoco_ids
                concave, has_cylinders = record.model.once("margins", special_margins)
                if has_cylinders:
                    cylinders += rows.tolist()
                triangles += [int(rows[index]) for index in concave]
                placed.append((record.shapes.forms(model), rows))
            reaches = [(record.body.mujoco_ids, record.shapes.reaches()) for record in others]
            forms, hulls = shape_forms(model, placed)
            numbers = geom_margins(model, cylinders, triangles), contact_reaches(model, reaches), forms
            # with what the key has the ids of
            found = kept[key] = numbers, hulls, [record.model.shared for record in others]
            while len(kept) > _SHAPE_SETS:
                del kept[next(iter(kept))]
        self._numbers, self._hulls, self._key = found[0], found[1], key
        if plain:  # sizes may be others each time
            self._write_plain(list(plain.values()), *places)

    def _update(self, world: World, model: Any, records: Mapping[int, Any]) -> bool:
        """Write the rows of bodies that came or went; return whether all were, which new hulls prevent."""
        placed = self._placed
        gone = [
            (key, record, self.plain.pop(key, None)) for key, record in placed.items() if key not in records
        ]
        come = [(key, record, _plain_place(record)) for key, record in records.items() if key not in placed]
        forms = [None if place is not None else record.shapes.forms(model) for _, record, place in come]
        hulls = self._hulls
        if any(form is not None and _has_new(form, hulls) for form in forms):
            return False
        if self._key is not None:  # no longer the numbers of that set of bodies
            world.of_arrays.get(_SHAPES, {}).pop(self._key, None)
            self._key = None
        for key, record, place in gone:
            if place is not None:
                self._forget(place.geom, place.body, 0.0)
            else:
                form = record.shapes.forms(model)
                margins = margins_of_rows(model, form.geoms, has_cylinders=False)
                self._forget(form.rows, record.body.mujoco_ids, margins)
            del placed[key]
        for (key, record, place), form in zip(come, forms, strict=True):
            if place is not None:
                self._write_one(place)
                self.plain[key] = place
            elif form is not None:
                self._write(model, record, form)
            placed[key] = record
        return True

    def _forget(self, geoms: Any, bodies: Any, margins: Any) -> None:
        """Write the rows of shapes of no body.

        Args:
            geoms: places of the shapes.
            bodies: rows of their links among MuJoCo's bodies.
            margins: of the shapes (m).
        """
        of_geoms, reaches, shapes = self._numbers
        of_geoms[geoms], reaches[geoms] = margins, np.inf
        shapes.boxes[geoms], shapes.parts[geoms] = ENDLESS_BOX, ENDLESS_COVER
        shapes.covers[bodies] = ENDLESS_COVER
        shapes.rounding[geoms] = shapes.compound[geoms] = shapes.visits[geoms] = shapes.spans[geoms] = 0

    def _write_plain(self, places: Sequence[PlainPlace], geoms: Any, bodies: Any) -> None:
        """Write the rows of bodies of one plain shape, whose other numbers are 0.

        Args:
            places: of the bodies.
            geoms: places of their shapes.
            bodies: rows of their links among MuJoCo's bodies.
        """
        _, reaches, shapes = self._numbers
        shapes.boxes[geoms], covers = boxes_of([place.shape for place in places])
        shapes.parts[geoms] = shapes.covers[bodies] = covers
        reaches[geoms] = [place.shape.reach for place in places]
        shapes.rounding[geoms] = [place.shape.rounding(place.margin) for place in places]

    def _write_one(self, place: PlainPlace) -> None:
        """Write the rows of a body of one plain shape, which were those of no body."""
        margins, reaches, shapes = self._numbers
        geom, shape = place.geom, place.shape
        write_box(shape, shapes.boxes[geom], shapes.parts[geom])
        shapes.covers[place.body] = shapes.parts[geom]
        margins[geom], reaches[geom], shapes.rounding[geom] = 0.0, shape.reach, shape.rounding(place.margin)
        shapes.compound[geom] = shapes.visits[geom] = shapes.spans[geom] = 0

    def _write(self, model: Any, record: Any, form: PlacedShapes) -> None:
        """Write the rows of a body, whose shapes are given."""
        margins, reaches, shapes = self._numbers
        rows, hulls = form.rows, self._hulls
        has_cylinders = record.model.once("margins", special_margins)[1]
        margins[rows] = margins_of_rows(model, form.geoms, has_cylinders=has_cylinders)
        reaches[rows] = _of_geoms(record.shapes.reaches(), record.body.geom_rows)
        shapes.boxes[rows], shapes.parts[rows] = form.boxes, form.parts
        shapes.covers[record.body.mujoco_ids] = form.covers
        shapes.rounding[rows], shapes.compound[rows] = form.rounding, form.compound
        shapes.visits[rows] = form.visits
        shapes.spans[rows] = 0
        if form.has_hulls:
            shapes.spans[form.geoms] = [_span(hull, hulls) for hull in form.hulls]


def _plain_place(record: Any) -> PlainPlace | None:
    """Return where a body of one plain shape is; None for any other."""
    shape, geoms = record.shapes.plain(), record.body.geom_rows
    if shape is None or len(geoms[0]) != 1:
        return None
    return PlainPlace(shape, record.shapes.bounds(-1)[1], geoms[0][0], int(record.body.mujoco_ids[0]))


def _has_new(form: PlacedShapes, hulls: Hulls) -> bool:
    """Return whether any hull of a body is not among these."""
    return any(len(hull) and id(hull) not in hulls for hull in form.hulls)


def shape_forms(model: Any, bodies: Sequence[tuple[PlacedShapes, np.ndarray]]) -> tuple[ShapeForms, Hulls]:
    """Return the shapes of all geoms of an MjModel, and the hulls among them.

    Args:
        model: the MjModel.
        bodies: the shapes of each, and the (k,) rows of its links among MuJoCo's bodies.
    """
    geoms = model.ngeom
    boxes, compound = np.empty((geoms, 4, 3)), np.zeros(geoms, np.uint8)
    boxes[:] = ENDLESS_BOX
    covers, parts = np.empty((model.nbody, 5, 3)), np.empty((geoms, 5, 3))
    covers[:] = parts[:] = ENDLESS_COVER
    rounding, spans = np.zeros(geoms), np.zeros((geoms, 2), np.int32)
    visits = np.zeros((geoms, 2), np.int32)
    hulls: Hulls = {}
    if bodies:
        places = np.array([geom for body, _ in bodies for geom in body.geoms], np.intp)
        boxes[places] = np.concatenate([body.boxes for body, _ in bodies])
        parts[places] = np.concatenate([body.parts for body, _ in bodies])
        covers[np.concatenate([rows for _, rows in bodies])] = np.concatenate([b.covers for b, _ in bodies])
        rounding[places] = np.concatenate([body.rounding for body, _ in bodies])
        count = 0
        for body, _ in bodies:
            if body.has_hulls:
                for hull in body.hulls:
                    if len(hull) and id(hull) not in hulls:
                        hulls[id(hull)] = count, hull
                        count += len(hull)
                spans[body.geoms] = [_span(hull, hulls) for hull in body.hulls]
        compound[places] = np.concatenate([body.compound for body, _ in bodies])
        visits[places] = np.concatenate([body.visits for body, _ in bodies])
    forms = ShapeForms(
        boxes=boxes,
        covers=covers,
        parts=parts,
        compound=compound,
        visits=visits,
        rounding=rounding,
        hulls=np.concatenate([NO_HULL, *(hull for _, hull in hulls.values())]),
        spans=spans,
    )
    return forms, hulls


def _span(hull: np.ndarray, hulls: Hulls) -> tuple[int, int]:
    """Return first corner and number of corners of a shape's hull, which may have none."""
    return (hulls[id(hull)][0], len(hull)) if len(hull) else (0, 0)


def _of_geoms(values: Sequence[float], geoms: Sequence[Sequence[int]]) -> list[float]:
    """Return the value of its link for each geom."""
    return [value for value, rows in zip(values, geoms, strict=True) for _ in rows]
