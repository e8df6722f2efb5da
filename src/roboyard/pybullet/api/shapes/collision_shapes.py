"""Collision shapes for createMultiBody: createCollisionShape and createCollisionShapeArray."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard._records import dataclass
from roboyard.description.model import (
    FLAT,
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
from roboyard.errors import MeshError
from roboyard.pybullet.api.shapes.terrain import FAILED, heightfield, points_of, replace_heights
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.arguments import (
    Quaternion,
    Vector3,
    number,
    quaternion_or,
    text,
    vector3_or,
    whole,
)
from roboyard.pybullet.face.commands import command
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.state.file_search import find_file, not_found_remedy
from roboyard.transforms import Array, multiply

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

memory_meshes = lazy_module("roboyard.pybullet.api.shapes.memory_meshes")

Vector = Sequence[float]
IDENTITY = (0.0, 0.0, 0.0, 1.0)
NOWHERE = (0.0, 0.0, 0.0)
_ORIGIN = Pose()
UNIT = (1.0, 1.0, 1.0)
_UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class ShapeSet:
    """The shapes behind one shape id."""

    shapes: tuple[Collision, ...]
    """One shape, or several from an array call."""
    middle: float = 0.0
    """Height of a heightfield's origin, in the scaled input (m)."""
    rise: float = 1.0
    """Scale of a heightfield's heights."""


@command()
def createCollisionShape(
    client: Client,
    shapeType: int,
    radius: float = 0.5,
    halfExtents: Vector | None = None,
    height: float = 1.0,
    fileName: str = "",
    meshScale: Vector = UNIT,
    planeNormal: Vector = (0.0, 0.0, 1.0),
    flags: int = 0,
    collisionFramePosition: Vector = NOWHERE,
    collisionFrameOrientation: Vector = IDENTITY,
    vertices: Sequence[Vector] | None = None,
    indices: Sequence[int] | None = None,
    heightfieldTextureScaling: float = 1.0,
    heightfieldData: Sequence[float] | None = None,
    numHeightfieldRows: int = -1,
    numHeightfieldColumns: int = -1,
    replaceHeightfieldIndex: int = -1,
) -> int:
    """Create a collision shape and return its id.

    Args:
        shapeType: GEOM_SPHERE, GEOM_BOX, GEOM_CAPSULE, GEOM_CYLINDER, GEOM_PLANE, GEOM_MESH or
        GEOM_HEIGHTFIELD.
        radius: radius of spheres, capsules and cylinders (m).
        halfExtents: half extents of boxes (m).
        height: length of capsules (without caps) and cylinders, along z (m).
        fileName: mesh file; for a heightfield without data, an image or a table (.txt).
        meshScale: scale of meshes; for a heightfield, its cell size (x, y; m) and the scale of its heights.
        planeNormal: normal of planes.
        flags: GEOM_FORCE_CONCAVE_TRIMESH keeps a mesh's triangles (for fixed bodies).
        collisionFramePosition: position of the shape in its link (m).
        collisionFrameOrientation: orientation of the shape in its link (x, y, z, w).
        vertices: (k, 3) vertices of a mesh (m).
        indices: (3 n,) triangle corners in `vertices`, which the shape is made of, as with
            GEOM_FORCE_CONCAVE_TRIMESH; without them, the convex hull is used.
        heightfieldTextureScaling: ignored.
        heightfieldData: heights; that at (i, j) is item i + j · numHeightfieldRows, i along x.
        numHeightfieldRows: number of points along x.
        numHeightfieldColumns: number of points along y.
        replaceHeightfieldIndex: heightfield whose heights are replaced, in all bodies that use it.

    Raises:
        error: the type is unknown, a size is not valid, or a file cannot be read.
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
    origin = pose_of(collisionFramePosition, collisionFrameOrientation)
    if kind == c.GEOM_HEIGHTFIELD:
        origin = rotated_terrain_frame(origin)
    shape = Collision(
        geometry=geometry,
        origin=origin,
        concave=bool(whole(flags) & c.GEOM_FORCE_CONCAVE_TRIMESH) or _is_of_triangles(vertices, indices),
    )
    return keep(client, (shape,), middle, rise)


def _is_of_triangles(vertices: Sequence[Vector] | None, indices: Sequence[int] | None) -> bool:
    """Return whether a mesh is given as triangles: Bullet does not make it convex then."""
    return vertices is not None and len(vertices) > 0 and indices is not None and len(indices) > 0


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
    """Create one collision shape from several parts and return its id.

    Raises:
        error: there are no parts, or one is not valid.
    """
    shapes = []
    if not len(shapeTypes):
        raise failure("createCollisionShapeArray failed.", f"shapeTypes is empty: {shapeTypes!r}")
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
        place = at(collisionFramePositions, i, NOWHERE)
        origin = pose_of(place, at(collisionFrameOrientations, i, IDENTITY))
        shapes.append(Collision(geometry=geometry, origin=origin))
    return keep(client, tuple(shapes))


@command()
def removeCollisionShape(client: Client, collisionShapeId: int) -> None:
    """Remove a shape; bodies that use it keep it. An unknown id is ignored."""
    client.scene.collision_shapes.pop(whole(collisionShapeId), None)


def _replace(client: Client, number_: int, points: Array) -> int:
    held = client.scene.collision_shapes.get(number_)
    geometry = held.shapes[0].geometry if held is not None and held.shapes else None
    if held is None or not isinstance(geometry, Heightfield):
        raise failure(FAILED, f"replaceHeightfieldIndex {number_} is not a heightfield")
    replace_heights(client, geometry, points, held.rise, held.middle)
    return number_


def keep(client: Client, shapes: tuple[Collision, ...], middle: float = 0.0, rise: float = 1.0) -> int:
    """Store shapes and return their id."""
    scene = client.scene
    number_ = scene.collision_ids.take()
    scene.collision_shapes[number_] = ShapeSet(shapes=shapes, middle=middle, rise=rise)
    return number_


def at(values: Sequence[Any] | None, index: int, default: Any) -> Any:
    """Return the i-th value, or the default if the list is missing or too short."""
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
    """Return the geometry of any shape type except heightfields; arguments as in createCollisionShape.

    Raises:
        error: with `message`; the type is unknown, a size is not valid, or a file does not exist.
    """
    if kind == c.GEOM_SPHERE:
        return Sphere(radius=_positive(radius, "radius", message))
    if kind == c.GEOM_BOX:
        if half_extents is None:
            raise failure(message, "a box needs halfExtents, got None")
        x, y, z = vector3_or(half_extents, UNIT)
        return Box(size=(2 * x, 2 * y, 2 * z))
    if kind == c.GEOM_CAPSULE:
        return Capsule(radius=_positive(radius, "radius", message), length=number(length))
    if kind == c.GEOM_CYLINDER:
        return Cylinder(
            radius=_positive(radius, "radius", message), length=_positive(length, "height", message)
        )
    if kind == c.GEOM_PLANE:
        return Plane(normal=vector3_or(normal, _UP))
    if kind == c.GEOM_MESH:
        return _mesh(client, file_name, scale_of(mesh_scale), vertices, indices, message)
    raise failure(message, f"shape type {kind} is unknown; use GEOM_SPHERE, GEOM_BOX, GEOM_MESH, ...")


def scale_of(given: Vector) -> Vector3:
    """Return the factors of a mesh along its axes; 0 makes it flat, as in Bullet."""
    x, y, z = vector3_or(given, UNIT)
    return x or FLAT, y or FLAT, z or FLAT


def _mesh(
    client: Client,
    file_name: str,
    scale: tuple[float, float, float],
    vertices: Sequence[Vector] | None,
    indices: Sequence[int] | None,
    message: str,
) -> Mesh:
    if vertices is not None and len(vertices):
        return Mesh(uri="", path=None, scale=scale, data=memory_meshes().mesh_of(vertices, indices))
    path = find_file(client.search.folder, text(file_name), client.mounts) if file_name else None
    if path is None:
        remedy = (
            not_found_remedy(client.search.folder, file_name) if file_name else "give fileName or vertices"
        )
        raise failure(message, remedy)
    from roboyard.shapes.load import load_mesh

    try:
        load_mesh(path)
    except MeshError as problem:
        raise failure(message, str(problem)) from problem
    return Mesh(uri=file_name, path=path, scale=scale)


QUARTER_TURN = (0.0, 0.0, sqrt(0.5), sqrt(0.5))
"""Rotation in which heightfields are stored, since Bullet splits cells along the other diagonal."""


def rotated_terrain_frame(origin: Pose) -> Pose:
    """Return the frame of the rotated heightfield whose own frame is `origin`."""
    x, y, z, w = (float(v) for v in multiply(origin.quaternion, QUARTER_TURN))
    return Pose(position=origin.position, quaternion=(x, y, z, w))


def pose_of(position: Vector, orientation: Vector) -> Pose:
    """Return the pose that a script gives of a shape in its link's frame, with a unit quaternion."""
    if position is NOWHERE and orientation is IDENTITY:
        return _ORIGIN
    turn = _unit(quaternion_or(orientation, IDENTITY))
    return Pose(position=vector3_or(position, NOWHERE), quaternion=turn)


@lru_cache(256)
def _unit(orientation: Quaternion) -> Quaternion:
    q = np.array(orientation)
    x, y, z, w = (q / (np.linalg.norm(q) or 1.0)).tolist()
    return x, y, z, w


def _positive(value: float, name: str, message: str) -> float:
    found = number(value)
    if not found > 0:
        raise failure(message, f"{name} must be positive, got {found}")
    return found
