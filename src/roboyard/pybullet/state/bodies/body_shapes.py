"""The shapes of one body as Bullet has them: their bounds, margins, kinds and boxes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from roboyard.description.model import Box, Capsule, Plane, Pose, Sphere
from roboyard.pybullet.bullet_rules.contact_order import COMPOUND, CONVEX, is_field, kinds_of
from roboyard.pybullet.bullet_rules.models import BodyModel
from roboyard.pybullet.bullet_rules.shape_bounds import MARGIN
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.placed_shapes.boxes import ShapeBoxes
    from roboyard.pybullet.bullet_rules.placed_shapes.placing import PlacedShapes
    from roboyard.pybullet.bullet_rules.placed_shapes.plain_shapes import PlainShape
    from roboyard.pybullet.bullet_rules.shape_bounds import LinkBounds
    from roboyard.sim.body import Body

_FEW = 4
"""Most shapes of a body that is compared with others by its numbers."""


class LinkSettings(Protocol):
    """Settings of a link that its shapes depend on, which scripts change."""

    frame: Pose
    """Inertial frame in the link frame."""
    collision_margin: float | None
    """Margin of its shapes (m); None for that of the file."""


class BodyShapes:
    """The shapes of one body. Link indices are those of scripts: -1 for the base, then the joint index."""

    def __init__(
        self, model: BodyModel, links: Sequence[LinkSettings], body: Body, *, at_inertial: bool
    ) -> None:
        """Describe the shapes of a body.

        Args:
            model: masses, links and joints as Bullet has them.
            links: settings of the base and of each link, as they are now.
            body: body in the World.
            at_inertial: whether links are added to Bullet's world with their shapes where they stay.
        """
        self.model = model
        self.body = body
        self.is_mjcf = False
        """Whether they were loaded from an MJCF file."""
        self._links = links
        self._at_inertial = at_inertial
        self._bounds: dict[int, LinkBounds] = model.once("bounds", _nothing)
        self._forms: tuple[Any, list[float | None], Any] = (None, [], None)

    @property
    def has_plane(self) -> bool:
        """Whether one of the base is an infinite plane, which cannot move."""
        return any(isinstance(shape.geometry, Plane) for shape in self.model.description.links[0].collisions)

    def bounds(self, link: int) -> tuple[LinkBounds, float]:
        """Return the box of a link's shapes and its current margin (m)."""
        found = self._bounds.get(link)
        if found is None:
            model = self.model.links[link + 1]
            found = self._bounds[link] = self.model.bounds_of(self._links[link + 1].frame, model.collisions)
        changed = self._links[link + 1].collision_margin
        return found, found.margin if changed is None or found.is_round else changed

    @property
    def boxes(self) -> ShapeBoxes:
        """The boxes around the shapes of all links, as files had them when the body was made."""
        found: ShapeBoxes = self.model.once("boxes", _boxes_of)
        return found

    def key(self) -> tuple[Any, ...]:
        """Return a key of the shapes and their places, valid while `BodyModel.shared` is held."""
        return self.model.once("key", _key_of), self.body.mujoco_ids.tobytes(), tuple(self._margins())

    def forms(self, model: Any) -> PlacedShapes:
        """Return all shapes and their geoms.

        Args:
            model: MjModel that the geoms are of; the result is kept as long as it is the same.
        """
        margins, rows = self._margins(), self.body.geom_rows
        if self._forms[0] is not model or self._forms[1] != margins:
            key = *margins, *map(len, rows)
            known: dict[Any, PlacedShapes] = self.model.once("forms", _nothing)
            placed = known.get(key)
            if placed is None:
                placed = known[key] = self._place(rows)
            else:
                placed = placed.at(rows)
            self._forms = model, margins, placed
        return self._forms[2]

    def first_boxes(self, model: Any) -> Array:
        """Return (n, 5, 3) boxes around the links in the base's frame (m), in which Bullet adds them.

        Args:
            model: MjModel of the World.
        """
        key = self._at_inertial, self.is_mjcf, tuple(self._margins())
        known: dict[Any, Array] = self.model.once("first boxes", _nothing)
        if key not in known:
            from roboyard.pybullet.bullet_rules.placed_shapes.first_boxes import first_boxes

            covers, links = self.forms(model).covers, self.model.links
            is_at_link = len(links) == 1 and links[0].frame.is_identity
            known[key] = (
                covers
                if is_at_link
                else first_boxes(covers, links, at_inertial=self._at_inertial, is_mjcf=self.is_mjcf)
            )
        return known[key]

    def plain(self) -> PlainShape | None:
        """Return the only shape of a body of one link, where its numbers follow from half sizes."""
        shared = self.model.shared
        if "plain" not in shared:
            from roboyard.pybullet.bullet_rules.placed_shapes.plain_shapes import plain_shape

            is_one = len(self._links) == 1
            shared["plain"] = plain_shape(self.model.links, self.bounds(-1)[0]) if is_one else None
        found: PlainShape | None = shared["plain"]
        return found

    def _place(self, rows: Sequence[Sequence[int]]) -> PlacedShapes:
        from roboyard.pybullet.bullet_rules.placed_shapes.boxes import cover_of
        from roboyard.pybullet.bullet_rules.placed_shapes.placing import place_plain, place_shapes

        bounds, plain = [self.bounds(link - 1) for link in range(len(self._links))], self.plain()
        if plain is not None and len(rows[0]) == 1:
            return place_plain(plain, bounds[0][1], rows[0][0])
        links = self.model.links
        widths = [MARGIN if box.kind == "compound" else margin for box, margin in bounds]
        compound = [
            max(kind - CONVEX, int(box.kind == "compound" and not is_field(link.collisions)))
            for link, own, (box, _) in zip(links, self.kinds(rows), bounds, strict=True)
            for kind in own
        ]
        covers = [
            cover_of(box, margin, link.frame) for (box, margin), link in zip(bounds, links, strict=True)
        ]
        return place_shapes(self.boxes, rows, np.array(compound, np.uint8), widths, covers, links)

    def contact_kind(self, link: int) -> int:
        """Return the kind of a link, that of its shapes which comes first; see `kinds_of`."""
        return max(self.model.once("kinds", _kinds_of)[link + 1], default=COMPOUND)

    def kinds(self, rows: Sequence[Sequence[int]]) -> list[list[int]]:
        """Return the kinds of the geoms of each link; see `kinds_of`.

        Args:
            rows: the geoms of each link.
        """
        found = []
        for link, own in zip(self.model.once("kinds", _kinds_of), rows, strict=True):
            found.append(link if len(link) == len(own) else [max(link, default=COMPOUND)] * len(own))
        return found

    def reaches(self) -> list[float]:
        """Return the largest gap of contact points of each link (m)."""
        known, key = self.model.once("reaches", _nothing), tuple(self._margins())
        if key not in known:
            from roboyard.pybullet.bullet_rules.contact_reaches import reaches_of

            known[key] = reaches_of(self.bounds(link - 1) for link in range(len(self._links)))
        found: list[float] = known[key]
        return found

    def _margins(self) -> list[float | None]:
        return [link.collision_margin for link in self._links]


def _nothing(_: BodyModel) -> dict[Any, Any]:
    return {}


def _key_of(model: BodyModel) -> Any:
    """Return a key of the shapes of a body: its numbers for one of few primitives, else one of its own.

    Programs create such bodies again and again, while those of files have their models in common.
    """
    link, rule = model.links[0], model.bounds_of
    if (
        len(model.links) > 1
        or len(link.collisions) > _FEW
        or not isinstance(rule, partial)
        or not all(isinstance(shape.geometry, Box | Sphere | Capsule) for shape in link.collisions)
    ):
        return id(model.shared)
    shapes = tuple((shape.geometry, shape.origin, shape.concave) for shape in link.collisions)
    return link.frame, shapes, model.implicit_cylinder, rule.func, tuple(sorted(rule.keywords.items()))


def _kinds_of(model: BodyModel) -> list[list[int]]:
    return [kinds_of(link, from_file=model.nests_meshes) for link in model.links]


def _boxes_of(model: BodyModel) -> ShapeBoxes:
    from roboyard.pybullet.bullet_rules.placed_shapes.boxes import body_boxes

    links = model.description.links
    options = {"implicit_cylinder": model.implicit_cylinder, "two_spheres": model.has_two_spheres}
    return body_boxes((link.collisions for link in links), **options)
