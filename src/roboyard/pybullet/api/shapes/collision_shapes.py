"""createCollisionShape: shapes to be used by createMultiBody."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Heightfield,
    Mesh,
    Plane,
    Pose,
    Sphere,
)
from roboyard.pybullet.api.shapes.terrain import FAILED, heightfield, points_of, replace_heights
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import number, quaternion, text, vector3, whole
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.transforms import Array, multiply

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

Vector = Sequence[float]
_IDENTITY = (0.0, 0.0, 0.0, 1.0)
_NOWHERE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class ShapeSet:
    """What one shape id stands for: one shape, or several from an array call."""

    shapes: tuple[Collision, ...]
    middle: float = 0.0
    """Of a heightfield: the height, as given, that lies at its origin; m"""
    rise: float = 1.0
    """Of a heightfield: the factor of the heights as given."""


@command()
def createCollisionShape(
    client: Client,
    shapeType: int,
    radius: float = 0.5,
    halfExtents: Vector | None = None,
    height: float = 1.0,
    fileName: str = "",
    meshScale: Vector = (1.0, 1.0, 1.0),
    planeNormal: Vector = (0.0, 0.0, 1.0),
    flags: int = 0,
    collisionFramePosition: Vector = _NOWHERE,
    collisionFrameOrientation: Vector = _IDENTITY,
    vertices: Sequence[Vector] | None = None,
    indices: Sequence[int] | None = None,
    heightfieldTextureScaling: float = 1.0,
    heightfieldData: Sequence[float] | None = None,
    numHeightfieldRows: int = -1,
    numHeightfieldColumns: int = -1,
    replaceHeightfieldIndex: int = -1,
) -> int:
    """Make a shape and give its id.

    Args:
        shapeType: GEOM_SPHERE, GEOM_BOX, GEOM_CAPSULE, GEOM_CYLINDER, GEOM_PLANE, GEOM_MESH or
        GEOM_HEIGHTFIELD.
        radius: of spheres, capsules, cylinders; m.
        halfExtents: of boxes; m.
        height: of capsules (without caps) and cylinders, along z; m.
        fileName: mesh file; of a heightfield without data an image or a table (.txt).
        meshScale: of meshes; of a heightfield its cell (x, y) and the factor of its heights.
        planeNormal: of planes.
        flags: GEOM_FORCE_CONCAVE_TRIMESH keeps a mesh's triangles (for bodies that do not move).
        collisionFramePosition: of the shape in its link; m.
        collisionFrameOrientation: x, y, z, w.
        vertices: (k, 3) of a mesh made in memory; m.
        indices: triangles of `vertices`; without them the hull of the points is meant.
        heightfieldTextureScaling: squares of texture over the field.
        heightfieldData: height at (i, j) is item i + j · numHeightfieldRows, i along x.
        numHeightfieldRows: points along x.
        numHeightfieldColumns: points along y.
        replaceHeightfieldIndex: a heightfield that gets these heights in place of its own, in all bodies
        that are made of it; nothing new is made.
    """
    kind = whole(shapeType)
    middle, rise = 0.0, 1.0
    if kind == c.GEOM_HEIGHTFIELD:
        points = points_of(client, heightfieldData, numHeightfieldRows, numHeightfieldColumns, fileName)
        if whole(replaceHeightfieldIndex) >= 0:
            return _replace(client, replaceHeightfieldIndex, points)
        geometry, middle = heightfield(points, meshScale)
        rise = float(meshScale[2])
    else:
        geometry = plain_geometry(
            client, kind, radius, halfExtents, height, fileName, meshScale, planeNormal, vertices, indices,
            FAILED,
        )  # fmt: skip
    origin = _pose(collisionFramePosition, collisionFrameOrientation)
    if kind == c.GEOM_HEIGHTFIELD:
        origin = turned_terrain(origin)
    shape = Collision(
        geometry=geometry,
        origin=origin,
        concave=bool(whole(flags) & c.GEOM_FORCE_CONCAVE_TRIMESH),
    )
    return keep(client, (shape,), middle, rise)


@command()
def createCollisionShapeArray(
    client: Client,
    shapeTypes: Sequence[int],
    radii: Sequence[float] | None = None,
    halfExtents: Sequence[Vector] | None = None,
    lengths: Sequence[float] | None = None,
    fileNames: Sequence[str] | None = None,
    meshScales: Sequence[Vector] | None = None,
    planeNormals: Sequence[Vector] | None = None,
    flags: Sequence[int] | None = None,
    collisionFramePositions: Sequence[Vector] | None = None,
    collisionFrameOrientations: Sequence[Vector] | None = None,
) -> int:
    """Make one shape of several and give its id."""
    shapes = []
    if not len(shapeTypes):
        raise failure("createCollisionShapeArray failed.", "there are no shapeTypes")
    for i, kind in enumerate(shapeTypes):
        geometry = plain_geometry(
            client,
            whole(kind),
            at(radii, i, 0.5),
            at(halfExtents, i, (1.0, 1.0, 1.0)),
            at(lengths, i, 1.0),
            at(fileNames, i, ""),
            at(meshScales, i, (1.0, 1.0, 1.0)),
            at(planeNormals, i, (0.0, 0.0, 1.0)),
            None,
            None,
            "createCollisionShapeArray failed.",
        )
        origin = _pose(at(collisionFramePositions, i, _NOWHERE), at(collisionFrameOrientations, i, _IDENTITY))
        shapes.append(Collision(geometry=geometry, origin=origin))
    return keep(client, tuple(shapes))


@command()
def removeCollisionShape(client: Client, collisionShapeId: int) -> None:
    """Forget a shape; bodies made from it keep it. An unknown id is no error."""
    client.scene.collision_shapes.pop(whole(collisionShapeId), None)


def _replace(client: Client, number_: int, points: Array) -> int:
    held = client.scene.collision_shapes.get(number_)
    geometry = held.shapes[0].geometry if held is not None and held.shapes else None
    if held is None or not isinstance(geometry, Heightfield):
        raise failure(FAILED, f"replaceHeightfieldIndex {number_} is no heightfield")
    replace_heights(client, geometry, points, held.rise, held.middle)
    return number_


def keep(client: Client, shapes: tuple[Collision, ...], middle: float = 0.0, rise: float = 1.0) -> int:
    """Id under which shapes are kept."""
    scene = client.scene
    number_ = scene.collision_ids.take()
    scene.collision_shapes[number_] = ShapeSet(shapes=shapes, middle=middle, rise=rise)
    return number_


def at(values: Sequence[Any] | None, index: int, default: Any) -> Any:
    """The i-th value, or the default where the list is missing or too short."""
    return values[index] if values is not None and index < len(values) else default


def plain_geometry(
    client: Client,
    kind: int,
    radius: float,
    half_extents: Vector | None,
    length: float,
    file_name: str,
    mesh_scale: Vector,
    normal: Vector,
    vertices: Sequence[Vector] | None,
    indices: Sequence[int] | None,
    message: str,
) -> Geometry:
    """Geometry of every shape type but heightfields.

    Raises:
        error: with `message`, for an unknown type, a size that is none or a file that is not there.
    """
    if kind == c.GEOM_SPHERE:
        return Sphere(radius=_positive(radius, "radius", message))
    if kind == c.GEOM_BOX:
        if half_extents is None:
            raise failure(message, "a box needs halfExtents")
        x, y, z = vector3(half_extents, message)
        return Box(size=(2 * x, 2 * y, 2 * z))
    if kind == c.GEOM_CAPSULE:
        return Capsule(radius=_positive(radius, "radius", message), length=number(length))
    if kind == c.GEOM_CYLINDER:
        return Cylinder(
            radius=_positive(radius, "radius", message), length=_positive(length, "height", message)
        )
    if kind == c.GEOM_PLANE:
        return Plane(normal=vector3(normal, message))
    if kind == c.GEOM_MESH:
        return _mesh(client, file_name, vector3(mesh_scale, message), vertices, indices, message)
    raise failure(message, f"shape type {kind} is unknown; use GEOM_SPHERE, GEOM_BOX, GEOM_MESH, ...")


def _mesh(
    client: Client,
    file_name: str,
    scale: tuple[float, float, float],
    vertices: Sequence[Vector] | None,
    indices: Sequence[int] | None,
    message: str,
) -> Mesh:
    if vertices is not None and len(vertices):
        from roboyard.pybullet.api.shapes.memory_meshes import mesh_of

        return Mesh(uri="", path=None, scale=scale, data=mesh_of(vertices, indices))
    path = find_file(client.search_path, text(file_name)) if file_name else None
    if path is None:
        remedy = not_found_remedy(client.search_path, file_name) if file_name else "give fileName or vertices"
        raise failure(message, remedy)
    return Mesh(uri=file_name, path=path, scale=scale)


QUARTER_TURN = (0.0, 0.0, sqrt(0.5), sqrt(0.5))
"""About z: terrain is laid out a quarter turn round, since Bullet cuts a cell along the other diagonal."""


def turned_terrain(origin: Pose) -> Pose:
    """Frame of the turned layout of a heightfield whose own frame is `origin`."""
    x, y, z, w = (float(v) for v in multiply(origin.quaternion, QUARTER_TURN))
    return Pose(position=origin.position, quaternion=(x, y, z, w))


def _pose(position: Vector, orientation: Vector) -> Pose:
    q = np.array(quaternion(orientation, FAILED))
    x, y, z, w = (float(v) for v in q / (np.linalg.norm(q) or 1.0))
    return Pose(position=vector3(position, FAILED), quaternion=(x, y, z, w))


def _positive(value: float, what: str, message: str) -> float:
    found = number(value)
    if not found > 0:
        raise failure(message, f"{what} must be positive, got {found}")
    return found
