"""Convex hulls for physics engines: never flat, with a limited number of vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard.errors import MeshError
from roboyard.native import compiled
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.voxels.grid import VoxelGrid

if TYPE_CHECKING:
    from scipy.spatial import ConvexHull

Array = NDArray[np.float64]
THINNEST = 2e-3
"""Thickness of flat input / its largest extent."""
POINT_SIZE = 1e-3
"""Edge of the cube that replaces a single point (m)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Hull:
    """A convex hull as a closed mesh wound outwards."""

    mesh: TriangleMesh
    """The hull (m)."""
    volume: float
    """Volume (m³)."""
    lost: float
    """Share of the full hull's volume lost by the vertex limit."""
    notes: tuple[str, ...] = ()
    """Warnings about the input."""


@dataclass(frozen=True, kw_only=True, slots=True)
class HullFit:
    """How well a set of hulls approximates a solid; volumes are shares of the solid's."""

    excess: float
    """Volume of the hulls' union outside the solid."""
    missing: float
    """Volume of the solid outside every hull."""
    deepest_mm: float
    """Largest distance of the union's surface outside the solid (mm)."""


def convex_hull(mesh: TriangleMesh | ArrayLike, max_vertices: int | None = 60) -> Hull:
    """Return the convex hull of a mesh's used vertices, or of (n, 3) points (m).

    Points in a plane, on a line or at one position are thickened to a thin solid, with a note.

    Args:
        mesh: the mesh or points; values that are not finite are ignored.
        max_vertices: most vertices of the result (at least 4), selected greedily by their distance from the
            hull of those before; None for all.

    Raises:
        MeshError: there is no finite point, or `max_vertices` is below 4.
    """
    if max_vertices is not None and max_vertices < 4:
        raise MeshError(
            f"a hull of at most {max_vertices} vertices has no volume; max_vertices must be 4 or more"
        )
    points, notes = _thickened(_points(mesh))
    center = points.mean(axis=0)
    scale = float(np.ptp(points, axis=0).max())
    unit = (points - center) / scale
    corners, hull = _qhull(unit)
    full = float(hull.volume)
    if max_vertices is not None and len(corners) > max_vertices:
        corners, hull = _qhull(_most_prominent(corners, max_vertices))
    faces = _outward(corners, hull)
    return Hull(
        mesh=TriangleMesh(vertices=read_only(center + scale * corners, np.float64), faces=faces),
        volume=float(hull.volume) * scale**3,
        lost=max(0.0, 1.0 - float(hull.volume) / full),
        notes=notes,
    )


def is_convex(mesh: TriangleMesh, tolerance: float = 1e-3) -> bool:
    """Whether the mesh is its own convex hull: its faces cover the hull's surface once.

    Args:
        mesh: the mesh (m).
        tolerance: largest distance / largest extent; ten times it is the tolerance of the area.

    """
    used = _points(mesh)
    extent = float(np.ptp(used, axis=0).max())
    if extent == 0.0:
        return False
    hull = convex_hull(mesh, None)
    if hull.notes:
        return False
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    planes = face_planes(hull.mesh)
    middle = corners.mean(axis=1)
    depth = np.full(len(middle), np.inf)
    for begin in range(0, len(middle), 4096):
        part = slice(begin, begin + 4096)
        depth[part] = -(middle[part] @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return bool(
        depth[area > 1e-9 * area.sum()].max() <= tolerance * extent
        and abs(area.sum() / _area(hull.mesh) - 1.0) < 10 * tolerance
    )


def measure_hulls(hulls: Sequence[TriangleMesh], grid: VoxelGrid) -> HullFit:
    """Return how well convex meshes approximate a voxel grid's solid, in the same frame (m)."""
    union = np.zeros(grid.inside.shape, dtype=np.bool_)
    for hull in hulls:
        planes = face_planes(hull)
        # into voxel units: n·(origin + size q) + d
        planes[:, 3] = (planes[:, 3] + planes[:, :3] @ grid.origin) / grid.size
        lower, upper = (hull.bounds - grid.origin) / grid.size
        begin = np.clip(np.floor(lower), 0, grid.inside.shape).astype(np.int64)
        end = np.clip(np.ceil(upper) + 1, 0, grid.inside.shape).astype(np.int64)
        mark_convex(planes, begin, end, union)
    solid = grid.solid
    outside = union & ~solid & (grid.sdf > 0)
    total = max(int(solid.sum()), 1)
    return HullFit(
        excess=float(outside.sum() / total),
        missing=float((solid & ~union & (grid.inside | ~grid.inside.any())).sum() / total),
        deepest_mm=float(grid.sdf[outside].max() * grid.size * 1e3) if outside.any() else 0.0,
    )


def mark_convex(
    planes: Array, begin: NDArray[np.int64], end: NDArray[np.int64], mask: NDArray[np.bool_]
) -> None:
    """Set in (nx, ny, nz) `mask` the voxels of (3,) `begin` to `end` with centres behind all (p, 4) planes
    (voxel units).
    """
    mark_behind(planes, begin, end, mask.view(np.uint8))


@compiled("f8[:,::1] i8[::1] i8[::1] u1[:,:,::1]", releases_gil=True)
def mark_behind(planes, begin, end, mask):
    """Set in `mask` what `mark_convex` sets."""
    for i in range(begin[0], end[0]):
        for j in range(begin[1], end[1]):
            for k in range(begin[2], end[2]):
                if mask[i, j, k] != 0:
                    continue
                inside = 1
                for p in range(planes.shape[0]):
                    if (
                        planes[p, 0] * (i + 0.5) + planes[p, 1] * (j + 0.5) + planes[p, 2] * (k + 0.5)
                        > -planes[p, 3]
                    ):
                        inside = 0
                        break
                mask[i, j, k] = inside


def farthest_along(points: Array, directions: Array) -> NDArray[np.int64]:
    """Return (d,) indices of the (n, 3) points farthest along each of (d, 3) directions."""
    found = np.zeros(len(directions), dtype=np.int64)
    write_farthest(np.ascontiguousarray(points), np.ascontiguousarray(directions), found)
    return found


@compiled("f8[:,::1] f8[:,::1] i8[::1]", releases_gil=True)
def write_farthest(points, directions, found):
    """Write the indices that `farthest_along` returns to (d,) zeros."""
    for j in range(directions.shape[0]):
        x, y, z = directions[j, 0], directions[j, 1], directions[j, 2]
        best = -np.inf
        for i in range(points.shape[0]):
            d = x * points[i, 0] + y * points[i, 1] + z * points[i, 2]
            if d > best:
                best, found[j] = d, i


def hull_volume(points: Array) -> float:
    """Return the volume of the convex hull of (n, 3) points; 0 if they are too few or flat."""
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

    if len(points) < 4:
        return 0.0
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return 0.0


def _points(mesh: TriangleMesh | ArrayLike) -> Array:
    if isinstance(mesh, TriangleMesh):
        points = mesh.vertices
        if len(mesh.faces):
            points = points[np.unique(mesh.faces)]
    else:
        points = np.asarray(mesh, dtype=float).reshape(-1, 3)
    points = np.unique(points[np.isfinite(points).all(axis=1)], axis=0)
    if not len(points):
        raise MeshError("no finite vertex in the mesh (0 points); export it again")
    return points


def _thickened(points: Array) -> tuple[Array, tuple[str, ...]]:
    """Return points with both sides of a thin slab added where they have no volume, and a note of it."""
    middle = points.mean(axis=0)
    axes = np.linalg.eigh((points - middle).T @ (points - middle))[1].T
    extent = np.ptp((points - middle) @ axes.T, axis=0)
    largest = float(extent.max())
    if largest <= 1e-12 * (1.0 + float(np.abs(middle).max())):
        axes, extent, thickness = np.eye(3), np.zeros(3), POINT_SIZE
    else:
        thickness = THINNEST * largest
    flat = extent < 1e-2 * thickness
    if not flat.any():
        return points, ()
    for axis in axes[flat]:
        points = np.concatenate([points - 0.5 * thickness * axis, points + 0.5 * thickness * axis])
    kind = {1: "flat", 2: "a line", 3: "a point"}[int(flat.sum())]
    return points, (f"{kind}: thickened to {thickness * 1e3:.3g} mm",)


def _qhull(points: Array) -> tuple[Array, ConvexHull]:
    """Return the corners of the hull and their hull, with joggled input where Qhull needs it."""
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

    try:
        hull = ConvexHull(points)
        corners = points[hull.vertices]
        return corners, ConvexHull(corners)
    except QhullError:
        hull = ConvexHull(points, qhull_options="QJ")
        corners = points[hull.vertices]
        return corners, ConvexHull(corners, qhull_options="QJ")


def _most_prominent(points: Array, count: int) -> Array:
    """Return `count` of (n, 3) points: a wide tetrahedron, then each time the point farthest outside."""
    from roboyard._qhull import qhull

    ConvexHull, QhullError = qhull()

    chosen = _wide_tetrahedron(points)
    try:
        hull = ConvexHull(points[chosen], incremental=True)
    except QhullError:
        return points[chosen]
    while len(chosen) < count:
        planes = np.unique(hull.equations, axis=0)
        outside = (points @ planes[:, :3].T + planes[:, 3]).max(axis=1)
        outside[chosen] = -np.inf
        best = int(outside.argmax())
        if outside[best] <= 1e-9:
            break
        chosen.append(best)
        try:
            hull.add_points(points[best : best + 1])
        except QhullError:
            break
    hull.close()
    return points[chosen]


def _wide_tetrahedron(points: Array) -> list[int]:
    """Return four indices: an extreme, then the points farthest from it, their line and their plane."""
    first = int(points[:, 0].argmax())
    arms = points - points[first]
    second = int(np.linalg.norm(arms, axis=1).argmax())
    along = arms[second] / np.linalg.norm(arms[second])
    third = int(np.linalg.norm(np.cross(arms, along), axis=1).argmax())
    fourth = int(np.abs(arms @ np.cross(along, arms[third])).argmax())
    return [first, second, third, fourth]


def _outward(corners: Array, hull: ConvexHull) -> NDArray[np.int32]:
    """Return (m, 3) faces, counter-clockwise seen from outside."""
    faces = np.array(hull.simplices, dtype=np.int32)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return read_only(faces, np.int32)


def face_planes(mesh: TriangleMesh) -> Array:
    """Return (p, 4) outward unit normal and offset of each face with an area."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    sized = length > 1e-12 * max(float(length.max()), 1e-300)
    normal = normal[sized] / length[sized, None]
    return np.concatenate([normal, -(normal * a[sized]).sum(axis=1)[:, None]], axis=1)


def _area(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
