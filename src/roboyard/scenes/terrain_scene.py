"""Uneven terrain: the random steps of PyBullet's heightfield tutorial, and smooth hills."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING, Literal

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.scenes.scene import Scene, world_or_new
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim import World

Kind = Literal["steps", "smooth"]
POINTS = 256
"""Grid points along x and along y."""
STEP_CELL, HILL_CELL = 0.3, 0.12
"""Distance of grid points (m)."""
DEFAULT_HEIGHT = {"steps": 0.5, "smooth": 1.5}
"""Default height of each kind (m)."""
FLAT_RADIUS = 1.5
"""Radius of the level area in the middle of smooth hills, for spawning (m)."""


def terrain(
    world: World | None = None, *, kind: Kind = "steps", height: float | None = None, seed: int = 10
) -> Scene:
    """Add uneven terrain of 256 by 256 points.

    Args:
        world: the world to add it to; a new one by default.
        kind: "steps": each 2 by 2 points at one random height, 0.3 m apart (77 m across). "smooth": rolling
            hills, 0.12 m apart (31 m across), level around the middle.
        height: largest height difference (m); 0.5 for steps, 1.5 for hills by default.
        seed: seed of the random numbers; equal seeds give equal terrain.

    Raises:
        RoboyardError: unknown kind, or a height below 0.
    """
    if kind not in DEFAULT_HEIGHT:
        raise RoboyardError(f'terrain: kind must be "steps" or "smooth", got {kind!r}')
    height = DEFAULT_HEIGHT[kind] if height is None else height
    if not (np.isfinite(height) and height >= 0):
        raise RoboyardError(f"terrain: height must be at least 0 m, got {height}")
    if kind == "steps":
        heights, cell = random_steps(POINTS, height, seed), STEP_CELL
    else:
        heights, cell = smooth_hills(POINTS, HILL_CELL, height, seed), HILL_CELL
    place = world_or_new(world)
    ground = place.add_heightfield(heights, cell, rgba=(0.62, 0.58, 0.46, 1.0), name="terrain")
    middle = POINTS // 2
    reach = int(np.ceil(0.6 / cell))
    top = float(heights[middle - reach : middle + reach + 1, middle - reach : middle + reach + 1].max())
    return Scene(
        name="terrain",
        world=place,
        bodies={"terrain": ground},
        spawn=(0.0, 0.0, top),
        eye=(3.2, -3.2, top + 1.9),
        target=(0.0, 0.0, top),
    )


def random_steps(points: int, height: float, seed: int) -> Array:
    """Return (points, points) heights (m), first index along x; 2 by 2 points share a height in 0..`height`.

    Numbers come from Python's generator row by row along x, as in the tutorial, so that seeds agree.
    """
    draw = random.Random(seed)
    half = points // 2
    tiles = np.array([[draw.uniform(0.0, height) for _ in range(half)] for _ in range(half)])
    return np.repeat(np.repeat(tiles, 2, axis=0), 2, axis=1).T


def smooth_hills(points: int, cell: float, height: float, seed: int) -> Array:
    """Return (points, points) heights (m), first index along x: a sum of waves of 2 to 12 m length."""
    draw = np.random.default_rng(seed)
    at = (np.arange(points) - points // 2) * cell
    x, y = np.meshgrid(at, at, indexing="ij")
    ground = np.zeros((points, points))
    for _ in range(24):
        length = np.exp(draw.uniform(np.log(2.0), np.log(12.0)))
        way, phase = draw.uniform(0, 2 * np.pi, 2)
        ground += length * np.sin(2 * np.pi / length * (x * np.cos(way) + y * np.sin(way)) + phase)
    ground -= ground.min()
    ground *= height / max(ground.max(), 1e-12)
    away = np.clip((np.hypot(x, y) - FLAT_RADIUS) / 2.0, 0.0, 1.0)
    blend = away * away * (3.0 - 2.0 * away)
    level = ground[points // 2, points // 2]
    return level + (ground - level) * blend
