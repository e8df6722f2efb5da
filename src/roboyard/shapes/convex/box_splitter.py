"""Decompose a solid into convex parts by cutting boxes.

A part is a box in the mesh's principal frame; its hull is that of the triangles clipped to the box, so a set
of parts always contains the whole surface. The part with the largest possible gain is cut repeatedly where
the two halves' hulls have the least volume, to about twice the allowed number; then the pairs that add the
least volume are merged until the number fits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import NDArray
from roboyard._numba import njit
from roboyard.shapes.convex.hulls import Hull, convex_hull, farthest_along, hull_volume
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import fibonacci_sphere
from roboyard.shapes.voxels.grid import VoxelGrid, triangles

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Levels = list[tuple[Array, Indices]]
"""For each axis: the coordinates of triangle corners, and the number of corners at each."""
DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3), fibonacci_sphere(44)])
OVER_SPLIT = 2
"""Number of parts per allowed hull before merging."""
BALANCE = 0.6
"""Cost of unequal halves: cutting plates off a hollow body gains nothing before the last one.

Halving does.
"""
MANY_DIRECTIONS = np.concatenate([DIRECTIONS, fibonacci_sphere(400)])


@dataclass(frozen=True, slots=True, eq=False)
class _Cut:
    axis: int
    at: float
    cost: float
    """Volume of both halves' hulls, plus a penalty for their difference."""


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    lower: Array
    upper: Array
    points: Array
    """(p, 3) samples of the surface in the box (m)."""
    solid: Array
    """(s, 3) centres of the solid voxels in the box (m)."""
    excess: float
    """Volume of the hull of `points` outside the solid (m³)."""
    cut: _Cut | None
    """The best cut; None for a box too small to cut."""


def split_convex(
    mesh: TriangleMesh,
    grid: VoxelGrid,
    hull_count: int,
    max_vertices: int | None = 60,
    *,
    enough: float = 0.01,
    stop: Callable[[], bool] = lambda: False,
) -> list[Hull]:
    """Return at most `hull_count` convex hulls that together contain the mesh.

    Args:
        mesh: any triangles (m).
        grid: voxel grid of the same mesh.
        hull_count: most hulls.
        max_vertices: most vertices of a hull.
        enough: gain of a cut / volume of the solid below which no cut is made.
        stop: called regularly; True ends the cutting.
    """
    turn = _principal_frame(grid.surface_points)
    corners = np.concatenate([vertices[faces] for vertices, faces in triangles(mesh)]) @ turn
    samples = _surface_samples(grid, corners, turn)
    reach = max(float(np.ptp(samples, axis=0).max()), 1e-9)
    step = max(2.0 * grid.size, reach / 60.0)
    margin = 1e-6 * reach
    lower, upper = corners.min(axis=(0, 1)) - margin, corners.max(axis=(0, 1)) + margin
    cell = grid.size**3
    samples = np.concatenate([samples, grid.centers(_every_other(grid.solid)) @ turn])
    levels = [np.unique(np.round(corners[:, :, axis], 9), return_counts=True) for axis in range(3)]
    parts = [_part(lower, upper, samples, grid.centers(grid.solid) @ turn, levels, step, cell)]
    while len(parts) < OVER_SPLIT * hull_count and not stop():
        best = max(range(len(parts)), key=lambda k: parts[k].excess if parts[k].cut else -1.0)
        if parts[best].cut is None or parts[best].excess <= enough * grid.volume:
            break
        parts[best : best + 1] = _halves(parts[best], levels, step, cell)
    bounds = (lower, upper)
    clouds = [
        np.concatenate(
            [_clip_to_box(corners, part.lower, part.upper), _solid_corners(part, bounds, grid.size)]
        )
        for part in parts
    ]
    clouds = _merge([cloud for cloud in clouds if len(cloud)], hull_count, enough * grid.volume)
    return [convex_hull(cloud @ turn.T, max_vertices) for cloud in clouds]


def _principal_frame(points: Array) -> Array:
    """Return (3, 3) columns: the points' principal axes, or the world's where they bound them as closely."""
    spread = points - points.mean(axis=0)
    axes = np.linalg.eigh(spread.T @ spread)[1]
    boxed = float(np.prod(np.ptp(points @ axes, axis=0)))
    return np.ascontiguousarray(axes) if boxed < 0.8 * float(np.prod(np.ptp(points, axis=0))) else np.eye(3)


def _surface_samples(grid: VoxelGrid, corners: Array, turn: Array) -> Array:
    samples = grid.surface_points @ turn
    flat = corners.reshape(-1, 3)
    return np.concatenate([samples, _extremes(flat)])


def _part(
    lower: Array, upper: Array, points: Array, solid: Array, levels: Levels, step: float, cell: float
) -> _Part:
    volume = hull_volume(_extremes(points)) if len(points) else 0.0
    cut = _best_cut(lower, upper, points, levels, step) if volume > 0.0 else None
    return _Part(lower, upper, points, solid, volume - cell * len(solid), cut)


def _halves(part: _Part, levels: Levels, step: float, cell: float) -> list[_Part]:
    cut = part.cut
    assert cut is not None
    middle_upper, middle_lower = part.upper.copy(), part.lower.copy()
    middle_upper[cut.axis] = middle_lower[cut.axis] = cut.at
    in_lower = part.solid[:, cut.axis] <= cut.at
    halves = []
    for side, low, high, solid in (
        (-1, part.lower, middle_upper, part.solid[in_lower]),
        (1, middle_lower, part.upper, part.solid[~in_lower]),
    ):
        points = _on_side(part.points, cut.axis, cut.at, side, step)
        halves.append(_part(low, high, points, solid, levels, step, cell))
    return halves


def _extremes(points: Array) -> Array:
    """Return the points farthest along `DIRECTIONS`."""
    if not len(points):
        return points
    return points[np.unique(farthest_along(points, DIRECTIONS))]


def _best_cut(lower: Array, upper: Array, points: Array, levels: Levels, step: float) -> _Cut | None:
    """Return the cut whose halves' hulls have the least volume: coarse, then fine search on each axis."""
    reach = points @ DIRECTIONS.T
    best: _Cut | None = None
    for axis in range(3):
        low, high = float(points[:, axis].min()), float(points[:, axis].max())
        slices = int((high - low) / step)
        if slices < 2:
            continue
        index = np.clip(((points[:, axis] - low) / (high - low) * slices).astype(np.int64), 0, slices - 1)
        below, above = slice_extremes(reach, index, slices)

        def volume_at(k: int, below: Indices = below, above: Indices = above) -> float:
            first, second = points[np.unique(below[k - 1])], points[np.unique(above[k])]
            a, b = hull_volume(first), hull_volume(second)
            return a + b + BALANCE * abs(a - b)

        stride = max(1, slices // 10)
        tried = {k: volume_at(k) for k in range(stride, slices, stride)}
        if not tried:
            continue
        at = min(tried, key=lambda k: tried[k])
        while stride > 1:
            stride = (stride + 1) // 2
            for k in (at - stride, at + stride):
                if 0 < k < slices and k not in tried:
                    tried[k] = volume_at(k)
            at = min(tried, key=lambda k: tried[k])
            if stride == 1:
                break
        place = low + (high - low) * at / slices
        if lower[axis] < place < upper[axis] and (best is None or tried[at] < best.cost):
            best = _Cut(axis, place, tried[at])
    if best is None:
        return None
    best = _refined(best, points, levels[best.axis], step)
    return best if lower[best.axis] < best.at < upper[best.axis] else None


def _on_side(points: Array, axis: int, at: float, side: int, step: float) -> Array:
    """Return the points below (side -1) or above a cut.

    Those within a step are also moved onto it, for its face.
    """
    depth = side * (points[:, axis] - at)
    face = points[(depth >= 0) & (depth < step)]
    face[:, axis] = at
    return np.concatenate([points[depth >= 0], face])


def _refined(cut: _Cut, points: Array, levels: tuple[Array, Indices], step: float) -> _Cut:
    """Return the cut, or one just beside the nearest flat face, whichever gives the hulls less volume."""
    values, counts = levels
    begin, end = np.searchsorted(values, [cut.at - step, cut.at + step])
    if begin == end:
        return cut
    near = counts[begin:end] - np.abs(values[begin:end] - cut.at) / step
    level = float(values[begin + int(near.argmax())])

    def cost(at: float) -> float:
        below, above = (
            hull_volume(_extremes(_on_side(points, cut.axis, at, side, step))) for side in (-1, 1)
        )
        return below + above + BALANCE * abs(below - above) if below and above else np.inf

    places = (cut.at, level - 1e-3 * step, level + 1e-3 * step)
    at = min(places, key=cost)
    return _Cut(cut.axis, at, cut.cost)


@njit(cache=True, nogil=True)
def slice_extremes(reach, index, slices):
    """Return the points farthest in each direction among the slices up to, and from, each slice.

    Args:
        reach: (p, d) coordinate of each point along each direction.
        index: (p,) slice of each point.

    Returns:
        below, above: (slices, d) int64 point indices, over slices 0..k and k..last.
    """
    p, d = reach.shape
    top = np.full((slices, d), -1, np.int64)
    for i in range(p):
        k = index[i]
        for j in range(d):
            if top[k, j] < 0 or reach[i, j] > reach[top[k, j], j]:
                top[k, j] = i
    below, above = top.copy(), top.copy()
    for k in range(1, slices):
        for j in range(d):
            before = below[k - 1, j]
            if below[k, j] < 0 or (before >= 0 and reach[before, j] > reach[below[k, j], j]):
                below[k, j] = before
    for k in range(slices - 2, -1, -1):
        for j in range(d):
            after = above[k + 1, j]
            if above[k, j] < 0 or (after >= 0 and reach[after, j] > reach[above[k, j], j]):
                above[k, j] = after
    for k in range(slices):
        for j in range(d):
            # slices before the first point, or after the last, have no point: use any
            below[k, j] = max(below[k, j], 0)
            above[k, j] = max(above[k, j], 0)
    return below, above


def _merge(clouds: list[Array], hull_count: int, worth: float) -> list[Array]:
    """Merge neighbours whose hull adds least volume, to `hull_count` and while it adds less than `worth`."""
    clouds = [_many_extremes(cloud) for cloud in clouds]
    few = [_extremes(cloud) for cloud in clouds]
    volumes = [hull_volume(cloud) for cloud in few]
    prices: dict[tuple[int, int], float] = {}
    alive: list[int] = []

    def add(new: int) -> None:
        for k in alive:
            if _overlaps(few[k], few[new]):
                prices[k, new] = hull_volume(np.concatenate([few[k], few[new]])) - volumes[k] - volumes[new]
        alive.append(new)

    for index in range(len(clouds)):
        add(index)
    while len(alive) > 1:
        if not prices:
            # islands: no clouds touch any more, so any two may be merged
            prices = {
                (i, j): hull_volume(np.concatenate([few[i], few[j]])) - volumes[i] - volumes[j]
                for a, i in enumerate(alive)
                for j in alive[a + 1 :]
            }
        i, j = min(prices, key=lambda pair: prices[pair])
        if len(alive) <= hull_count and prices[i, j] > worth:
            break
        clouds.append(_many_extremes(np.concatenate([clouds[i], clouds[j]])))
        few.append(_extremes(clouds[-1]))
        volumes.append(hull_volume(few[-1]))
        alive = [k for k in alive if k not in (i, j)]
        prices = {pair: price for pair, price in prices.items() if not {i, j} & set(pair)}
        add(len(clouds) - 1)
    return [clouds[k] for k in alive]


def _overlaps(a: Array, b: Array) -> bool:
    """Whether the bounding boxes of two clouds overlap, within a fiftieth of their size."""
    slack = 0.02 * float(max(np.ptp(a, axis=0).max(), np.ptp(b, axis=0).max()))
    return bool(
        (a.min(axis=0) <= b.max(axis=0) + slack).all() and (b.min(axis=0) <= a.max(axis=0) + slack).all()
    )


def _many_extremes(points: Array) -> Array:
    """Return fewer points with nearly the same hull: the extremes along many directions."""
    if len(points) <= 150:
        return points
    return points[np.unique(farthest_along(points, MANY_DIRECTIONS))]


def _every_other(solid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return an eighth of the solid's voxels, evenly distributed."""
    thinned = np.zeros_like(solid)
    thinned[::2, ::2, ::2] = solid[::2, ::2, ::2]
    return thinned


def _solid_corners(part: _Part, bounds: tuple[Array, Array], size: float) -> Array:
    """Return (q, 3) extremes of the solid in a box, moved to the faces of the box that are cuts (m)."""
    points = part.solid
    if not len(points):
        return points
    for axis in range(3):
        if part.lower[axis] > bounds[0][axis]:
            near = points[:, axis] < part.lower[axis] + size
            points = points.copy()
            points[near, axis] = part.lower[axis]
        if part.upper[axis] < bounds[1][axis]:
            near = points[:, axis] > part.upper[axis] - size
            points = points.copy()
            points[near, axis] = part.upper[axis]
    return _extremes(points)


def _clip_to_box(corners: Array, lower: Array, upper: Array) -> Array:
    """Return (q, 3) corners of (m, 3, 3) triangles clipped to a box (m)."""
    touches = (corners.max(axis=1) >= lower).all(axis=1) & (corners.min(axis=1) <= upper).all(axis=1)
    return clip_triangles(np.ascontiguousarray(corners[touches]), lower, upper)


@njit(cache=True, nogil=True)
def clip_triangles(corners, lower, upper):
    """Return (q, 3) corners of (m, 3, 3) triangles clipped to a box; Sutherland and Hodgman (1974)."""
    # coordinate by coordinate: numba takes seven times as long to compile operations on rows
    most = 64
    out = np.empty((most, 3))
    used = 0
    poly, other = np.empty((16, 3)), np.empty((16, 3))
    for f in range(corners.shape[0]):
        n = 3
        for i in range(3):
            for k in range(3):
                poly[i, k] = corners[f, i, k]
        for side in range(6):
            axis, sign = side // 2, 1.0 if side % 2 == 0 else -1.0
            bound = lower[axis] if side % 2 == 0 else upper[axis]
            m = 0
            for i in range(n):
                j = (i + 1) % n
                da, db = sign * (poly[i, axis] - bound), sign * (poly[j, axis] - bound)
                if da >= 0.0:
                    for k in range(3):
                        other[m, k] = poly[i, k]
                    m += 1
                if (da > 0.0 and db < 0.0) or (da < 0.0 and db > 0.0):
                    share = da / (da - db)
                    for k in range(3):
                        other[m, k] = poly[i, k] + share * (poly[j, k] - poly[i, k])
                    other[m, axis] = bound
                    m += 1
            n = m
            for i in range(n):
                for k in range(3):
                    poly[i, k] = other[i, k]
            if n == 0:
                break
        if used + n > most:
            most = 2 * most + n
            wider = np.empty((most, 3))
            for i in range(used):
                for k in range(3):
                    wider[i, k] = out[i, k]
            out = wider
        for i in range(n):
            for k in range(3):
                out[used + i, k] = poly[i, k]
        used += n
    return out[:used].copy()
