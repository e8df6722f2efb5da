"""Share of a camera's view that the robot itself blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import ArrayLike

if TYPE_CHECKING:
    from roboyard.sim.body import Body

NEAR = 0.05
"""Surfaces of the robot nearer than this block the view (m)."""
VIEW = np.deg2rad(48.0)
"""Width and height of the tested view (rad)."""
RAYS = 9
"""Number of rays along each side of the view."""
START = 0.002
"""Start of the rays in front of the lens (m)."""


def occluded_fraction(body: Body, position: ArrayLike, rotation: ArrayLike) -> float:
    """Return the share of the view, from 0 to 1, that the body itself blocks nearer than `NEAR`.

    Args:
        body: the robot that carries the camera.
        position: (3,) of the lens in the world (m).
        rotation: (3, 3) camera to world; the camera looks along its -z.
    """
    side = np.tan(VIEW / 2) * np.linspace(-1.0, 1.0, RAYS)
    x, y = (grid.ravel() for grid in np.meshgrid(side, side))
    directions = np.stack([x, y, -np.ones_like(x)], axis=1)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    world = directions @ np.asarray(rotation).T
    lens = np.asarray(position)
    from roboyard.sim.world import World

    hits = World.of(body).rays(lens + START * world, lens + NEAR * world, visual=True)
    return float((hits.owners[:, 0] == body.id).mean())
