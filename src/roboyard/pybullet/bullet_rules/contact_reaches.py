"""Gaps up to which Bullet keeps the points of a pair, and boxes across whose gaps it does not look.

A pair keeps the points whose gap is below 0.02 of the smaller shape's reach from its inertial frame: half the
diagonal of its box and the distance of the box's centre.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import pairwise
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Heightfield,
    Mesh,
    Pose,
    Sphere,
)
from roboyard.pybullet.bullet_rules.contact_order import visits_of
from roboyard.pybullet.bullet_rules.mesh_objects import split_geometry
from roboyard.pybullet.bullet_rules.shape_bounds import (
    TWO_SPHERES_MARGIN,
    LinkBounds,
    field_bounds,
    is_between_ends,
    local_bounds,
)
from roboyard.sim.physics_profile import BULLET
from roboyard.transforms import Array, inverse_pose, matrix_from_quaternion, pose_matrix

if TYPE_CHECKING:
    from roboyard.pybullet.bullet_rules.models import LinkModel

SHARE = 0.02
"""Bullet's contact threshold, as a share of a shape's reach."""
ENDLESS = 1e9
"""Half size (m) of the boxes of other shapes."""
NO_HULL = np.zeros((0, 3))
ENDLESS_BOX = np.concatenate([np.zeros((1, 3)), ENDLESS * np.eye(3)])
"""(4, 3) box of a shape that is not known."""
EVERYWHERE = 1e18
"""Half size (m) of Bullet's box around a plane."""
ENDLESS_COVER = np.concatenate([np.zeros((4, 3)), np.full((1, 3), EVERYWHERE)])
"""(5, 3) box around a plane, and around a link or shape that is not known."""


def contact_reaches(model: Any, bodies: Iterable[tuple[np.ndarray, Sequence[float]]]) -> np.ndarray:
    """Return the (ngeom,) largest gaps of contact points (m), infinite for planes.

    Args:
        model: MjModel.
        bodies: rows (n,) of each body's links among MuJoCo's bodies, and what `reaches_of` returns of them.
    """
    by_row = np.full(model.nbody, np.inf)
    for rows, reaches in bodies:
        by_row[rows] = reaches
    return by_row[model.geom_bodyid]


def reaches_of(bounds: Iterable[tuple[LinkBounds, float]]) -> list[float]:
    """Return the largest gap of contact points (m) of links with these bounds and margins (m)."""
    return [np.inf if box.kind == "plane" else _reach(box, margin) for box, margin in bounds]


@lru_cache(maxsize=512)
def _reach(box: LinkBounds, margin: float) -> float:
    """Return the largest gap of the points of a link with these bounds and this margin (m)."""
    (a, b, c), (x, y, z) = box.grown(margin).tolist()
    size = sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2)
    place = sqrt((x + a) ** 2 + (y + b) ** 2 + (z + c) ** 2)
    return SHARE * (size / 2 + place / 2)


@dataclass(frozen=True, slots=True, eq=False)
class ShapeBoxes:
    """Boxes around all shapes of one body."""

    boxes: np.ndarray
    """(n, 4, 3) middle and three half axes of each box in the frame of its link (m)."""
    parts: np.ndarray
    """(n, 5, 3) boxes around them as parts of compounds; see `ShapeForms`."""
    edges: np.ndarray
    """(n,) largest radius of the edges (m), 0 where a shape has none or its box is endless."""
    hulls: tuple[np.ndarray, ...]
    """Corners (m, 3) of each shape's hull in the frame of its link (m), none where it is no hull."""
    counts: tuple[int, ...]
    """Number of shapes of each link."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedShapes:
    """The shapes of one body, and where they are among MuJoCo's geoms."""

    geoms: list[int]
    rows: slice | np.ndarray
    """The geoms as places in arrays, a slice where one follows the other."""
    boxes: np.ndarray
    """(n, 4, 3) as in `ShapeBoxes`."""
    covers: np.ndarray
    """(k, 5, 3) boxes around the links; see `ShapeForms`."""
    parts: np.ndarray
    """(n, 5, 3) boxes around the shapes; see `ShapeForms`."""
    rounding: np.ndarray
    """(n,) radius of the edges (m)."""
    hulls: tuple[np.ndarray, ...]
    lengths: np.ndarray
    """(n,) numbers of corners of the hulls."""
    has_hulls: bool
    compound: np.ndarray
    """(n,) 1 for the parts of compounds, 2 for those of compounds within these, else 0."""
    visits: np.ndarray
    """(n,) as in `ShapeForms`."""

    def at(self, links: Sequence[Sequence[int]]) -> PlacedShapes:
        """Return the same shapes at other geoms, as many of each link."""
        geoms = [row for rows in links for row in rows]
        return PlacedShapes(
            geoms=geoms,
            rows=_places(geoms),
            boxes=self.boxes,
            covers=self.covers,
            parts=self.parts,
            rounding=self.rounding,
            hulls=self.hulls,
            lengths=self.lengths,
            has_hulls=self.has_hulls,
            compound=self.compound,
            visits=self.visits,
        )


def place_shapes(
    found: ShapeBoxes,
    links: Sequence[Sequence[int]],
    compound: np.ndarray,
    margins: Sequence[float],
    covers: Sequence[Array],
    models: Sequence[LinkModel],
) -> PlacedShapes:
    """Return the shapes of a body.

    Where a shape's place among the geoms is not known, or it is no box, ball or hull, its box is endless.

    Args:
        found: boxes around them.
        links: geoms of each link.
        compound: (n,) as in `PlacedShapes`, for the geoms of all links.
        margins: of the shapes of each link (m), with which edges of boxes and cylinders are round.
        covers: (5, 3) box around each link; see `cover_of`.
        models: the links.
    """
    if tuple(map(len, links)) != found.counts:
        found = _without_unknown(found, links)
    widths = np.repeat(np.asarray(margins, float), [len(rows) for rows in links])
    geoms = [row for rows in links for row in rows]
    around = np.reshape(covers, (-1, 5, 3))
    of_links = around.repeat([len(rows) for rows in links], axis=0)
    return PlacedShapes(
        geoms=geoms,
        rows=_places(geoms),
        boxes=found.boxes,
        covers=around,
        parts=np.where(compound[:, None, None] > 0, found.parts, of_links),
        rounding=np.where(widths < found.edges, widths, 0.0),
        hulls=found.hulls,
        lengths=np.array([len(hull) for hull in found.hulls], np.int32),
        has_hulls=any(map(len, found.hulls)),
        compound=compound,
        visits=_visits(found, links, models),
    )


def _visits(found: ShapeBoxes, links: Sequence[Sequence[int]], models: Sequence[LinkModel]) -> np.ndarray:
    """Return the order in which the parts of each link are visited; see `ShapeForms`."""
    order, first = list[int](), 0
    for rows, link in zip(links, models, strict=True):
        count = len(rows)
        if count < 2:
            order += [0] * count
        else:
            sizes = [1 if shape.concave else len(split_geometry(shape.geometry)) for shape in link.collisions]
            order += visits_of(found.parts[first : first + count], sizes, link.frame)
        first += count
    return np.array(order, np.int32)


_PLAIN = frozenset(("solid", "sphere", "cylinder"))
"""Kinds of bounds around one shape at the inertial frame whose box is known by its half sizes."""
_ONE_LENGTH, _NO_COMPOUND, _FIRST_VISIT = np.zeros(1, np.int32), np.zeros(1, np.uint8), np.zeros(1, np.int32)
_AT_LINK = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


def plain_shape(
    links: Sequence[LinkModel], bounds: LinkBounds, margin: float, rows: Sequence[Sequence[int]]
) -> PlacedShapes | None:
    """Return the only shape of a body of one link as `place_shapes` does, from its half sizes.

    None where the body has more links or shapes, or where these or the centre of mass are not at the link's
    frame. The cover of such a body is also the box in which Bullet adds it.

    Args:
        links: of the body.
        bounds: of its base.
        margin: of the shape (m).
        rows: geoms of each link.
    """
    if len(links) > 1 or len(rows[0]) != 1 or bounds.kind not in _PLAIN:
        return None
    frame, (shape, *others) = links[0].frame, links[0].collisions
    if others or shape.concave or not isinstance(shape.geometry, Box | Sphere | Cylinder | Capsule):
        return None
    if (frame.position, frame.quaternion) != _AT_LINK:
        return None
    half = bounds.corners[1]
    x, y, z = half.tolist()
    if not max(x, y, z) < ENDLESS:
        return None
    box, cover = np.zeros((1, 4, 3)), np.zeros((1, 5, 3))
    box[0, 1, 0], box[0, 2, 1], box[0, 3, 2] = x, y, z
    if bounds.kind == "sphere":
        cover[0, 4] = half
    else:
        cover[0, :4] = box[0]
    edge, row = min(x, y, z) if isinstance(shape.geometry, Box | Cylinder) else 0.0, rows[0][0]
    return PlacedShapes(
        geoms=[row],
        rows=slice(row, row + 1),
        boxes=box,
        covers=cover,
        parts=cover,
        rounding=np.array([margin if margin < edge else 0.0]),
        hulls=(NO_HULL,),
        lengths=_ONE_LENGTH,
        has_hulls=False,
        compound=_NO_COMPOUND,
        visits=_FIRST_VISIT,
    )


def cover_of(bounds: LinkBounds, margin: float, frame: Pose) -> Array:
    """Return the (5, 3) box around all shapes of a link, as `ShapeForms` has it.

    Args:
        bounds: of the link.
        margin: of its shape, or its compound (m).
        frame: inertial frame in the link frame.
    """
    lower, upper = bounds.grown(margin)
    if bounds.kind == "plane" or not np.all(np.abs([lower, upper]) < ENDLESS):
        return ENDLESS_COVER
    turn, cover = matrix_from_quaternion(frame.quaternion), np.zeros((5, 3))
    cover[0] = np.asarray(frame.position) + turn @ (lower + upper) / 2
    half = (upper - lower) / 2
    if bounds.kind == "sphere":
        cover[4] = half
    else:
        cover[1:4] = half[:, None] * turn.T
    return cover


def first_boxes(covers: np.ndarray, links: Sequence[LinkModel], *, at_inertial: bool, is_mjcf: bool) -> Array:
    """Return (n, 5, 3) boxes in the base's frame (m) in which Bullet adds links, joints at 0.

    Args:
        covers: (n, 5, 3) as in `PlacedShapes`.
        links: as for `first_frames`, with the other options.
    """
    frames = first_frames(links, at_inertial=at_inertial, is_mjcf=is_mjcf)
    found = covers.copy()
    found[:, :4] = np.einsum("nij,nkj->nki", frames[:, :3, :3], covers[:, :4])
    found[:, 0] += frames[:, :3, 3]
    return found


def first_frames(links: Sequence[LinkModel], *, at_inertial: bool, is_mjcf: bool) -> Array:
    """Return the (n, 4, 4) poses in the base's frame at which Bullet adds links to the world, joints at 0.

    It places the shapes of a link relative to its inertial frame, but adds them as if they were relative to
    its link frame, until the first step. Those of MJCF files are added with the base's link frame at its
    inertial frame, and from the first joint that moves on without a rotation: its matrix is 0.

    Args:
        links: base, then links in order.
        at_inertial: whether shapes are where they are from the first step on.
        is_mjcf: whether they are of an MJCF file.

    Source:
        Bullet, URDF2Bullet.cpp, ConvertURDF2BulletInternal, and BulletMJCFImporter.cpp, parseBody.
    """
    frames = np.empty((len(links), 4, 4))
    found = np.empty((len(links), 4, 4))
    for index, link in enumerate(links):
        own = pose_matrix(link.frame.position, link.frame.quaternion)
        if link.joint is None:
            frames[index] = own if is_mjcf else np.eye(4)
        else:
            origin = link.joint.origin
            frames[index] = frames[link.parent + 1]
            if link.joint.type == "fixed" or not is_mjcf:
                frames[index] = frames[index] @ pose_matrix(origin.position, origin.quaternion)
            else:
                frames[index, :3, :3] = 0.0
        found[index] = frames[index] if at_inertial else frames[index] @ inverse_pose(own)
    return found


def _places(geoms: Sequence[int]) -> slice | np.ndarray:
    if geoms and all(b - a == 1 for a, b in pairwise(geoms)):
        return slice(geoms[0], geoms[-1] + 1)
    return np.array(geoms, np.intp)


def body_boxes(
    links: Iterable[Sequence[Collision]], *, implicit_cylinder: bool, two_spheres: bool
) -> ShapeBoxes:
    """Return the boxes of a body.

    Args:
        links: the shapes of each link.
        implicit_cylinder: whether cylinders are exact.
        two_spheres: whether capsules between two points are the hull of two spheres.
    """
    boxes, parts, edges, counts, hulls = [], [], [], [], []
    for shapes in links:
        counts.append(len(shapes))
        for shape in shapes:
            box, edge = _box_of(shape, implicit_cylinder)
            boxes.append(box)
            parts.append(_part_of(shape, box, two_spheres))
            edges.append(edge)
            hulls.append(_hull_of(shape))
    return ShapeBoxes(
        np.array(boxes).reshape(-1, 4, 3),
        np.array(parts).reshape(-1, 5, 3),
        np.array(edges),
        tuple(hulls),
        tuple(counts),
    )


def _part_of(shape: Collision, box: np.ndarray, two_spheres: bool) -> np.ndarray:
    """Return the (5, 3) box around a shape as the part of a compound; box: (4, 3) the usual one."""
    part = np.zeros((5, 3))
    match shape.geometry:
        case Sphere(radius=radius) if not shape.concave:
            part[0], part[4] = box[0], radius
        case Capsule(radius=radius, length=length) if two_spheres and is_between_ends(shape):
            along = matrix_from_quaternion(shape.origin.quaternion)[:, 2]
            part[0] = box[0]
            part[1:4] = np.diag(np.abs(along) * length / 2 + radius + TWO_SPHERES_MARGIN)
        case _:
            part[:4] = box
    return part


def _without_unknown(found: ShapeBoxes, links: Sequence[Sequence[int]]) -> ShapeBoxes:
    """Return endless boxes for the geoms of links that have more or fewer geoms than shapes."""
    boxes, parts, edges = [np.zeros((0, 4, 3))], [np.zeros((0, 5, 3))], [np.zeros(0)]
    hulls, first = list[np.ndarray](), 0
    for rows, count in zip(links, found.counts, strict=True):
        place = slice(first, first + count)
        first += count
        is_known = len(rows) == count
        boxes.append(
            found.boxes[place] if is_known else np.array([ENDLESS_BOX] * len(rows)).reshape(-1, 4, 3)
        )
        parts.append(found.parts[place] if is_known else np.tile(ENDLESS_COVER, (len(rows), 1, 1)))
        edges.append(found.edges[place] if is_known else np.zeros(len(rows)))
        hulls += found.hulls[place] if is_known else [NO_HULL] * len(rows)
    joined = [np.concatenate(found) for found in (boxes, parts, edges)]
    return ShapeBoxes(joined[0], joined[1], joined[2], tuple(hulls), tuple(map(len, links)))


def _hull_of(shape: Collision) -> np.ndarray:
    """Return the (n, 3) corners of a shape's hull in the frame of its link (m), none where it is no hull."""
    from roboyard.sim.build.geoms import is_single, load_scaled
    from roboyard.sim.build.mesh_assets import convex_hull

    if shape.concave or not isinstance(shape.geometry, Mesh):
        return NO_HULL
    mesh = load_scaled(shape.geometry, 1.0)
    if mesh is None or not len(mesh.faces):
        return NO_HULL
    corners = convex_hull(mesh, BULLET.hull_steps, single=is_single(shape.geometry, 1.0))[0]
    turn = matrix_from_quaternion(shape.origin.quaternion)
    return corners @ turn.T + np.asarray(shape.origin.position)


def _box_of(shape: Collision, implicit_cylinder: bool) -> tuple[np.ndarray, float]:
    """Return the (4, 3) box around a shape and the largest radius of its edges (m), 0 where it has none."""
    if isinstance(shape.geometry, Box | Cylinder | Sphere) and not shape.concave:
        return _plain_box(shape.geometry, shape.origin, implicit_cylinder)
    return _new_box(shape, implicit_cylinder)


@lru_cache(maxsize=512)
def _plain_box(geometry: Geometry, origin: Pose, implicit_cylinder: bool) -> tuple[np.ndarray, float]:
    box, edge = _new_box(Collision(geometry=geometry, origin=origin), implicit_cylinder)
    box.flags.writeable = False
    return box, edge


def _new_box(shape: Collision, implicit_cylinder: bool) -> tuple[np.ndarray, float]:
    """Return the (4, 3) box around a shape and the largest radius of its edges (m), 0 where it has none."""
    if shape.concave or isinstance(shape.geometry, Heightfield):
        corners = field_bounds(shape)
    else:
        corners = local_bounds(shape.geometry, implicit_cylinder=implicit_cylinder)
    if corners is None:
        return ENDLESS_BOX, 0.0
    turn, box = matrix_from_quaternion(shape.origin.quaternion), np.empty((4, 3))
    box[0] = np.asarray(shape.origin.position) + turn @ (corners[0] + corners[1]) / 2
    box[1:] = ((corners[1] - corners[0]) / 2)[:, None] * turn.T
    has_edges = isinstance(shape.geometry, Box | Cylinder)
    return box, float((corners[1] - corners[0]).min() / 2) if has_edges else 0.0
