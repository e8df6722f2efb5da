"""How much of a camera's view the robot itself blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from roboyard.sim.body import Body

NEAR = 0.05
"""m: the robot's own surface nearer than this blocks the view"""
VIEW = np.deg2rad(48.0)
"""rad: width and height of the view that is looked at"""
RAYS = 9
"""A side"""
START = 0.002
"""m in front of the lens"""


def occluded_fraction(body: Body, position: ArrayLike, rotation: ArrayLike) -> float:
    """Share of the view, from 0 to 1, in which a body itself is nearer than `NEAR`.

    Args:
        body: the robot that carries the camera.
        position: (3,) of the lens in the world; m.
        rotation: (3, 3) camera to world; it looks along its -z.
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
