"""The shapes of all bodies of one client as Bullet has them, and queries of shapes that belong to none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.bullet_rules.placed_shapes.shape_rows import ShapeRows
from roboyard.pybullet.state.pair_filters import PairFilters
from roboyard.sim.world import World

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.placed_shapes.shape_rows import Numbers
    from roboyard.pybullet.bullet_rules.ray_starts import MarginShapes
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.pybullet.state.query_shapes import QueryShapes
    from roboyard.sim.stepping.shape_forms import ShapeForms


class SceneShapes:
    """Margins, boxes and owners of shapes, by MuJoCo's geoms."""

    def __init__(self, world: World, records: Mapping[int, BodyRecord], filters: PairFilters) -> None:
        """Let the steps of a World know them.

        Args:
            world: the World.
            records: of all bodies, by their ids in the World.
            filters: which shapes collide.
        """
        self._world, self._records, self._filters = world, records, filters
        self.rows = ShapeRows()
        """Margins, reaches and forms of shapes."""
        self._query_shapes: QueryShapes | None = None
        self._places: tuple[int, dict[int, tuple[int, int, float]]] = (-1, {})
        """Revision of the World, and MuJoCo geom to body, link and margin (m) of shapes that were hit."""
        self._margin_shapes: MarginShapes | None = None
        surfaces = world.surfaces
        surfaces.margins_of, surfaces.reaches_of = self.geom_margins, self.contact_reaches
        surfaces.forms_of = self.shape_forms
        world.stepping.manifolds.first_boxes = self.first_boxes

    def geom_margins(self) -> Any:
        """Return the (ngeom,) margins by which Bullet's shapes are larger than MuJoCo's (m)."""
        return self._shape_numbers()[0]

    def contact_reaches(self) -> Any:
        """Return the (ngeom,) gaps (m) up to which Bullet keeps the points of contacts."""
        return self._shape_numbers()[1]

    def shape_forms(self) -> ShapeForms:
        """Return boxes around shapes, whether these are parts of compounds, their edges and hulls."""
        return self._shape_numbers()[2]

    def first_boxes(self, bodies: Sequence[int]) -> tuple[list[int], Any, Any]:
        """Return the boxes in which links of bodies, by their ids in the World, were made.

        Returns:
            The bodies whose first poses are known, those of plain shapes last; (n, 5, 3) boxes around all
            their links in the bases' frames (m), and the (n, 7) first pose of the base for each link.
        """
        covers, places = self.shape_forms().covers, self.rows.plain
        others, plain, rows = list[int](), list[int](), list[int]()
        boxes, poses, first_poses = list[Any](), list[Any](), list[Any]()
        for body in bodies:
            record = self._records.get(body)
            if record is None or record.first_pose is None:
                continue
            place = places.get(body)
            if place is not None:
                plain.append(body)
                rows.append(place.body)
                first_poses.append(record.first_pose)
                continue
            found = record.shapes.first_boxes(self._world.live_model)
            others.append(body)
            boxes.append(found)
            poses.append(np.tile(record.first_pose, (len(found), 1)))
        if not others and not plain:
            return [], None, None
        if not others:
            return plain, covers[rows], np.array(first_poses)
        if plain:
            boxes.append(covers[rows])
            poses.append(first_poses)
        return [*others, *plain], np.concatenate(boxes), np.concatenate(poses)

    def _shape_numbers(self) -> Numbers:
        """Return margins, reaches and forms of all shapes."""
        return self.rows.numbers(self._world, self._records)

    def place_of(self, geom: int) -> tuple[int, int, float]:
        """Return body, link and Bullet's margin (m) of a MuJoCo geom."""
        revision, places = self._places
        if revision != self._world.revision:
            self._places = self._world.revision, (places := {})
        if geom not in places:
            body, link = self._world.geom_owners[geom].tolist()
            places[geom] = self._records[body].number, link - 1, float(self.geom_margins()[geom])
        return places[geom]

    @property
    def margin_shapes(self) -> MarginShapes:
        """The shapes whose margins rays may start in."""
        if self._margin_shapes is None:
            from roboyard.pybullet.bullet_rules.ray_starts import MarginShapes

            self._margin_shapes = MarginShapes(
                self._world, self.geom_margins, self.shown_geoms, self._filters
            )
        return self._margin_shapes

    def shown_geoms(self, geoms: Any, mask: int) -> Any:
        """Return those of some MuJoCo geoms (k,) whose groups share a bit with a mask."""
        if not len(geoms) or self._filters.shows_all(mask):
            return geoms
        return geoms[[self._filters.shows(*self.place_of(geom)[:2], mask) for geom in geoms.tolist()]]

    # -------------------------------------------------------------------------------------------------- time

    @property
    def query_shapes(self) -> QueryShapes:
        """World for distance queries of shapes that belong to no body, created on first use."""
        if self._query_shapes is None:
            from roboyard.pybullet.state.query_shapes import QueryShapes

            self._query_shapes = QueryShapes()
        return self._query_shapes

    def release(self) -> None:
        """Free what belongs to no body."""
        if self._query_shapes is not None:
            self._query_shapes.release()
