"""Measure how well a set of spheres approximates a mesh, by an exact inside test.

Coverage, protrusion and gap are defined as in cuRobo's documentation of sphere fits; excess is added because
protrusion also counts sphere surface inside another sphere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard._arrays import ArrayLike, NDArray
from roboyard._numba import njit
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import fibonacci_sphere, surface_points
from roboyard.shapes.voxels.grid import triangles

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, slots=True)
class SphereMetrics:
    """Quality of a sphere set; shares are from 0 to 1."""

    coverage: float
    """Share of the solid's volume inside a sphere."""
    surface_coverage: float
    """Share of the mesh's surface inside a sphere."""
    protrusion: float
    """Share of all spheres' surface outside the solid."""
    mean_protrusion_mm: float
    """Mean distance of that surface from the mesh (mm)."""
    max_gap_mm: float
    """Largest distance from the mesh's surface to the nearest sphere (mm)."""
    excess: float
    """Volume of the spheres' union outside the solid / volume of the solid."""


@njit(cache=True, nogil=True)
def winding_numbers(vertices, faces, points):
    """Return the (n,) winding numbers of (n, 3) points: 1 inside, 0 outside, between for open meshes.

    Source: solid angle of a triangle, Van Oosterom and Strackee (1983).
    """
    out = np.zeros(points.shape[0])
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        total = 0.0
        for f in range(faces.shape[0]):
            ia, ib, ic = faces[f, 0], faces[f, 1], faces[f, 2]
            ax, ay, az = vertices[ia, 0] - px, vertices[ia, 1] - py, vertices[ia, 2] - pz
            bx, by, bz = vertices[ib, 0] - px, vertices[ib, 1] - py, vertices[ib, 2] - pz
            cx, cy, cz = vertices[ic, 0] - px, vertices[ic, 1] - py, vertices[ic, 2] - pz
            a = math.sqrt(ax * ax + ay * ay + az * az)
            b = math.sqrt(bx * bx + by * by + bz * bz)
            c = math.sqrt(cx * cx + cy * cy + cz * cz)
            det = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
            ab, bc, ca = ax * bx + ay * by + az * bz, bx * cx + by * cy + bz * cz, cx * ax + cy * ay + cz * az
            total += math.atan2(det, a * b * c + ab * c + bc * a + ca * b)
        out[i] = total / (2.0 * math.pi)
    return out


def contains(meshes: TriangleMesh | Sequence[TriangleMesh], points: ArrayLike) -> NDArray[np.bool_]:
    """Return (n,) bool: whether (n, 3) points (m) are in the union of the meshes, of either winding.

    Exact for closed meshes; for open ones a point is inside where the surface covers over half its solid
    angle.
    """
    at = np.ascontiguousarray(points, dtype=np.float64)
    inside = np.zeros(len(at), dtype=bool)
    for vertices, faces in triangles(meshes):
        inside |= np.abs(winding_numbers(vertices, faces, at)) > 0.5
    return inside


def gap_to_spheres(points: ArrayLike, centers: ArrayLike, radii: ArrayLike) -> Array:
    """Return (n,) signed distances from (n, 3) points to the union of spheres, exact outside it (m)."""
    at, middle = np.asarray(points, dtype=float), np.asarray(centers, dtype=float)
    out = np.full(len(at), np.inf)
    for center, radius in zip(middle, np.asarray(radii, dtype=float), strict=True):
        np.minimum(out, np.linalg.norm(at - center, axis=1) - radius, out=out)
    return out


def measure_spheres(
    meshes: TriangleMesh | Sequence[TriangleMesh],
    centers: ArrayLike,
    radii: ArrayLike,
    *,
    samples: int = 6000,
    seed: int = 0,
) -> SphereMetrics:
    """Measure spheres ((n, 3) centres and (n,) radii, m) against meshes in the same frame.

    Monte Carlo with `samples` points for each figure and an exact inside test (slow on large meshes). Meshes
    without volume have coverage and excess by surface: share of surface covered, and union volume / 1e-9 m³.
    """
    from scipy.spatial import KDTree

    middle = np.asarray(centers, dtype=float).reshape(-1, 3)
    radius = np.asarray(radii, dtype=float).reshape(-1)
    rng = np.random.default_rng(seed)
    corners = np.concatenate([vertices[faces.ravel()] for vertices, faces in triangles(meshes)])
    lower, upper = corners.min(axis=0), corners.max(axis=0)

    tried = rng.uniform(lower, upper, (4 * samples, 3))
    inner = tried[contains(meshes, tried)]
    box_volume = float(np.prod(upper - lower))
    volume = box_volume * len(inner) / len(tried)
    inner = inner[:samples]

    outer_low = np.min(middle - radius[:, None], axis=0)
    outer_high = np.max(middle + radius[:, None], axis=0)
    near = rng.uniform(outer_low, outer_high, (4 * samples, 3))
    in_union = near[gap_to_spheres(near, middle, radius) < 0]
    cell = float(np.prod(outer_high - outer_low)) / len(near)
    outside_volume = cell * float((~contains(meshes, in_union)).sum())

    skin = surface_points(meshes, samples, rng)
    gap = gap_to_spheres(skin, middle, radius)
    each = np.maximum(16, (samples * radius**2 / (radius**2).sum()).astype(int))
    shell = np.concatenate(
        [c + r * fibonacci_sphere(k) for c, r, k in zip(middle, radius, each, strict=True)]
    )
    weight = np.concatenate([np.full(k, r * r / k) for r, k in zip(radius, each, strict=True)])
    out = ~contains(meshes, shell)
    dense = surface_points(meshes, 20_000, rng)
    depth = KDTree(dense).query(shell[out])[0] if out.any() else np.zeros(1)
    covered = gap_to_spheres(inner, middle, radius) <= 0 if len(inner) else gap <= 0
    return SphereMetrics(
        coverage=float(covered.mean()),
        surface_coverage=float((gap <= 0).mean()),
        protrusion=float(weight[out].sum() / weight.sum()),
        mean_protrusion_mm=float(depth.mean() * 1e3),
        max_gap_mm=float(max(gap.max(), 0.0) * 1e3),
        excess=outside_volume / max(volume, 1e-9),
    )
