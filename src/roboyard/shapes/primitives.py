"""Meshes of simple shapes, with normals and texture coordinates, cached by their arguments."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.shapes.mesh import TriangleMesh, read_only

Array = NDArray[np.float64]


def _mesh(vertices: ArrayLike, faces: ArrayLike, normals: ArrayLike, uv: ArrayLike) -> TriangleMesh:
    return TriangleMesh(
        vertices=read_only(np.asarray(vertices), np.float64),
        faces=read_only(np.asarray(faces), np.int32),
        normals=read_only(np.asarray(normals), np.float64),
        uv=read_only(np.asarray(uv), np.float64),
    )


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} must be positive, got {value}")


@lru_cache(maxsize=256)
def box(half_x: float = 0.5, half_y: float = 0.5, half_z: float = 0.5) -> TriangleMesh:
    """Return a box around the origin with half extents (m); each side shows the whole texture upright."""
    _positive(half_x=half_x, half_y=half_y, half_z=half_z)
    half = np.array([half_x, half_y, half_z])
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    # outward normal, the side's right and up as seen from outside
    sides = [
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
        ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
        ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
    ]
    vertices, normals, uv, faces = [], [], [], []
    for k, side in enumerate(sides):
        normal, right, up = np.array(side, dtype=float)
        vertices.append((normal + corners[:, :1] * right + corners[:, 1:] * up) * half)
        normals.append(np.tile(normal, (4, 1)))
        uv.append(0.5 * corners + 0.5)
        faces.append(np.array([[0, 1, 2], [0, 2, 3]]) + 4 * k)
    return _mesh(np.concatenate(vertices), np.concatenate(faces), np.concatenate(normals), np.concatenate(uv))


@lru_cache(maxsize=256)
def plane(half_x: float = 0.5, half_y: float = 0.5, repeat: float = 1.0) -> TriangleMesh:
    """Flat piece of the x-y plane facing +z, half sizes in m; the texture repeats `repeat` times each way."""
    _positive(half_x=half_x, half_y=half_y, repeat=repeat)
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    vertices = np.column_stack([corners * (half_x, half_y), np.zeros(4)])
    uv = (0.5 * corners + 0.5) * repeat
    return _mesh(vertices, [[0, 1, 2], [0, 2, 3]], np.tile([0.0, 0.0, 1.0], (4, 1)), uv)


@lru_cache(maxsize=256)
def sphere(radius: float = 0.5, segments: int = 32) -> TriangleMesh:
    """Return a sphere around the origin; radius in m, `segments` around the equator."""
    _positive(radius=radius)
    rings = max(segments // 2, 3)
    angles = np.pi * (np.arange(rings + 1) / rings - 0.5)
    profile = np.column_stack([np.cos(angles), np.sin(angles)])
    profile[[0, -1], 0] = 0.0
    return _revolve(radius * profile, profile, np.arange(rings + 1) / rings, segments)


@lru_cache(maxsize=256)
def cylinder(radius: float = 0.5, length: float = 1.0, segments: int = 40) -> TriangleMesh:
    """Return a cylinder along z around the origin; radius and length in m."""
    _positive(radius=radius, length=length)
    z = 0.5 * length
    points = np.array([[0, -z], [radius, -z], [radius, -z], [radius, z], [radius, z], [0, z]])
    normals = np.array([[0, -1.0], [0, -1.0], [1.0, 0], [1.0, 0], [0, 1.0], [0, 1.0]])
    return _revolve(points, normals, np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]), segments)


@lru_cache(maxsize=256)
def capsule(radius: float = 0.5, length: float = 1.0, segments: int = 32) -> TriangleMesh:
    """Return a capsule along z around the origin.

    `length` is that of the cylinder between the half spheres (m).
    """
    _positive(radius=radius, length=length)
    rings = max(segments // 4, 2)
    angles = 0.5 * np.pi * np.arange(rings + 1) / rings
    upper = np.column_stack([np.cos(angles), np.sin(angles)])
    upper[-1, 0] = 0.0
    lower = upper[::-1] * (1.0, -1.0)
    shift = np.array([0.0, 0.5 * length])
    points = np.concatenate([radius * lower - shift, radius * upper + shift])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return _revolve(points, np.concatenate([lower, upper]), arc / arc[-1], segments)


def heightfield(heights: ArrayLike, size_x: float, size_y: float) -> TriangleMesh:
    """Return terrain from a (rows, columns) grid of heights (m): row 0 at -y, column 0 at -x.

    The grid's corner points are at ±size_x / 2 and ±size_y / 2 (m); normals are smooth, the texture covers
    the whole field once. Raises ValueError for a grid below 2 x 2 or heights that are not finite.
    """
    z = np.asarray(heights, dtype=float)
    _positive(size_x=size_x, size_y=size_y)
    if z.ndim != 2 or min(z.shape) < 2 or not np.isfinite(z).all():
        raise ValueError(f"heights must be a finite grid of at least 2 x 2, got shape {z.shape}")
    rows, columns = z.shape
    x = np.linspace(-0.5 * size_x, 0.5 * size_x, columns)
    y = np.linspace(-0.5 * size_y, 0.5 * size_y, rows)
    gx, gy = np.meshgrid(x, y)
    slope_y, slope_x = np.gradient(z, y, x)
    normals = np.stack([-slope_x, -slope_y, np.ones_like(z)], axis=-1).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    lower = corner + np.array([0, 1, columns + 1])
    upper = corner + np.array([0, columns + 1, columns])
    faces = np.stack([lower, upper], axis=1).reshape(-1, 3)
    uv = np.column_stack([(gx / size_x + 0.5).ravel(), (gy / size_y + 0.5).ravel()])
    return _mesh(np.column_stack([gx.ravel(), gy.ravel(), z.ravel()]), faces, normals, uv)


def _revolve(points: Array, normals: Array, v: Array, segments: int) -> TriangleMesh:
    """Revolve a profile of (n, 2) radius and z, bottom to top, about z.

    Two equal points make a sharp edge.
    """
    if segments < 3:
        raise ValueError(f"segments must be at least 3, got {segments}")
    angle = 2.0 * np.pi * np.arange(segments + 1) / segments
    cos, sin = np.cos(angle), np.sin(angle)
    cos[-1], sin[-1] = cos[0], sin[0]

    def revolved(profile: Array) -> Array:
        r, z = profile[:, :1], profile[:, 1:]
        return np.stack([r * cos, r * sin, z + 0.0 * cos], axis=-1).reshape(-1, 3)

    uv = np.stack(np.broadcast_arrays(np.arange(segments + 1) / segments, v[:, None]), axis=-1).reshape(-1, 2)
    faces = []
    around = segments + 1
    for k in range(len(points) - 1):
        if np.array_equal(points[k], points[k + 1]):
            continue
        a = k * around + np.arange(segments)
        b = a + around
        if points[k, 0] > 0:
            faces.append(np.column_stack([a, a + 1, b + 1]))
        if points[k + 1, 0] > 0:
            faces.append(np.column_stack([a, b + 1, b]))
    return _mesh(revolved(points), np.concatenate(faces), revolved(normals), uv)
