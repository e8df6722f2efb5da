"""Triangles of a robot, packed for a browser: 16 bytes per vertex, equal shapes once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from roboyard._arrays import NDArray
from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, Mesh, Pose, RobotDescription, Visual
from roboyard.rendering.mesh_arrays import mesh_arrays
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.shapes.simplify import for_small_pictures

PLAIN = (0.72, 0.74, 0.78, 1.0)
"""RGBA of visual shapes without a colour."""
GREEN = (0.15, 0.75, 0.3, 0.45)
"""RGBA of collision shapes."""
STEPS = 65535
"""Steps of a coordinate over the extent of its part."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Triangles:
    """Triangles in the frame of their shapes, their scale applied."""

    low: tuple[float, ...]
    """(3,) lower corner of the bounding box (m)."""
    size: tuple[float, ...]
    """(3,) edges of the bounding box (m)."""
    vertices: bytes
    """16 bytes each: position (3 uint16, 2 unused bytes), normal (3 int8, 1 unused), RGBA (uint8)."""
    faces: bytes
    """Three uint32 for each triangle."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """One shape of a link."""

    link: str
    layer: str
    """visual or collision"""
    origin: Pose
    """Pose of the shape in the frame of its link."""
    triangles: Triangles
    """The same object for equal shapes in equal colours."""


def parts_of(description: RobotDescription, *, small: bool) -> Iterator[Part]:
    """Yield the visual and collision shapes of all links; infinite and empty ones are omitted.

    With `small`, dense meshes are simplified as for small pictures.
    """
    known: dict[tuple[object, ...], tuple[TriangleMesh, Triangles | None]] = {}
    for link in description.links:
        for layer, shapes in (("visual", link.visuals), ("collision", link.collisions)):
            for shape in shapes:
                triangles = _triangles(shape, small, known)
                if triangles is not None:
                    yield Part(link=link.name, layer=layer, origin=shape.origin, triangles=triangles)


def _triangles(
    shape: Visual | Collision,
    small: bool,
    known: dict[tuple[object, ...], tuple[TriangleMesh, Triangles | None]],
) -> Triangles | None:
    """Return the triangles of a shape, packed now or for an equal shape before; `known` gains them."""
    geometry, scale = shape.geometry, (1.0, 1.0, 1.0)
    if isinstance(geometry, Mesh):
        geometry, scale = replace(geometry, scale=scale), geometry.scale
    mesh = geometry_mesh(geometry)
    if mesh is None or not len(mesh.faces):
        return None
    rgba = GREEN
    if isinstance(shape, Visual):
        rgba = None if shape.material is None else shape.material.rgba
    key = (id(mesh) if isinstance(geometry, Mesh) else geometry, scale, rgba)
    if key not in known:  # which keeps the mesh, so that no other gets its id
        known[key] = mesh, _packed(for_small_pictures(mesh) if small else mesh, np.array(scale), rgba)
    return known[key][1]


def _packed(mesh: TriangleMesh, scale: NDArray, rgba: Sequence[float] | None) -> Triangles | None:
    """Return a mesh packed in one colour, or in its own where `rgba` is None; None where it has no face."""
    arrays = mesh_arrays(mesh)
    if not len(arrays.faces):
        return None
    corners = arrays.vertices[arrays.faces].reshape(-1, 3) * scale
    normals = arrays.normals.reshape(-1, 3) / np.where(scale == 0.0, 1.0, scale)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    colors = _own_colors(mesh, len(corners)) if rgba is None else _plain(rgba, len(corners))
    if np.prod(scale) < 0:  # mirroring reverses the order of the corners
        corners, normals, colors = (
            a.reshape(-1, 3, a.shape[1])[:, ::-1].reshape(-1, a.shape[1]) for a in (corners, normals, colors)
        )
    low, high = bounding_box(corners)
    size = np.maximum(high - low, 1e-9)
    rows = np.zeros((len(corners), 16), dtype=np.uint8)
    places = np.round((corners - low) / size * STEPS).astype("<u2")
    rows[:, :6] = places.view(np.uint8).reshape(-1, 6)
    rows[:, 8:11] = np.round(127 * normals).astype(np.int8).view(np.uint8)
    rows[:, 12:] = colors.astype(np.uint8)
    distinct, index = _distinct(rows)
    return Triangles(
        low=tuple(np.round(low, 7).tolist()),
        size=tuple(np.round(size, 7).tolist()),
        vertices=distinct.tobytes(),
        faces=index.astype("<u4").tobytes(),
    )


def _distinct(rows: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """Return the different rows of 16 bytes, and for each row its index in them."""
    halves = np.ascontiguousarray(rows).view(np.uint64)
    order = np.lexsort((halves[:, 1], halves[:, 0]))
    ordered = halves[order]
    is_first = np.ones(len(rows), dtype=bool)
    is_first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    index = np.empty(len(rows), dtype=np.intp)
    index[order] = np.cumsum(is_first) - 1
    return rows[order[is_first]], index


def _own_colors(mesh: TriangleMesh, count: int) -> NDArray[np.float64]:
    """Return (count, 4) RGBA of the corners, 0 to 255; textures give the colour below each corner."""
    arrays = mesh_arrays(mesh)
    if mesh.texture is not None and arrays.uv is not None:
        height, width = mesh.texture.shape[:2]
        uv = arrays.uv.reshape(-1, 2) % 1.0
        column = np.minimum((uv[:, 0] * width).astype(int), width - 1)
        row = np.minimum(((1.0 - uv[:, 1]) * height).astype(int), height - 1)
        picked = mesh.texture[row, column].astype(float)
        return picked if picked.shape[1] == 4 else np.c_[picked, np.full(count, 255.0)]
    if arrays.colors is not None:
        return np.repeat(arrays.colors.astype(float), 3, axis=0)
    return _plain(PLAIN, count)


def _plain(rgba: Sequence[float], count: int) -> NDArray[np.float64]:
    """Return (count, 4) rows of one colour, 0 to 255."""
    return np.tile(np.array([round(255 * min(max(v, 0.0), 1.0)) for v in rgba], dtype=np.float64), (count, 1))
