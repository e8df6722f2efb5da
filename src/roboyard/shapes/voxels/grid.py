"""Filled voxel grids with signed distances from any triangles, for sphere fitting and convex splitting.

Rays through voxel centres along x, y and z find the solid. A ray votes "inside" where the triangles crossed
so far do not cancel, and abstains where it enters more often than it leaves (a hole). Two votes of three
decide. Small holes, duplicate faces, overlapping shells and missing caps do not matter; sheets, thin plates
and open shells, which have no inside, still keep the voxels that their surface passes through.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roboyard._arrays import NDArray
from roboyard.errors import MeshError
from roboyard.shapes.mesh import TriangleMesh, bounding_box
from roboyard.shapes.voxels import kernels
from roboyard.shapes.voxels.regions import label_regions

Array = NDArray[np.float64]
Triangles = tuple[Array, NDArray[np.int32]]


@dataclass(frozen=True, kw_only=True, eq=False)
class VoxelGrid:
    """A filled grid of cubic voxels in the mesh's frame."""

    origin: Array
    """(3,) lower corner of voxel (0, 0, 0) (m)."""
    size: float
    """Edge of a voxel (m)."""
    inside: NDArray[np.bool_]
    """(nx, ny, nz) voxels with centres in the solid."""
    surface: NDArray[np.bool_]
    """(nx, ny, nz) voxels that the surface passes through."""
    sdf: NDArray[np.float32]
    """(nx, ny, nz) signed distance from voxel centres to the surface, negative inside (voxels)."""
    surface_points: Array
    """(s, 3) one point of the surface in each surface voxel (m)."""
    notes: tuple[str, ...] = ()
    """Warnings about the mesh."""

    @cached_property
    def solid(self) -> NDArray[np.bool_]:
        """(nx, ny, nz) inside, plus the voxels of sheets too thin to have an inside."""
        return self.inside | self.thin

    @cached_property
    def thin(self) -> NDArray[np.bool_]:
        """(nx, ny, nz) surface voxels with no inside voxel at or beside them."""
        return self.surface & ~_grown(self.inside)

    @property
    def volume(self) -> float:
        """Volume of the solid (m³)."""
        return float(self.solid.sum()) * self.size**3

    def centers(self, mask: NDArray[np.bool_]) -> Array:
        """Return (k, 3) centres of the voxels in `mask` (m)."""
        return self.origin + (np.argwhere(mask) + 0.5) * self.size

    def distance(self, points: Array) -> Array:
        """Return (n,) signed distances at (n, 3) points, trilinear, negative inside (m)."""
        local = np.ascontiguousarray((np.asarray(points, dtype=float) - self.origin) / self.size)
        return kernels.sample_many(self.sdf, local) * self.size

    def interior_samples(self, count: int, rng: np.random.Generator) -> Array:
        """Return (k, 3) points evenly distributed in the solid (m), k about `count`.

        Empty without a solid.
        """
        cells = np.argwhere(self.inside | (self.surface & (self.sdf < 0.9)))
        if not len(cells):
            return np.zeros((0, 3))
        each = max(1, int(np.ceil(1.3 * count / len(cells))))
        if each == 1 and len(cells) > 1.6 * count:
            cells = cells[rng.choice(len(cells), int(1.6 * count), replace=False)]
        points = np.repeat(cells, each, axis=0) + rng.random((len(cells) * each, 3))
        depth: Array = kernels.sample_many(self.sdf, points)
        keep = depth < 0
        flat = np.repeat(self.thin[tuple(cells.T)], each)
        points = self.origin + points * self.size
        if flat.any():
            points = np.concatenate([points[keep & ~flat], self._thin_points()])
        else:
            points = points[keep]
        if len(points) > count:
            points = points[rng.choice(len(points), count, replace=False)]
        return points

    def surface_samples(self, count: int, rng: np.random.Generator) -> Array:
        """Return (k, 3) points of the surface (m), at most one per voxel, k at most `count`."""
        points = self.surface_points
        if len(points) <= count:
            return points
        return points[rng.choice(len(points), count, replace=False)]

    def _thin_points(self) -> Array:
        return self.surface_points[self.thin[self.surface]]


def triangles(meshes: TriangleMesh | Sequence[TriangleMesh]) -> list[Triangles]:
    """Return (n, 3) vertices and (m, 3) valid faces of each mesh.

    Raises:
        MeshError: there is no finite vertex.
    """
    listed = [meshes] if isinstance(meshes, TriangleMesh) else list(meshes)
    soups = []
    for mesh in listed:
        vertices = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
        # a copy: numba compiles loops for arrays that cannot be written once more
        faces = np.array(mesh.faces, dtype=np.int32, order="C").reshape(-1, 3)
        is_finite = bool(np.isfinite(vertices).all())  # by rows it takes ten times as long
        if is_finite and len(faces) and faces.min() >= 0 and faces.max() < len(vertices):
            soups.append((vertices, faces))
            continue
        usable: NDArray[np.bool_] = np.atleast_1d(np.isfinite(vertices).all(axis=1))
        if len(faces):
            faces = faces[((faces >= 0) & (faces < len(vertices))).all(axis=1)]
            faces = faces[usable[faces].all(axis=1)]
        if len(faces):
            soups.append((vertices, faces))
        elif usable.any():
            # points only: each becomes a triangle of zero size that marks its voxel
            lonely = np.flatnonzero(usable).astype(np.int32)
            soups.append((vertices, np.repeat(lonely[:, None], 3, axis=1)))
    if not soups:
        raise MeshError(f"no finite vertex in {len(listed)} meshes; export them again")
    return soups


def voxelize(
    meshes: TriangleMesh | Sequence[TriangleMesh],
    *,
    cells: int = 80_000,
    padding: int = 3,
    fill_cavities: bool = False,
) -> VoxelGrid:
    """Return the filled grid of one mesh, or of the union of several.

    Args:
        meshes: any triangles in one frame (m); they may be open, inconsistently wound and overlap.
        cells: approximate number of voxels; the voxel size follows from the bounding box.
        padding: empty voxels around the bounding box (at least 1).
        fill_cavities: count enclosed cavities as solid (a housing's inside).

    Raises:
        MeshError: there is no finite vertex.
    """
    soups = triangles(meshes)
    boxes = np.array([_used_bounds(vertices, faces) for vertices, faces in soups])
    lower, upper = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    size, shape = _resolution(upper - lower, cells, padding)
    # an irregular offset: rays then miss round coordinates, where many vertices are
    origin = 0.5 * (lower + upper) - 0.5 * size * shape + size * np.array([0.0137, -0.0071, 0.0233])
    inside = np.zeros(shape, dtype=bool)
    best = np.full(shape, np.inf, dtype=np.float32)
    point = np.zeros((*shape, 3))
    notes: list[str] = []
    for vertices, faces in soups:
        local = np.ascontiguousarray((vertices - origin) / size)
        kept = _without_duplicates(local, faces)
        if len(kept) < len(faces):
            notes.append(f"{len(faces) - len(kept)} duplicate faces")
        solid, note = _fill(local, kept, shape)
        inside |= solid
        if note:
            notes.append(note)
        kernels.mark_surface(local, kept, best, point)
    surface = np.isfinite(best)
    if fill_cavities:
        cavity = _enclosed(inside | surface)
        if cavity.sum() > 0.01 * inside.sum():
            inside |= cavity | (surface & _grown(cavity))
            notes.append("enclosed cavity counted as solid")
    label = kernels.nearest_seed(surface)
    sdf = np.empty(shape, dtype=np.float32)
    kernels.signed_distance(label, point, inside, sdf)
    if not inside.any():
        notes.append("no inside: open, flat or thinner than a voxel")
    return VoxelGrid(
        origin=origin,
        size=size,
        inside=inside,
        surface=surface,
        sdf=sdf,
        surface_points=origin + point[surface] * size,
        notes=tuple(dict.fromkeys(notes)),
    )


def _used_bounds(vertices: Array, faces: NDArray[np.int32]) -> Array:
    """Return the (2, 3) box around the vertices that (m, 3) faces use."""
    is_used = np.zeros(len(vertices), dtype=bool)
    is_used[faces] = True
    return bounding_box(vertices if is_used.all() else vertices[is_used])


def _resolution(extent: Array, cells: int, padding: int) -> tuple[float, NDArray[np.int64]]:
    """Return voxel size (m) and (3,) grid shape so that the padded box has about `cells` voxels."""
    longest = float(extent.max())
    if longest <= 0.0:
        return 1e-3, np.full(3, 2 * padding + 1)
    low, high = longest / 400.0, longest
    for _ in range(40):
        size = np.sqrt(low * high)
        shape = np.ceil(extent / size + 0.1).astype(int) + 2 * padding
        if shape.prod() > cells:
            low = size
        else:
            high = size
    return float(high), np.ceil(extent / high + 0.1).astype(np.int64) + 2 * padding


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (nx, ny, nz) `mask` and all voxels that touch it, corners included."""
    for axis in range(3):
        lower, upper = [slice(None)] * 3, [slice(None)] * 3
        lower[axis], upper[axis] = slice(None, -1), slice(1, None)
        wider = mask.copy()
        wider[tuple(lower)] |= mask[tuple(upper)]
        wider[tuple(upper)] |= mask[tuple(lower)]
        mask = wider
    return mask


def _enclosed(wall: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (nx, ny, nz) voxels that `wall` encloses, without regions under 27 voxels."""
    regions = np.zeros(wall.shape, dtype=np.int32)
    if label_regions(wall.view(np.uint8), regions, np.empty(wall.size, dtype=np.int64)) == 1:
        return np.zeros_like(wall)
    sizes = np.bincount(regions.ravel())
    is_enclosed = sizes >= 27
    is_enclosed[[0, regions[0, 0, 0]]] = False
    return is_enclosed[regions]


def _without_duplicates(local: Array, faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return (m, 3) faces without duplicates of either winding; (n, 3) `local` vertices in voxels."""
    corners = np.rint(local[faces] * 4096.0).astype(np.int64)
    mixed = (corners * np.array([73856093, 19349663, 83492791])).sum(axis=-1)
    mixed ^= mixed >> 17
    mixed *= 0x9E3779B97F4A7C1
    key = mixed.sum(axis=1) + (mixed >> 21).sum(axis=1) * 31
    _, first = np.unique(key, return_index=True)
    if len(first) == len(faces):
        return faces
    return np.ascontiguousarray(faces[np.sort(first)])


def _fill(
    local: Array, faces: NDArray[np.int32], shape: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], str | None]:
    """Return (nx, ny, nz) voxels inside one mesh, and a note if its faces are wound inconsistently."""
    tables = []
    counts = np.zeros(3, dtype=np.int64)
    for axis in range(3):
        rays = (shape[(axis + 1) % 3], shape[(axis + 2) % 3], shape[axis] + 1)
        signed, unsigned = np.zeros(rays, dtype=np.int16), np.zeros(rays, dtype=np.int16)
        kernels.count_crossings(local, faces, axis, shape, signed, unsigned)
        counts += kernels.closed_share(signed, unsigned)
        tables.append((signed, unsigned))
    hit, by_sign, by_parity = counts
    use_parity = bool(by_parity - by_sign > 0.1 * hit)
    votes = np.zeros(shape, dtype=np.int8)
    trusted = np.zeros(shape, dtype=np.int8)
    for axis, (signed, unsigned) in enumerate(tables):
        kernels.vote(signed, unsigned, axis, use_parity, votes, trusted)
    inside = (votes >= 2) | ((votes == 1) & (trusted == 1))
    return inside, "faces wound both ways" if use_parity else None
