"""Damping of a soft body by the velocities after the step, so that strong dampers need no shorter steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.soft.rest_shape import Lattice, Solid

if TYPE_CHECKING:
    from roboyard.sim.soft.soft_body import SoftBody
    from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.soft.damping_kernels")


class Damping:
    """The dampers of one soft body, of which there is one set of springs and one of tetrahedra at most."""

    def __init__(self, soft: SoftBody) -> None:
        self._soft = soft
        count = len(soft.masses)
        springs = [part for part in soft.parts if isinstance(part, Lattice)]
        solids = [part for part in soft.parts if isinstance(part, Solid)]
        self._law: tuple[Any, ...] = (np.zeros((0, 2), np.int32), 0.0, 0)
        if springs:
            self._law = springs[0].ends, springs[0].damping, int(springs[0].damps_all_directions)
        if solids:
            material = solids[0].material
            viscosity = material.damping * material.mu, material.damping * material.lam
            self._law += (solids[0].nodes, solids[0].inverse, solids[0].volume, *viscosity)
        else:
            self._law += (np.zeros((0, 4), np.int32), np.zeros((0, 3, 3)), np.zeros(0), 0.0, 0.0)
        self._kind, self._normal = np.zeros(count, np.int32), np.zeros((count, 3))
        self._work = np.zeros((5, count, 3))

    def change(self, model: Any, data: Any, timestep: float, speed: Array) -> int:
        """Change velocities (n, 3) (m/s) without damping into those with it; return the number of rounds.

        Args:
            model: MjModel.
            data: MjData with the forces of contacts.
            timestep: s.
            speed: at the end of the step.
        """
        soft, kind = self._soft, self._kind
        kind[:] = 0
        if data.ncon:
            c = data.contact
            kernels().mark_fixed(
                *(c.geom, c.flex, c.efc_address, c.elem, c.vert, c.dim, c.frame, c.friction, data.efc_force),
                *(model.flex_dim, soft.flex, soft.elements, kind, self._normal),
            )
        for anchor in soft.anchors:
            kind[anchor.node] = kernels().FIXED
        state = data.xpos, soft.first_node[0], soft.masses, kind, self._normal
        return kernels().damp(*self._law, *state, timestep, self._work, speed)


def is_possible(soft: SoftBody) -> bool:
    """Return whether a `Damping` can be that of a soft body."""
    kinds = [type(part) for part in soft.parts]
    return len(set(kinds)) == len(kinds)
