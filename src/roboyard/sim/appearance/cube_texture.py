"""Cube textures on triangle meshes: faces are cut where the cube has its edges, and each part gets a side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.mesh import TriangleMesh, read_only

Array = NDArray[np.float64]

_DIAGONALS = ((1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1))
"""Normals of the planes that part the six sides of a cube, seen from its middle."""
_WORST = 0.01
"""Widths of a side by which the picture may be off in the middle of an edge."""
_MOST_FACES = 50_000
"""Faces are not cut up any further than this."""
# of each side +x, -x, +y, -y, +z, -z: the directions in which the picture's columns and rows go on
# (OpenGL 4.6 specification, table 8.19)
_COLUMN = np.array([(0, 0, -1), (0, 0, 1), (1, 0, 0), (1, 0, 0), (1, 0, 0), (-1, 0, 0)], dtype=float)
_ROW = np.array([(0, -1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (0, -1, 0), (0, -1, 0)], dtype=float)


def wrap_in_cube(
    mesh: TriangleMesh, scale: Array, unit: Callable[[Array], Array] | None, pixels: int, sides: int
) -> TriangleMesh:
    """`mesh` cut up, with texture coordinates for a picture of `sides` squares below one another.

    Args:
        mesh: its vertices times `scale` (3,) are seen from the origin, which is the middle of the cube.
        unit: moves places (..., 3) before they are looked at; None: they stay.
        pixels: width of a side's picture.
        sides: 6 (+x, -x, +y, -y, +z, -z), or 1 for one that all sides share.
    """
    places = mesh.vertices[mesh.faces]
    directions = places * scale
    parts = [places, directions if unit is None else unit(directions)]
    if mesh.normals is not None:
        parts.append(mesh.normals[mesh.faces])
    packed = np.concatenate(parts, axis=2)
    for normal in _DIAGONALS:
        packed = _split(packed, np.array(normal, dtype=float))
    uv, off = _uv(packed[..., 3:6])
    while (off > _WORST).any() and 2 * len(packed) <= _MOST_FACES:
        packed = _bisected(packed, off)
        uv, off = _uv(packed[..., 3:6])
    side = _side(packed[..., 3:6])[:, None] % sides
    rim = 0.5 / pixels  # neighbours in the picture are no neighbours on the cube
    uv = np.clip(uv, rim, 1.0 - rim)
    uv = np.stack([uv[..., 0], 1.0 - (side + uv[..., 1]) / sides], axis=-1).reshape(-1, 2)
    flat = packed.reshape(len(uv), -1)
    normals = flat[:, 6:] / np.maximum(np.linalg.norm(flat[:, 6:], axis=1, keepdims=True), 1e-12)
    return replace(
        mesh,
        vertices=read_only(flat[:, :3], np.float64),
        faces=read_only(np.arange(len(flat)).reshape(-1, 3), np.int32),
        normals=None if mesh.normals is None else read_only(normals, np.float64),
        uv=read_only(uv, np.float64),
        colors=None,
        texture=None,
    )


def _side(directions: Array) -> NDArray[np.intp]:
    """Which side of the cube the middle of each (m, 3, 3) triangle is on."""
    middle = directions.mean(axis=1)
    axis = np.abs(middle).argmax(axis=1)
    return 2 * axis + (np.take_along_axis(middle, axis[:, None], axis=1)[:, 0] < 0.0)


def _uv(directions: Array) -> tuple[Array, Array]:
    """Column and row (m, 3, 2; 0 to 1) of each corner, and how far off the middle of each edge is (m, 3).

    Halfway between corners of depths a and b the picture is at (a u + b v) / (a + b), not at their mean.
    """
    side = _side(directions)
    depth = np.abs(np.take_along_axis(directions, (side // 2)[:, None, None], axis=2))
    depth = np.maximum(depth, 1e-12)
    both = np.stack([_COLUMN[side], _ROW[side]], axis=2)
    uv = 0.5 + 0.5 * (directions @ both) / depth
    other, next_depth = np.roll(uv, -1, axis=1), np.roll(depth, -1, axis=1)
    off = np.abs(other - uv) * np.abs(next_depth - depth) / (2.0 * (next_depth + depth))
    # next to the middle of the cube its sides meet, and no cut helps
    reachable = np.minimum(depth, next_depth) > 1e-3 * np.abs(directions).max(initial=0.0)
    return uv, np.where(reachable[..., 0], off.max(axis=2), 0.0)


def _bisected(packed: Array, off: Array) -> Array:
    """Two triangles for each that has an edge too far off, parted in the middle of its worst.

    How far off an edge is, both its triangles agree upon (save next to the cube's middle): in the end they
    part it alike and no gap opens.
    """
    bad = (off > _WORST).any(axis=1)
    order = (off[bad].argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.swapaxes(np.take_along_axis(packed[bad], order[..., None], axis=1), 0, 1)
    middle = 0.5 * (a + b)
    halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
    return np.concatenate([packed[~bad], *halves])


def _split(packed: Array, normal: Array) -> Array:
    """Cut (m, 3, k) triangles along the plane through the origin of their directions (columns 3 to 6)."""
    side = packed[..., 3:6] @ normal
    side[np.abs(side) < 1e-9 * np.linalg.norm(packed[..., 3:6], axis=2)] = 0.0
    crossing = (side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0)
    whole, cut, at = packed[~crossing], packed[crossing], side[crossing]
    if not len(cut):
        return packed
    # turn each so that its first corner is alone on its side, or is on the plane
    on_plane = (at == 0.0).any(axis=1)
    alone = np.where(on_plane, np.argmax(at == 0.0, axis=1), _odd_one(at))
    order = (alone[:, None] + np.arange(3)) % 3
    cut = np.take_along_axis(cut, order[..., None], axis=1)
    at = np.take_along_axis(at, order, axis=1)
    a, b, c = cut[:, 0], cut[:, 1], cut[:, 2]

    def between(p: Array, q: Array, sp: Array, sq: Array) -> Array:
        share = sp / np.where(sp == sq, 1.0, sp - sq)
        return p + share[:, None] * (q - p)

    ab, ac = between(a, b, at[:, 0], at[:, 1]), between(a, c, at[:, 0], at[:, 2])
    bc = between(b, c, at[:, 1], at[:, 2])
    new = [
        np.stack([a[on_plane], b[on_plane], bc[on_plane]], axis=1),
        np.stack([a[on_plane], bc[on_plane], c[on_plane]], axis=1),
        np.stack([a[~on_plane], ab[~on_plane], ac[~on_plane]], axis=1),
        np.stack([ab[~on_plane], b[~on_plane], c[~on_plane]], axis=1),
        np.stack([ab[~on_plane], c[~on_plane], ac[~on_plane]], axis=1),
    ]
    return np.concatenate([whole, *new])


def _odd_one(side: Array) -> NDArray[np.intp]:
    """Which of three corners is alone on its side of a plane."""
    above = side > 0.0
    return np.argmax(above != (above.sum(axis=1) >= 2)[:, None], axis=1)
