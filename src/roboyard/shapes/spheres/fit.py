"""Fit collision spheres to any mesh, for planners such as cuRobo.

The solid is sampled inside and around (`roboyard.shapes.voxels.grid`). k-means on the inside gives a start;
L-BFGS then minimises `worth * uncovered volume + excess volume + price * protruding surface` over all centres
and radii at once. Volumes are shares of the solid's, the surface is a share of all spheres'; each point
counts by a smooth step. `worth` and `price` are exchange rates: the excess that a share of coverage, or of
surface inside, may cost. `worth` starts low and is raised until the coverage suffices at separate validation
points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from roboyard._arrays import NDArray
from roboyard.errors import ConfigError, unknown_name
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import surface_points
from roboyard.shapes.spheres.growth import enclose_surface
from roboyard.shapes.spheres.objective import REACH, SphereFitObjective, Weights
from roboyard.shapes.voxels.grid import VoxelGrid, voxelize

Array = NDArray[np.float64]
Preset = Literal["balanced", "tight", "safe"]


@dataclass(frozen=True, kw_only=True, slots=True)
class SpherePreset:
    """Objectives of a sphere fit."""

    density: float
    """Number of spheres of a compact link of the size of a fist; larger and longer links get more."""
    worth: float
    """Excess volume that an equal volume of coverage may cost at the start."""
    coverage: float
    """Share of the volume below which `worth` is raised and the fit goes on."""
    surface: float
    """The same for the share of the surface that is covered within `REACH`; only where the fit chooses the
    number, since few spheres would reach it only by protruding.
    """
    excess: float
    """Excess above which a fit that chooses the number takes more spheres, if they protrude over `NEAR`: the
    walls of a hollow part are thinner than the smallest useful sphere.
    """
    bulge: float = 0.2
    """Share of the spheres' surface more than `BULGE` (with too much excess: `NEAR`) outside the solid above
    which a fit that chooses the number takes more spheres.
    """
    price: float = 1.5
    """Excess volume that may be spent for an equal share of the spheres' surface inside the solid."""
    slack: float | None = None
    """Largest distance of a surface point outside the spheres (m); None: no bound."""


PRESETS: dict[str, SpherePreset] = {
    "balanced": SpherePreset(density=6.0, worth=4.0, coverage=0.972, surface=0.965, excess=0.7),
    "tight": SpherePreset(density=12.0, worth=4.0, coverage=0.972, surface=0.965, excess=0.4),
    "safe": SpherePreset(density=12.0, worth=10.0, coverage=0.99, surface=0.98, excess=0.8, slack=0.001),
}
MAX_COUNT = 128
"""Most spheres of a fit that chooses the number."""
BULGE = 0.01
"""Distance outside the solid that planners' clearances include (m)."""
NEAR = 0.005
"""Negligible distance outside the solid (m)."""
FINE_ENOUGH = 0.015
"""Median radius below which more spheres would be finer than planners' clearances (m)."""
RAISE, RAISE_SKIN, RAISES = 1.15, 1.6, 20
"""Factors by which the worth of covered volume and surface is raised, and the most times."""
STARTS = 4
"""Number of k-means starts that are fitted coarsely; the best is refined."""
COARSE, FINE = 0.35, 0.1
"""Half-width of the smooth step / a typical radius, in the coarse and the final fit."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class SphereFit:
    """A fitted sphere set and its quality on the voxel grid (`metrics.measure_spheres` is exact)."""

    centers: Array
    """(n, 3) centres in the mesh's frame (m)."""
    radii: Array
    """(n,) radii (m)."""
    coverage: float
    """Share of the solid's volume inside a sphere."""
    surface_coverage: float
    """Share of the surface inside a sphere or within `REACH` of one."""
    protrusion: float
    """Share of all spheres' surface outside the solid."""
    excess: float
    """Volume of the spheres' union outside the solid / volume of the solid."""
    gap_mm: float
    """Largest distance from the surface to the nearest sphere (mm)."""
    notes: tuple[str, ...] = ()
    """Warnings about the mesh."""


def fit_spheres(
    meshes: TriangleMesh | Sequence[TriangleMesh],
    count: int | None = None,
    preset: Preset | SpherePreset = "balanced",
    *,
    cells: int = 60_000,
    seed: int = 0,
) -> SphereFit:
    """Fit spheres to one mesh, or to the union of several in one frame (such as those of one link).

    Open, duplicated, inconsistently wound, flat, tiny and huge meshes are supported; so are points.

    Args:
        meshes: any triangles (m).
        count: number of spheres; None chooses by size and shape.
        preset: "balanced" (high coverage, little excess), "tight" (the same with about twice the spheres),
            "safe" (no surface point more than 1 mm outside), or a preset of your own.
        cells: number of voxels of the grid; more resolve finer parts.
        seed: seed of the sampling; equal inputs give equal spheres.

    Raises:
        ConfigError: an unknown preset, or a count below 1.
        MeshError: there is no finite vertex.
    """
    goal = _resolve(preset)
    if count is not None and count < 1:
        raise ConfigError(f"count must be at least 1, or None to choose by size and shape, got {count}")
    grid = voxelize(meshes, cells=cells, fill_cavities=True)
    rng = np.random.default_rng(seed)
    skin = surface_points(meshes, 4000, rng)
    objective = SphereFitObjective.sample(grid, skin, rng)
    if count is not None:
        spheres = _solve(objective, count, replace(goal, surface=0.0))
    else:
        number = suggest_count(grid, goal)
        spheres = _solve(objective, number, goal, unless_crude=number < MAX_COUNT)
        while number < MAX_COUNT and _is_crude(objective, spheres, goal):
            number = min(2 * number, MAX_COUNT)
            spheres = _solve(objective, number, goal, unless_crude=number < MAX_COUNT)
    centers = grid.origin + spheres[:, :3] * objective.scale
    radii = spheres[:, 3] * objective.scale
    if goal.slack is not None:
        enclose_surface(meshes, np.concatenate([grid.surface_points, skin]), centers, radii, goal.slack)
    return _measured(grid, objective, centers, radii, skin)


def suggest_count(grid: VoxelGrid, goal: SpherePreset) -> int:
    """Return the number of spheres of a shape: more for long, thin, hollow and large ones; 1 for a sphere."""
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


def _is_crude(objective: SphereFitObjective, spheres: Array, goal: SpherePreset) -> bool:
    """Whether more spheres would fit better."""
    if np.median(spheres[:, 3]) * objective.scale < FINE_ENOUGH:
        return False
    near = NEAR if objective.excess(spheres) > goal.excess else BULGE
    return objective.outside(spheres, near) > goal.bulge


def _solve(
    objective: SphereFitObjective, number: int, goal: SpherePreset, *, unless_crude: bool = False
) -> Array:
    """Return (n, 4) fitted centres and radii in working units.

    Args:
        objective: the sampled solid.
        number: of spheres.
        goal: what the fit aims at.
        unless_crude: whether to return unfinished spheres once they are crude. They only grow from there
            on, to cover more, so that the finished ones would be crude, too.
    """
    starts = [objective.start(number, turn) for turn in range(1 if number == 1 else STARTS)]
    typical = float(starts[0][:, 3].mean())
    objective = objective.around(1.3 * max(float(start[:, 3].max()) for start in starts))
    weights = Weights(inner=goal.worth, skin=0.0, surface=goal.price)
    coarse = [objective.descend(start, weights, COARSE * typical, 30) for start in starts]
    best = min(coarse, key=lambda found: found[1])[0]
    spheres, _ = objective.descend(best, weights, FINE * typical, 40)
    for _ in range(RAISES):
        covers = objective.coverage(spheres) >= goal.coverage
        reaches = objective.surface_coverage(spheres) >= goal.surface
        if (covers and reaches) or (unless_crude and _is_crude(objective, spheres, goal)):
            break
        if not covers:
            weights = replace(weights, inner=RAISE * weights.inner)
        if not reaches:
            weights = replace(weights, skin=max(0.3, RAISE_SKIN * weights.skin))
        spheres, _ = objective.descend(spheres, weights, FINE * typical, 15)
    return spheres


def _measured(
    grid: VoxelGrid, objective: SphereFitObjective, centers: Array, radii: Array, skin: Array
) -> SphereFit:
    spheres = np.concatenate([(centers - grid.origin), radii[:, None]], axis=1) / objective.scale
    gap = objective.gaps(spheres, (skin - grid.origin) / objective.scale) * objective.scale
    return SphereFit(
        centers=centers,
        radii=radii,
        coverage=objective.coverage(spheres),
        surface_coverage=float((gap <= REACH).mean()),
        protrusion=objective.outside(spheres),
        excess=objective.excess(spheres),
        gap_mm=max(float(gap.max()), 0.0) * 1e3,
        notes=grid.notes,
    )
