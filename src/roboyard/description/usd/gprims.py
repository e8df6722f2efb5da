"""Triangles of USD's geometric prims, in the prim's own frame and unit."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.description.usd.library import UsdGeom
from roboyard.description.usd.looks import face_colors, texture_coordinates, texture_of
from roboyard.errors import DescriptionError
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.readers.parts import (
    TooManyTrianglesError,
    check_triangles,
    check_vertices,
    combine,
    part_from_corners,
)
from roboyard.transforms import Array

SEGMENTS = 48
_SIZES = {
    "Cube": ("size",),
    "Sphere": ("radius",),
    **dict.fromkeys(("Cylinder", "Capsule", "Cone"), ("radius", "height")),
}


def gprim_mesh(prim: Any, *, textured: bool = False) -> TriangleMesh | None:
    """Return the triangles of a Mesh, Cube, Sphere, Cylinder, Capsule or Cone; None for anything else.

    Args:
        prim: where it is.
        textured: read the image of a mesh's material and its texture coordinates too.

    Raises:
        DescriptionError: a mesh's numbers contradict each other, or it has too many triangles.
    """
    kind = str(prim.GetTypeName())
    if kind == "Mesh":
        return _polygons(prim, textured=textured)
    size = gprim_size(prim)
    if size is None or not all(0 < value < 1e12 for value in size):
        return None
    if kind == "Cube":
        half = size[0] / 2
        return primitives.box(half, half, half)
    if kind == "Sphere":
        return primitives.sphere(size[0], SEGMENTS)
    radius, height = size
    if kind == "Cylinder":
        mesh = primitives.cylinder(radius, height, SEGMENTS)
    elif kind == "Capsule":
        mesh = primitives.capsule(radius, height, SEGMENTS)
    else:
        mesh = _cone(radius, height)
    return placed(mesh, turn_to_axis(prim))


def gprim_size(prim: Any) -> tuple[float, ...] | None:
    """Return a Cube's edge, a Sphere's radius, or radius and height of a round solid; None for others."""
    names = _SIZES.get(str(prim.GetTypeName()))
    values = [prim.GetAttribute(name).Get() for name in names or ()]
    if names is None or not all(isinstance(value, int | float) for value in values):
        return None
    return tuple(map(float, values))


def axis_of(prim: Any) -> Array:
    """Return the (3,) axis of a round solid or a plane."""
    token = str(prim.GetAttribute("axis").Get())
    return np.eye(3)[{"X": 0, "Y": 1}.get(token, 2)]


def turn_to_axis(prim: Any) -> Array:
    """Return the (4, 4) rotation that turns z to the axis of a round solid."""
    turn = np.eye(4)
    turn[:3, :3] = np.roll(np.eye(3), int(np.argmax(axis_of(prim))) + 1, axis=0)
    return turn


def placed(mesh: TriangleMesh, T: Array) -> TriangleMesh:
    """Return the mesh transformed by (4, 4) `T`, which may scale and mirror."""
    vertices = mesh.vertices @ T[:3, :3].T + T[:3, 3]
    faces = mesh.faces[:, ::-1] if np.linalg.det(T[:3, :3]) < 0 else mesh.faces
    normals = None
    if mesh.normals is not None and abs(np.linalg.det(T[:3, :3])) > 1e-300:
        normals = mesh.normals @ np.linalg.inv(T[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        normals = read_only(normals, np.float64)
    return TriangleMesh(
        vertices=read_only(vertices, np.float64),
        faces=read_only(faces, np.int32),
        normals=normals,
        uv=mesh.uv,
        colors=mesh.colors,
        texture=mesh.texture,
    )


def _cone(radius: float, height: float) -> TriangleMesh:
    """Return a cone along z, centred, its tip up."""
    angles = np.arange(SEGMENTS) * (2 * np.pi / SEGMENTS)
    rim = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(SEGMENTS, -height / 2)])
    vertices = np.vstack([rim, [[0, 0, height / 2], [0, 0, -height / 2]]])
    here = np.arange(SEGMENTS)
    after = (here + 1) % SEGMENTS
    tip, base = np.full(SEGMENTS, SEGMENTS), np.full(SEGMENTS, SEGMENTS + 1)
    faces = np.vstack([np.column_stack([here, after, tip]), np.column_stack([after, here, base])])
    return TriangleMesh(vertices=read_only(vertices, np.float64), faces=read_only(faces, np.int32))


def _polygons(prim: Any, *, textured: bool) -> TriangleMesh | None:
    """Return the polygons of a Mesh as fans of triangles; None where it has none."""
    schema, path = UsdGeom.Mesh(prim), str(prim.GetPath())
    points = _array(schema.GetPointsAttr(), float).reshape(-1, 3)
    counts = _array(schema.GetFaceVertexCountsAttr(), np.int64)
    corners = _array(schema.GetFaceVertexIndicesAttr(), np.int64)
    if not len(points) or not len(counts):
        return None
    fits = counts.min() >= 1 and counts.sum() == len(corners)
    if not fits or corners.min() < 0 or corners.max() >= len(points) or not np.isfinite(points).all():
        raise DescriptionError(
            f"mesh {path}: face counts, indices and points do not match; export the stage again",
            element=path,
        )
    triangles = np.maximum(counts - 2, 0)
    try:
        check_triangles(int(triangles.sum()))
        check_vertices(len(points))
    except TooManyTrianglesError as error:
        raise DescriptionError(f"mesh {path}: {error}", element=path) from None
    owner = np.repeat(np.arange(len(counts)), triangles)
    if not len(owner):
        return None
    starts = np.cumsum(counts) - counts
    step = np.arange(len(owner)) - np.repeat(np.cumsum(triangles) - triangles, triangles) + 1
    places = np.stack([starts[owner], starts[owner] + step, starts[owner] + step + 1], axis=1)
    if str(schema.GetOrientationAttr().Get()) == "leftHanded":
        places = places[:, ::-1]
    colors = face_colors(prim, len(counts))
    texture = texture_of(prim) if textured else None
    uv = None if texture is None else texture_coordinates(prim, corners, places, len(points))
    if uv is None:
        return TriangleMesh(
            vertices=read_only(points, np.float64),
            faces=read_only(corners[places], np.int32),
            colors=None if colors is None else read_only(colors[owner], np.uint8),
        )
    part = part_from_corners(
        points,
        corners[places],
        uv=uv,
        color=None if colors is None else colors[owner],
        texture=texture,
    )
    return combine([part])


def _array(attribute: Any, kind: type) -> NDArray[Any]:
    """Return an attribute's values as an array (n, ...); empty where it has none."""
    values = attribute.Get()
    try:
        return np.array([] if values is None else values, dtype=kind)
    except (TypeError, ValueError, OverflowError):  # of another type than the schema says
        return np.zeros(0, dtype=kind)
