"""Objective of sphere fits: sampled volume and surface, starts, and descent."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from roboyard._arrays import NDArray
from roboyard.shapes.sampling import box_points, fibonacci_sphere
from roboyard.shapes.spheres import kernels
from roboyard.shapes.voxels.grid import VoxelGrid

Array = NDArray[np.float64]
REACH = 0.002
"""Distance outside the spheres up to which a surface point counts as covered (m)."""
ENOUGH = 1000
"""Number of inner points from which on half are used for validation."""
TAIL = 1.0
"""Weight of uncovered points beyond the smooth step; see `kernels.volume_cost`."""
DIRECTIONS = fibonacci_sphere(48)
"""Directions in which each sphere's surface is sampled."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Weights:
    """Costs relative to a share of excess volume."""

    inner: float
    """Cost of an uncovered share of the solid's volume."""
    skin: float
    """Cost of an uncovered share of the solid's surface."""
    surface: float
    """Cost of a share of the spheres' surface outside the solid."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SphereFitObjective:
    """Sampled volume in working units: the cube root of the solid's volume is 1, the grid's origin is 0."""

    grid: VoxelGrid
    scale: float
    """Length of one working unit (m)."""
    inner: Array
    """(i, 3) points to cover."""
    skin: Array
    """(s, 3) points of the surface."""
    validation_inner: Array
    """(i, 3) points like `inner` for validation."""
    validation_skin: Array
    """(s, 3) evenly distributed surface points for validation."""
    outer: Array
    """(o, 3) points to exclude."""
    outer_volume: float
    """Volume per outer point / volume of the solid."""

    @staticmethod
    def sample(grid: VoxelGrid, surface: Array, rng: np.random.Generator) -> SphereFitObjective:
        """Sample a grid.

        Args:
            grid: the solid.
            surface: (s, 3) evenly distributed points of its surface (m).
            rng: random generator.
        """
        scale = float(np.cbrt(grid.volume))
        inner = rng.permutation(grid.interior_samples(6000, rng))
        skin = grid.surface_samples(2000, rng)
        # with few points (sheets, single points) the fit needs them all
        seen, unseen = (inner[::2], inner[1::2]) if len(inner) >= ENOUGH else (inner, inner)
        return SphereFitObjective(
            grid=grid,
            scale=scale,
            inner=(seen - grid.origin) / scale,
            skin=(skin - grid.origin) / scale,
            validation_inner=(unseen - grid.origin) / scale,
            validation_skin=(surface - grid.origin) / scale,
            outer=np.zeros((0, 3)),
            outer_volume=0.0,
        )

    def around(self, band: float, count: int = 4000) -> SphereFitObjective:
        """Return the objective with outer points no farther than `band` (working units) from the surface."""
        skin = (self.grid.surface_points - self.grid.origin) / self.scale
        lower, upper = skin.min(axis=0) - band, skin.max(axis=0) + band
        tried = box_points(lower, upper, 2 * count)
        distance = self.grid.distance(self.grid.origin + tried * self.scale) / self.scale
        kept = (distance > 0) & (distance < band)
        return replace(self, outer=tried[kept], outer_volume=float(np.prod(upper - lower)) / len(tried))

    def gaps(self, spheres: Array, points: Array) -> NDArray[np.float32]:
        """Return (p,) signed distances of (p, 3) points to the union of (n, 4) spheres."""
        px, py, pz = (np.ascontiguousarray(points[:, k], dtype=np.float32) for k in range(3))
        index, gap = np.empty(len(points), np.int32), np.empty(len(points), np.float32)
        kernels.nearest_sphere(px, py, pz, spheres.ravel(), index, gap)
        return gap

    def coverage(self, spheres: Array) -> float:
        """Return the share of the solid's volume inside (n, 4) spheres."""
        return float((self.gaps(spheres, self.validation_inner) <= 0).mean())

    def surface_coverage(self, spheres: Array) -> float:
        """Return the share of the solid's surface inside (n, 4) spheres or within `REACH` of one."""
        return float((self.gaps(spheres, self.validation_skin) <= REACH / self.scale).mean())

    def excess(self, spheres: Array) -> float:
        """Return the volume of (n, 4) spheres outside the solid / volume of the solid."""
        lower = (spheres[:, :3] - spheres[:, 3:]).min(axis=0)
        upper = (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
        points = box_points(lower, upper, 8000)
        points = points[self.gaps(spheres, points) <= 0]
        outside = self.grid.distance(self.grid.origin + points * self.scale) > 0
        return float(outside.sum() * np.prod(upper - lower) / 8000)

    def outside(self, spheres: Array, farther: float = 0.0) -> float:
        """Return the share of (n, 4) spheres' surface more than `farther` (m) outside the solid."""
        shell = spheres[:, None, :3] + spheres[:, 3, None, None] * fibonacci_sphere(96)
        gap = self.grid.distance(self.grid.origin + shell.reshape(-1, 3) * self.scale)
        share = (gap > farther).reshape(len(spheres), -1).mean(axis=1)
        area = spheres[:, 3] ** 2
        return float((share * area).sum() / area.sum())

    def start(self, number: int, turn: int = 0) -> Array:
        """Return (n, 4) centres and radii from k-means on the inner points.

        Each `turn` gives another start.
        """
        points = np.ascontiguousarray(np.roll(self.inner, -397 * turn, axis=0)[:1500])
        centers = np.empty((number, 3))
        kernels.spread_seeds(points, centers)
        label, spread = np.empty(len(points), np.int32), np.empty(number)
        kernels.cluster(points, centers, 12, label, spread)
        # a sphere of radius r has a root mean square distance of sqrt(3/5) r from its centre
        radii = np.maximum(1.29 * spread, self.floor)
        return np.concatenate([centers, radii[:, None]], axis=1)

    @property
    def unit(self) -> float:
        """Edge of a voxel in working units."""
        return self.grid.size / self.scale

    @property
    def floor(self) -> float:
        """Smallest radius in working units."""
        return 0.5 * self.unit

    def descend(self, spheres: Array, weights: Weights, step: float, rounds: int) -> tuple[Array, float]:
        """Return (n, 4) spheres improved by L-BFGS with smooth steps of half-width `step`, and their cost."""
        sets = [(self.inner, weights.inner / len(self.inner)), (self.outer, -self.outer_volume)]
        if weights.skin > 0.0:
            sets.append((self.skin, weights.skin / len(self.skin)))
        points = np.concatenate([at for at, _ in sets])
        weight = np.repeat([each for _, each in sets], [len(at) for at, _ in sets])
        px, py, pz = (np.ascontiguousarray(points[:, k], dtype=np.float32) for k in range(3))
        x = spheres.flatten()
        # without an inside no surface can be hidden
        price = weights.surface if self.grid.inside.any() else 0.0
        bounds = (self.floor, max(self.floor, 0.5 * float(np.linalg.norm(np.ptp(self.skin, axis=0)))))
        solid = (self.grid.sdf, self.unit, DIRECTIONS, price)
        cost = kernels.descend(x, px, py, pz, weight, step, TAIL, *bounds, rounds, *solid)
        return x.reshape(-1, 4), cost
