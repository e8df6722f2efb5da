"""The calls of compiled loops that add up the forces within soft bodies."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.soft.rest_shape import Lattice, Solid

kernels = lazy_module("roboyard.sim.soft.kernels")

Call = tuple[Any, tuple[Any, ...]]
"""A compiled loop and its arguments."""


def force_calls(
    parts: Iterable[Lattice | Solid],
    row: int,
    dof: int,
    position: Any,
    velocity: Any,
    force: Any,
    *,
    is_damped: bool = True,
) -> list[Call]:
    """Return the calls that add the forces of springs and tetrahedra to `force`.

    Args:
        parts: springs and tetrahedra.
        row: of the first node in `position`.
        dof: of the first node in `velocity` and `force`.
        position: (nbody, 3) (m).
        velocity: (nv,) (m/s).
        force: (nv,) (N).
        is_damped: whether the forces of dampers are among them.
    """
    found: list[Call] = []
    for part in parts:
        if isinstance(part, Lattice):
            every = int(part.damps_all_directions)
            law = part.ends, part.length, part.stiffness, part.damping * is_damped, every
            found.append((kernels().add_spring_forces, (*law, row, dof, position, velocity, force)))
        else:
            material = part.material
            law = part.nodes, part.inverse, part.volume, material.mu, material.lam
            law += (material.damping * is_damped,)
            work = np.zeros((12, 3))
            found.append((kernels().add_solid_forces, (*law, row, dof, position, velocity, work, force)))
    return found
