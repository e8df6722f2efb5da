"""Changing the heights of terrain at run time."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import Heightfield
from roboyard.errors import RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.build.geoms import fill_heightfield
from roboyard.sim.simulation import Simulation
from roboyard.transforms import from_wxyz, rotate


def set_heights(world: Simulation, terrain: Heightfield, heights: ArrayLike) -> None:
    """Replace the heights of terrain, in every body of a world that has it.

    Args:
        world: the world.
        terrain: a shape of a body's description; its `heights` are overwritten.
        heights: (nx, ny) like its present ones, above the shape's origin (m).

    Raises:
        RoboyardError: the shape differs, or heights are not finite.
    """
    grid = np.asarray(heights, dtype=float)
    if grid.shape != terrain.heights.shape or not np.isfinite(grid).all():
        raise RoboyardError(
            f"heights must be finite with shape {terrain.heights.shape}, got shape {grid.shape}"
        )
    sunk = float(grid.min()) - float(terrain.heights.min())
    terrain.heights.setflags(write=True)
    terrain.heights[:] = grid
    terrain.heights.setflags(write=False)
    for body in world.bodies:
        if any(held is terrain for link in body.built.links for held in link.terrains.values()):
            _follow(world, body, terrain, sunk)


def _follow(world: Simulation, body: Body, terrain: Heightfield, sunk: float) -> None:
    """Write new heights into the spec and the render shapes; `sunk` is the change of the lowest point (m)."""
    for record in body.built.links:
        for name, held in record.terrains.items():
            if held is not terrain:
                continue
            fill_heightfield(world.spec.hfield(name), terrain, body.scale)
            for geom in (*record.geoms, *record.visuals):
                if geom.hfieldname == name:
                    lift = np.array([0.0, 0.0, sunk * body.scale])
                    geom.pos = np.asarray(geom.pos) + rotate(from_wxyz(geom.quat), lift)
    world.mark_stale()
    world.render_shapes.reshape(body, terrain)
