"""Collision spheres for any mesh: how planners such as cuRobo want a link described.

The solid is sampled inside and around (`roboyard.shapes.voxels`). k-means on the inside gives a start; L-BFGS
then minimises `worth * uncovered volume + excess volume` over all centres and radii at once, both shares of
the solid's volume, each point counted by a smooth step at the surface of the spheres' union. `worth` is the
exchange rate between the two: how much excess a share of coverage may cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from roboyard.errors import ConfigError, unknown_name
from roboyard.shapes import sphere_kernels as kernels
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import box_points, fibonacci_sphere, surface_points
from roboyard.shapes.voxels import VoxelGrid, triangles, voxelize

Array = NDArray[np.float64]
Preset = Literal["balanced", "tight", "safe"]


@dataclass(frozen=True, kw_only=True, slots=True)
class SpherePreset:
    """What a sphere set should be good at."""

    density: float
    """Spheres for a compact link of the size of a fist; larger and longer links get more."""
    worth: float
    """Excess volume that an equal volume of coverage may cost."""
    coverage: float
    """Share of the volume below which `worth` is raised and the fit goes on."""
    surface: float
    """The same for the share of the surface that is covered within `REACH`."""
    excess: float
    """Above this, a fit that may choose its number takes more spheres."""
    slack: float | None = None
    """Farthest that any point of the surface may lie outside; m. None: no such promise."""


PRESETS: dict[str, SpherePreset] = {
    "balanced": SpherePreset(density=6.0, worth=3.0, coverage=0.97, surface=0.95, excess=0.7),
    "tight": SpherePreset(density=12.0, worth=3.0, coverage=0.97, surface=0.95, excess=0.4),
    "safe": SpherePreset(density=12.0, worth=10.0, coverage=0.99, surface=0.98, excess=0.8, slack=0.001),
}
MAX_COUNT = 128
REACH = 0.002
"""Distance outside the spheres at which a point of the surface still counts as covered; m."""
STARTS = 4
"""k-means starts that are fitted roughly; the best is fitted to the end."""
COARSE, FINE = 0.35, 0.1
"""Half-width of the smooth step / a typical radius, in the rough and the final fit."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SphereFit:
    """A fitted sphere set and how good it is by the voxel grid (`metrics.measure_spheres` judges exactly)."""

    centers: Array
    """(n, 3) m, in the mesh's frame."""
    radii: Array
    """(n,) m"""
    coverage: float
    """Share of the solid's volume inside a sphere."""
    surface_coverage: float
    """Share of the surface inside a sphere or within `REACH` of one."""
    protrusion: float
    """Share of all the spheres' surface that lies outside the solid."""
    excess: float
    """Volume of the spheres' union outside the solid / volume of the solid."""
    gap_mm: float
    """Largest distance from the surface to the nearest sphere."""
    notes: tuple[str, ...] = ()
    """What was unusual about the mesh."""


def fit_spheres(
    meshes: TriangleMesh | Sequence[TriangleMesh],
    count: int | None = None,
    preset: Preset | SpherePreset = "balanced",
    *,
    cells: int = 60_000,
    seed: int = 0,
) -> SphereFit:
    """Spheres that stand for one mesh, or for the union of several in one frame (as of one link).

    Open, duplicated, inconsistently wound, flat, tiny and huge meshes are all fitted; so are points.

    Args:
        meshes: vertices in metres.
        count: how many spheres; None chooses by size and shape.
        preset: "balanced" (cover well, bulge little), "tight" (the same with about twice the spheres), "safe"
            (no surface point more than 1 mm outside), or your own.
        cells: voxels of the working grid; more resolves finer parts.
        seed: of the sampling; equal inputs give equal spheres.

    Raises:
        ConfigError: an unknown preset, or a count below 1.
        MeshError: there is no finite vertex.
    """
    goal = _resolve(preset)
    if count is not None and count < 1:
        raise ConfigError(f"a sphere count of {count}: give at least 1, or None to choose by size and shape")
    grid = voxelize(meshes, cells=cells, fill_cavities=True)
    rng = np.random.default_rng(seed)
    problem = _Problem.sample(grid, rng)
    number = count if count is not None else suggest_count(grid, goal)
    spheres = _solve(problem, number, goal)
    while count is None and 2 * number <= MAX_COUNT and problem.excess(spheres) > goal.excess:
        number *= 2
        spheres = _solve(problem, number, goal)
    centers = grid.origin + spheres[:, :3] * problem.scale
    radii = spheres[:, 3] * problem.scale
    skin = surface_points(meshes, 4000, rng)
    if goal.slack is not None:
        _hold_surface(meshes, np.concatenate([grid.surface_points, skin]), centers, radii, goal.slack)
    return _judge(grid, problem, centers, radii, skin)


def _hold_surface(
    meshes: TriangleMesh | Sequence[TriangleMesh], skin: Array, centers: Array, radii: Array, slack: float
) -> None:
    """Grow `radii` in place until no surface point is more than `slack` outside the spheres."""
    kernels.grow_to_cover(skin, centers, radii, 0.6 * slack)
    corners = np.concatenate([vertices[faces] for vertices, faces in triangles(meshes)])
    finest = max(0.3 * slack, float(np.ptp(corners.reshape(-1, 3), axis=0).max()) / 1000.0)
    kernels.grow_to_hold(np.ascontiguousarray(corners), centers, radii, slack, finest)


def suggest_count(grid: VoxelGrid, goal: SpherePreset) -> int:
    """How many spheres a shape deserves: more for long, thin, hollow and large ones; 1 for a ball."""
    skin = grid.surface_points
    reach = np.linalg.norm(skin - 0.5 * (skin.min(axis=0) + skin.max(axis=0)), axis=1)
    if reach.mean() <= 0 or (reach.std() < 0.03 * reach.mean() and grid.inside.sum() > 100):
        return 1
    volume = max(grid.volume, grid.size**3)
    if grid.inside.any():
        thickness = 4.0 * float(-grid.sdf[grid.inside].mean()) * grid.size
    else:
        thickness = grid.size
    balls = max(1.0, volume / (4.0 / 3.0 * np.pi * thickness**3))
    extent = float(np.linalg.norm(skin.max(axis=0) - skin.min(axis=0)))
    number = goal.density * balls**0.3 * np.clip(extent / 0.2, 0.25, 8.0) ** 0.5
    return int(np.clip(round(number), 2, MAX_COUNT))


def _resolve(preset: str | SpherePreset) -> SpherePreset:
    if isinstance(preset, SpherePreset):
        return preset
    if preset not in PRESETS:
        raise ConfigError(unknown_name("sphere preset", preset, PRESETS))
    return PRESETS[preset]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Problem:
    """Sampled volume in working units: the cube root of the solid's volume is 1, the grid's origin is 0."""

    grid: VoxelGrid
    scale: float
    """Length of one working unit; m."""
    inner: Array
    """(i, 3) points to be covered."""
    skin: Array
    """(s, 3) points of the surface."""
    outer: Array
    """(o, 3) points to be left out."""
    outer_volume: float
    """Volume that one outer point stands for / volume of the solid."""

    @staticmethod
    def sample(grid: VoxelGrid, rng: np.random.Generator) -> _Problem:
        scale = float(np.cbrt(grid.volume))
        inner = grid.interior_samples(3000, rng)
        skin = grid.surface_samples(1500, rng)
        return _Problem(
            grid=grid,
            scale=scale,
            inner=(inner - grid.origin) / scale,
            skin=(skin - grid.origin) / scale,
            outer=np.zeros((0, 3)),
            outer_volume=0.0,
        )

    def around(self, band: float, count: int = 4000) -> _Problem:
        """The same with points outside, no farther than `band` (working units) from the surface."""
        skin = (self.grid.surface_points - self.grid.origin) / self.scale
        lower, upper = skin.min(axis=0) - band, skin.max(axis=0) + band
        tried = box_points(lower, upper, 2 * count)
        distance = self.grid.distance(self.grid.origin + tried * self.scale) / self.scale
        kept = (distance > 0) & (distance < band)
        return replace(self, outer=tried[kept], outer_volume=float(np.prod(upper - lower)) / len(tried))

    def gaps(self, spheres: Array, points: Array) -> NDArray[np.float32]:
        """(p,) signed distance to the union of (n, 4) spheres."""
        px, py, pz = (np.ascontiguousarray(points[:, k], dtype=np.float32) for k in range(3))
        index, gap = np.empty(len(points), np.int32), np.empty(len(points), np.float32)
        kernels.nearest_sphere(px, py, pz, spheres.ravel(), index, gap)
        return gap

    def coverage(self, spheres: Array) -> float:
        return float((self.gaps(spheres, self.inner) <= 0).mean())

    def surface_coverage(self, spheres: Array) -> float:
        return float((self.gaps(spheres, self.skin) <= REACH / self.scale).mean())

    def excess(self, spheres: Array) -> float:
        """Union volume outside / solid volume."""
        lower = (spheres[:, :3] - spheres[:, 3:]).min(axis=0)
        upper = (spheres[:, :3] + spheres[:, 3:]).max(axis=0)
        points = box_points(lower, upper, 8000)
        points = points[self.gaps(spheres, points) <= 0]
        outside = self.grid.distance(self.grid.origin + points * self.scale) > 0
        return float(outside.sum() * np.prod(upper - lower) / 8000)


def _start(problem: _Problem, number: int, turn: int = 0) -> Array:
    """(n, 4) centres and radii from k-means on the inner points; another `turn`, another start."""
    points = np.ascontiguousarray(np.roll(problem.inner, -397 * turn, axis=0)[:1500])
    centers = np.empty((number, 3))
    kernels.spread_seeds(points, centers)
    label, spread = np.empty(len(points), np.int32), np.empty(number)
    kernels.cluster(points, centers, 12, label, spread)
    floor = 0.5 * problem.grid.size / problem.scale
    # a ball of radius r has a root mean square distance of sqrt(3/5) r from its centre
    radii = np.maximum(1.29 * spread, floor)
    return np.concatenate([centers, radii[:, None]], axis=1)


def _solve(problem: _Problem, number: int, goal: SpherePreset) -> Array:
    """(n, 4) fitted centres and radii in working units."""
    starts = [_start(problem, number, turn) for turn in range(1 if number == 1 else STARTS)]
    typical = float(starts[0][:, 3].mean())
    problem = problem.around(1.3 * max(float(start[:, 3].max()) for start in starts))
    worth, surface_worth = goal.worth, 0.0
    coarse = [_descend(problem, start, worth, surface_worth, COARSE * typical, 30) for start in starts]
    best = min(coarse, key=lambda found: found[1])[0]
    spheres, _ = _descend(problem, best, worth, surface_worth, FINE * typical, 40)
    for _ in range(10):
        covers = problem.coverage(spheres) >= goal.coverage
        reaches = problem.surface_coverage(spheres) >= goal.surface
        if covers and reaches:
            break
        if not covers:
            worth *= 1.6
        if not reaches:
            surface_worth = max(0.15, 1.6 * surface_worth)
        spheres, _ = _descend(problem, spheres, worth, surface_worth, FINE * typical, 15)
    return spheres


def _descend(
    problem: _Problem, spheres: Array, worth: float, surface_worth: float, step: float, rounds: int
) -> tuple[Array, float]:
    """Spheres improved by L-BFGS with a smooth step of half-width `step`, and their cost."""
    points = np.concatenate([problem.inner, problem.skin, problem.outer])
    weight = np.repeat(
        [worth / len(problem.inner), surface_worth / len(problem.skin), -problem.outer_volume],
        [len(problem.inner), len(problem.skin), len(problem.outer)],
    )
    if surface_worth == 0.0:
        points, weight = points[weight != 0], weight[weight != 0]
    px, py, pz = (np.ascontiguousarray(points[:, k], dtype=np.float32) for k in range(3))
    x = spheres.flatten()
    floor = 0.5 * problem.grid.size / problem.scale
    cost = kernels.descend(x, px, py, pz, weight, step, 1.0, floor, rounds)
    return x.reshape(-1, 4), cost


def _judge(grid: VoxelGrid, problem: _Problem, centers: Array, radii: Array, skin: Array) -> SphereFit:
    spheres = np.concatenate([(centers - grid.origin), radii[:, None]], axis=1) / problem.scale
    gap = problem.gaps(spheres, (skin - grid.origin) / problem.scale) * problem.scale
    directions = fibonacci_sphere(96)
    shell = centers[:, None] + radii[:, None, None] * directions
    out = (grid.distance(shell.reshape(-1, 3)) > 0).reshape(len(radii), -1).mean(axis=1)
    return SphereFit(
        centers=centers,
        radii=radii,
        coverage=problem.coverage(spheres),
        surface_coverage=float((gap <= REACH).mean()),
        protrusion=float((out * radii**2).sum() / (radii**2).sum()),
        excess=problem.excess(spheres),
        gap_mm=max(float(gap.max()), 0.0) * 1e3,
        notes=grid.notes,
    )
