"""Uneven ground: the random steps of the well-known tutorial, and smooth hills."""

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
"""Grid points each way."""
STEP_CELL, HILL_CELL = 0.3, 0.12
"""m between grid points"""
USUAL_HEIGHT = {"steps": 0.5, "smooth": 1.5}
"""m"""
FLAT_RADIUS = 1.5
"""m around the middle where the smooth hills are level, for a robot to stand on"""


def terrain(
    world: World | None = None, *, kind: Kind = "steps", height: float | None = None, seed: int = 10
) -> Scene:
    """Uneven ground of 256 by 256 points.

    Args:
        world: where to put it; a new world by default.
        kind: "steps": each 2 by 2 points at one random height, 0.3 m apart (77 m across). "smooth": rolling
            hills, 0.12 m apart (31 m across), level around the middle.
        height: between the lowest and the highest that the ground may be, m; 0.5 for steps, 1.5 for hills.
        seed: of the random numbers; equal seeds give equal ground.

    Raises:
        RoboyardError: no such kind, or a height below 0.
    """
    if kind not in USUAL_HEIGHT:
        raise RoboyardError(f'terrain: kind is "steps" or "smooth"; got {kind!r}')
    height = USUAL_HEIGHT[kind] if height is None else height
    if not (np.isfinite(height) and height >= 0):
        raise RoboyardError(f"terrain: height is at least 0; got {height}")
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
    """(points, points) m, first index along x: 2 by 2 points share one height, uniform in 0 to `height`.

    Numbers come from Python's generator row after row along x, as in the tutorial: the same seed, the same
    ground.
    """
    draw = random.Random(seed)
    half = points // 2
    tiles = np.array([[draw.uniform(0.0, height) for _ in range(half)] for _ in range(half)])
    return np.repeat(np.repeat(tiles, 2, axis=0), 2, axis=1).T


def smooth_hills(points: int, cell: float, height: float, seed: int) -> Array:
    """(points, points) m, first index along x: a sum of waves of 2 to 12 m with amplitude as their length."""
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
