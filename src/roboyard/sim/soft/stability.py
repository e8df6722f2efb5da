"""How short a time step has to be for the explicit forces of soft bodies to be stable."""

from __future__ import annotations

import numpy as np

from roboyard.sim.soft.forces import force_calls
from roboyard.sim.soft.rest_shape import Lattice, Solid
from roboyard.transforms import Array

SAFETY = 0.4
"""Share of the bound that is used; stiffness grows where a body is compressed."""
MOST_PARTS = 64
"""Most parts of a time step."""
_ROUNDS = 30
_SHIFT = 1e-6
"""Displacement of nodes as a share of the body's size, for differences of forces."""


def fastest_rates(positions: Array, masses: Array, parts: tuple[Lattice | Solid, ...]) -> tuple[float, float]:
    """Return the largest squared angular frequency (rad²/s²) and the largest rate of damping (1/s).

    They are the largest eigenvalues of stiffness and damping over mass at rest, by power iteration.

    Args:
        positions: (n, 3) nodes at rest (m).
        masses: (n,) (kg).
        parts: springs and tetrahedra.
    """
    place, speed = positions.copy(), np.zeros(positions.size)
    force = np.zeros(positions.size)
    calls = force_calls(parts, 0, 0, place, speed, force)
    heavy = np.repeat(masses, 3)
    size = float(np.ptp(positions, axis=0).max())

    def response(step: Array, *, moves: bool) -> Array:
        """Return minus the accelerations (3 n,) per displacement or velocity, here a unit vector."""
        scale = _SHIFT * size if moves else 1.0
        place[:] = positions + scale * step.reshape(-1, 3) if moves else positions
        speed[:] = 0.0 if moves else step
        force[:] = 0.0
        for function, arguments in calls:
            function(*arguments)
        return -force / heavy / scale

    found = []
    for moves in (True, False):
        step = np.sin(np.arange(1.0, positions.size + 1.0) ** 2)  # of all wavelengths, without numpy.random
        step /= np.linalg.norm(step)
        largest = 0.0
        for _ in range(_ROUNDS):
            step = response(step, moves=moves)
            largest = float(np.linalg.norm(step))
            if not 0.0 < largest < np.inf:
                break
            step /= largest
        found.append(largest)
    return found[0], found[1]


def parts_of_step(timestep: float, squared: float, rate: float) -> int:
    """Return into how many parts a time step (s) has to be divided.

    A semi-implicit Euler step h is stable where h² w² + 2 h d < 4.

    Args:
        timestep: of the world (s).
        squared: w², see `fastest_rates`.
        rate: d.
    """
    for count in range(1, MOST_PARTS):
        h = timestep / count
        if h * h * squared + 2 * h * rate < 4 * SAFETY:
            return count
    return MOST_PARTS
