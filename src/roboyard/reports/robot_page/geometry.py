"""Triangles of a robot, packed for a browser: 16 bytes per vertex, in link frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from roboyard.description.geometry import geometry_mesh
from roboyard.description.model import Collision, Mesh, RobotDescription, Visual
from roboyard.rendering.mesh_arrays import mesh_arrays
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.shapes.simplify import for_small_pictures
from roboyard.transforms import matrix_from_quaternion

PLAIN = (0.72, 0.74, 0.78, 1.0)
"""RGBA of visual shapes without a colour."""
GREEN = (0.15, 0.75, 0.3, 0.45)
"""RGBA of collision shapes."""
STEPS = 65535
"""Steps of a coordinate over the extent of its part."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """Triangles of one shape in the frame of its link."""

    link: str
    layer: str
    """visual or collision"""
    low: tuple[float, ...]
    """(3,) lower corner of the bounding box (m)."""
    size: tuple[float, ...]
    """(3,) edges of the bounding box (m)."""
    vertices: bytes
    """16 bytes each: position (3 uint16, 2 unused bytes), normal (3 int8, 1 unused), RGBA (uint8)."""
    faces: bytes
    """Three uint32 for each triangle."""


def parts_of(description: RobotDescription, *, small: bool) -> Iterator[Part]:
    """Yield the visual and collision shapes of all links; infinite and empty ones are omitted.

    With `small`, dense meshes are simplified as for small pictures.
    """
    for link in description.links:
        for layer, shapes in (("visual", link.visuals), ("collision", link.collisions)):
            for shape in shapes:
                part = _part(link.name, layer, shape, small)
                if part is not None:
                    yield part


def _part(link: str, layer: str, shape: Visual | Collision, small: bool) -> Part | None:
    geometry, scale = shape.geometry, np.ones(3)
    if isinstance(geometry, Mesh):
        geometry, scale = replace(geometry, scale=(1.0, 1.0, 1.0)), np.array(geometry.scale, dtype=float)
    mesh = geometry_mesh(geometry)
    if mesh is None or not len(mesh.faces):
        return None
    if small:
        mesh = for_small_pictures(mesh)
    arrays = mesh_arrays(mesh)
    if not len(arrays.faces):
        return None
    turn = matrix_from_quaternion(shape.origin.quaternion)
    corners = (arrays.vertices[arrays.faces].reshape(-1, 3) * scale) @ turn.T + shape.origin.position
    normals = arrays.normals.reshape(-1, 3) / np.where(scale == 0.0, 1.0, scale) @ turn.T
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    if np.prod(scale) < 0:  # mirroring reverses the order of the corners
        corners, normals = (a.reshape(-1, 3, 3)[:, ::-1].reshape(-1, 3) for a in (corners, normals))
    colors = _plain(GREEN, len(corners))
    if isinstance(shape, Visual):
        colors = _colors(shape, mesh, len(corners))
    low, high = bounding_box(corners)
    size = np.maximum(high - low, 1e-9)
    rows = np.zeros((len(corners), 16), dtype=np.uint8)
    places = np.round((corners - low) / size * STEPS).astype("<u2")
    rows[:, :6] = places.view(np.uint8).reshape(-1, 6)
    rows[:, 8:11] = np.round(127 * normals).astype(np.int8).view(np.uint8)
    rows[:, 12:] = colors.astype(np.uint8)
    distinct, index = _distinct(rows)
    return Part(
        link=link,
        layer=layer,
        low=tuple(np.round(low, 7).tolist()),
        size=tuple(np.round(size, 7).tolist()),
        vertices=distinct.tobytes(),
        faces=index.astype("<u4").tobytes(),
    )


def _distinct(rows: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    keys = np.ascontiguousarray(rows).view(np.dtype((np.void, rows.shape[1]))).ravel()
    _, first, index = np.unique(keys, return_index=True, return_inverse=True)
    return rows[first], index.ravel()


def _colors(shape: Visual, mesh: TriangleMesh, count: int) -> NDArray[np.float64]:
    """Return (count, 4) RGBA of the corners, 0 to 255; textures give the colour below each corner."""
    own = shape.material.rgba if shape.material is not None else None
    if own is not None:
        return _plain(own, count)
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
