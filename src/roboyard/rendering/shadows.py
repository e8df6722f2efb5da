"""The shadow map: a depth picture of the visible part of the scene from the direction of the sun."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from roboyard._arrays import NDArray
from roboyard._records import dataclass
from roboyard.rendering.buffers import buffer, scratch
from roboyard.rendering.kernels import raster
from roboyard.rendering.kernels import shadow as kernels
from roboyard.rendering.parts import in_parts
from roboyard.rendering.scene_arrays import SceneArrays

Array = NDArray[np.float64]

MARGIN = 4
"""Margin around the used part of the map, for the filter (texels)."""
TEXEL = 1.4
"""Side of a texel over the side of a pixel."""
SIZES = (64, 96, 128, 160, 192, 224, 256, 320, 384, 448, 512, 640, 768, 896, 1024, 1280, 1536, 1792, 2048)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ShadowMap:
    """Nearness to the sun of the first surface in each texel."""

    nearness: NDArray[np.float32]
    """(size * size,) nearness."""
    tiles: NDArray[np.float32]
    """Largest nearness of each tile of texels: most lit points need only this lookup."""
    size: int
    """Texels along each side; 0: no shadow is visible."""
    matrix: Array
    """(3, 4) transform from the world frame to column, row and depth (m)."""
    texel: float
    """Side of a texel (m)."""
    shaded: NDArray[np.int64]
    """(4,) first and last column, first and last row of the picture that shadows may reach."""


_EMPTY = np.zeros(1, dtype=np.float32)
NO_SHADOW = ShadowMap(
    nearness=_EMPTY,
    tiles=_EMPTY,
    size=0,
    matrix=np.zeros((3, 4)),
    texel=0.0,
    shaded=np.array([0, -1, 0, -1]),
)


def cast(
    arrays: SceneArrays, to_world: Array, sun: Array, seen: NDArray, nearness: NDArray,
    width: int, height: int, perspective: bool, rays: tuple[Array, Array], parts: int,
) -> ShadowMap:  # fmt: skip
    """Return the shadow map of the surfaces visible in a picture.

    Args:
        arrays: the scene.
        to_world: (instances, 3, 4) transforms from the mesh to the world frame (m).
        sun: (3,) unit vector to the sun in the world frame.
        seen: (pixels,) code of the nearest surface; -1: none.
        nearness: (pixels,) its nearness.
        width: width of the picture (pixels).
        height: height of the picture (pixels).
        perspective: whether the camera is perspective.
        rays: (3, 3) origins and (3, 3) directions, as of `kernels.arrays.View`.
        parts: threads to draw with.
    """
    if not len(arrays.opaque):
        return NO_SHADOW
    matrix = np.zeros((3, 4))
    matrix[:, :3] = _axes(*sun.tolist())
    draws = arrays.opaque
    casters = arrays.casters
    middles = np.einsum("nij,nj->ni", to_world[:, :, :3], arrays.middles) + to_world[:, :, 3]
    grounds = _grounds(arrays, middles, to_world, sun)
    if len(grounds):
        above = np.ones(len(to_world), dtype=bool)
        above[grounds] = False
        casters, draws = casters[above[casters]], draws[above[draws[:, 0]]]
        if not len(casters):
            return NO_SHADOW
    axes = np.abs(matrix[:, :3] @ to_world[casters, :, :3])
    centre, reach = middles[casters] @ matrix[:, :3].T, np.einsum("nij,nj->ni", axes, arrays.halves[casters])
    low, high = (centre - reach).min(axis=0), (centre + reach).max(axis=0)
    stride = 2 if width * height > 40000 else 1
    visible, shaded, total = np.empty((2, 2)), np.empty(4, np.int64), np.empty(1)
    count = kernels.lit_bounds(
        seen, nearness, width, height, stride, perspective, *rays, matrix, low[:2], high[:2],
        visible, shaded, total,
    )  # fmt: skip
    if not count:
        return NO_SHADOW
    (left, bottom), (right, top) = visible.tolist()
    extent = max(_steady(right - left), _steady(top - bottom))
    # texels slightly larger than the pixels that show them: the filter spans three texels
    origins, directions = rays
    x, y, z = (origins[1] + total[0] / count * directions[1]).tolist()
    size = _map_size(extent / (TEXEL * math.sqrt(x * x + y * y + z * z)))
    texel = extent / (size - 2 * MARGIN - 1)
    # whole texels of a fixed grid, so that edges do not flicker when the bounds change slightly
    middle = math.floor(0.5 * (left + right) / texel), math.floor(0.5 * (bottom + top) / texel)
    matrix[:2] /= texel
    matrix[:, 3] = 0.5 * size - middle[0], 0.5 * size - middle[1], -0.5 * (low[2] + high[2])
    screens = matrix[None, :, :3] @ to_world
    screens[:, :, 3] += matrix[:, 3]
    shares = enumerate(_split(draws, parts))
    depth, *others = in_parts(
        [partial(_draw, arrays, share, screens, size, f"shadow{k}") for k, share in shares]
    )
    for other in others:
        np.maximum(depth, other, out=depth)
    tiles = buffer("tiles", ((size // kernels.TILE) ** 2,), np.float32)
    kernels.nearest_of_tiles(depth, size, tiles)
    return ShadowMap(nearness=depth, tiles=tiles, size=size, matrix=matrix, texel=texel, shaded=shaded)


def _draw(arrays: SceneArrays, draws: NDArray, screens: Array, size: int, name: str) -> NDArray[np.float32]:
    """Return the (size * size,) nearness of some ranges of faces."""
    depth = buffer(name, (size * size,), np.float32)
    depth.fill(-np.inf)
    raster.draw_meshes(
        draws, screens, arrays.boxes, arrays.axes, arrays.faces, False, -np.inf, np.inf, raster.DEPTH_ONLY,
        _EMPTY, depth, np.zeros(1, dtype=np.int64), size, 0, size, *scratch(arrays.most_vertices),
    )  # fmt: skip
    return depth


def _split(draws: NDArray, parts: int) -> list[NDArray]:
    """Return the (n, 6) ranges of faces in so many parts with about as many faces each."""
    if parts == 1:
        return [draws]
    ends = np.cumsum(draws[:, 4] - draws[:, 3])
    found = []
    for k in range(parts):
        # the faces from `first` to `last` of all
        first, last = (int(ends[-1]) * j // parts for j in (k, k + 1))
        part = draws.copy()
        part[:, 3] = np.maximum(draws[:, 3], draws[:, 4] - ends + first)
        part[:, 4] = np.minimum(draws[:, 4], draws[:, 4] - ends + last)
        found.append(part[part[:, 3] < part[:, 4]])
    return found


def _axes(x: float, y: float, z: float) -> tuple[tuple[float, float, float], ...]:
    """Return right, up and viewing direction of a picture from the sun; (x, y, z) points to the sun."""
    right = (y, -x, 0.0) if abs(z) < 0.99 else (-z, 0.0, x)
    length = math.hypot(*right)
    a, b, c = right[0] / length, right[1] / length, right[2] / length
    return (a, b, c), (y * c - z * b, z * a - x * c, x * b - y * a), (-x, -y, -z)


def _grounds(arrays: SceneArrays, middles: Array, to_world: Array, sun: Array) -> NDArray[np.int32]:
    """Return the (n,) slabs below all other shapes, seen from the sun: they receive shadows and cast none.

    Otherwise the map would cover the whole of a floor, at a low resolution. `middles` are the (instances, 3)
    middles of the shapes in the world frame (m).
    """
    slabs = arrays.slabs[:, 0]
    if len(arrays.planes) or not len(slabs):
        return slabs[:0]
    axes = arrays.slabs[:, 1]
    normals = to_world[slabs, :, axes]
    lengths = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    normals /= np.where(normals @ sun > 0.0, lengths, -lengths)[:, None]
    above = middles[arrays.casters] @ normals.T - np.einsum("ij,ij->i", middles[slabs], normals)
    is_above = (above > arrays.halves[slabs, axes] * lengths) | (arrays.casters[:, None] == slabs)
    return slabs[is_above.all(axis=0)]


def _steady(extent: float) -> float:
    """Return `extent` rounded up to a quarter of a power of two."""
    return 2.0 ** (math.ceil(4.0 * math.log2(max(extent, 1e-3))) / 4.0)


def _map_size(least: float) -> int:
    """Return texels along a side: at least `least`, in steps: the grid rarely changes between frames."""
    return next((size for size in SIZES if size - 2 * MARGIN > least), SIZES[-1])
