"""Collision spheres for any mesh: how planners such as cuRobo want a link described.

The solid is sampled inside and around (`roboyard.shapes.voxels.grid`). k-means on the inside gives a
start; L-BFGS
then minimises `worth * uncovered volume + excess volume + price * protruding surface` over all centres and
radii at once. Volumes are shares of the solid's, the surface is a share of all the spheres'; each point
counts by a smooth step. `worth` and `price` are exchange rates: how much excess a share of coverage, or of
surface kept inside, may cost. `worth` starts low and is raised until the cover suffices, as judged at points
that the fit did not see.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from roboyard.errors import ConfigError, unknown_name
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import surface_points
from roboyard.shapes.spheres.growth import hold_surface
from roboyard.shapes.spheres.objective import REACH, SphereFitObjective, Weights
from roboyard.shapes.voxels.grid import VoxelGrid, voxelize

Array = NDArray[np.float64]
Preset = Literal["balanced", "tight", "safe"]


@dataclass(frozen=True, kw_only=True, slots=True)
class SpherePreset:
    """What a sphere set should be good at."""

    density: float
    """Spheres for a compact link of the size of a fist; larger and longer links get more."""
    worth: float
    """Excess volume that an equal volume of coverage may cost, to begin with."""
    coverage: float
    """Share of the volume below which `worth` is raised and the fit goes on."""
    surface: float
    """The same for the share of the surface that is covered within `REACH`; only where the fit may choose its
    number, since few spheres would pay for it by bulging.
    """
    excess: float
    """Above this, a fit that may choose its number takes more spheres, if they bulge by more than `NEAR`: the
    walls of a hollow part are thinner than any sphere that a planner can afford.
    """
    bulge: float = 0.2
    """Share of the spheres' surface more than `BULGE` (with too much excess: `NEAR`) outside the solid above
    which a fit that may choose its number takes more spheres.
    """
    price: float = 1.5
    """Excess volume that as large a share of the spheres' surface is worth when it is kept inside."""
    slack: float | None = None
    """Farthest that any point of the surface may lie outside; m. None: no such promise."""


PRESETS: dict[str, SpherePreset] = {
    "balanced": SpherePreset(density=6.0, worth=4.0, coverage=0.972, surface=0.965, excess=0.7),
    "tight": SpherePreset(density=12.0, worth=4.0, coverage=0.972, surface=0.965, excess=0.4),
    "safe": SpherePreset(density=12.0, worth=10.0, coverage=0.99, surface=0.98, excess=0.8, slack=0.001),
}
MAX_COUNT = 128
BULGE = 0.01
"""Distance outside the solid that planners' clearances swallow; m."""
NEAR = 0.005
"""Distance outside the solid that nobody looks at; m."""
FINE_ENOUGH = 0.015
"""Median radius below which more spheres would be finer than planners' clearances; m."""
RAISE, RAISE_SKIN, RAISES = 1.15, 1.6, 20
"""Factors by which the worth of covered volume and skin is raised until it suffices; how often at most."""
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
    skin = surface_points(meshes, 4000, rng)
    problem = SphereFitObjective.sample(grid, skin, rng)
    if count is not None:
        spheres = _solve(problem, count, replace(goal, surface=0.0))
    else:
        number = suggest_count(grid, goal)
        spheres = _solve(problem, number, goal)
        while number < MAX_COUNT and _is_crude(problem, spheres, goal):
            number = min(2 * number, MAX_COUNT)
            spheres = _solve(problem, number, goal)
    centers = grid.origin + spheres[:, :3] * problem.scale
    radii = spheres[:, 3] * problem.scale
    if goal.slack is not None:
        hold_surface(meshes, np.concatenate([grid.surface_points, skin]), centers, radii, goal.slack)
    return _judge(grid, problem, centers, radii, skin)


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


def _is_crude(problem: SphereFitObjective, spheres: Array, goal: SpherePreset) -> bool:
    """True where more spheres would serve better."""
    if np.median(spheres[:, 3]) * problem.scale < FINE_ENOUGH:
        return False
    near = NEAR if problem.excess(spheres) > goal.excess else BULGE
    return problem.outside(spheres, near) > goal.bulge


def _solve(problem: SphereFitObjective, number: int, goal: SpherePreset) -> Array:
    """(n, 4) fitted centres and radii in working units."""
    starts = [problem.start(number, turn) for turn in range(1 if number == 1 else STARTS)]
    typical = float(starts[0][:, 3].mean())
    problem = problem.around(1.3 * max(float(start[:, 3].max()) for start in starts))
    weights = Weights(inner=goal.worth, skin=0.0, surface=goal.price)
    coarse = [problem.descend(start, weights, COARSE * typical, 30) for start in starts]
    best = min(coarse, key=lambda found: found[1])[0]
    spheres, _ = problem.descend(best, weights, FINE * typical, 40)
    for _ in range(RAISES):
        covers = problem.coverage(spheres) >= goal.coverage
        reaches = problem.surface_coverage(spheres) >= goal.surface
        if covers and reaches:
            break
        if not covers:
            weights = replace(weights, inner=RAISE * weights.inner)
        if not reaches:
            weights = replace(weights, skin=max(0.3, RAISE_SKIN * weights.skin))
        spheres, _ = problem.descend(spheres, weights, FINE * typical, 15)
    return spheres


def _judge(
    grid: VoxelGrid, problem: SphereFitObjective, centers: Array, radii: Array, skin: Array
) -> SphereFit:
    spheres = np.concatenate([(centers - grid.origin), radii[:, None]], axis=1) / problem.scale
    gap = problem.gaps(spheres, (skin - grid.origin) / problem.scale) * problem.scale
    return SphereFit(
        centers=centers,
        radii=radii,
        coverage=problem.coverage(spheres),
        surface_coverage=float((gap <= REACH).mean()),
        protrusion=problem.outside(spheres),
        excess=problem.excess(spheres),
        gap_mm=max(float(gap.max()), 0.0) * 1e3,
        notes=grid.notes,
    )
