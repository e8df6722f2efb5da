"""Impulses between nodes and faces of one soft body, once in a time step, which keep its parts apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.soft.face_tree import face_tree, shuffled

if TYPE_CHECKING:
    from roboyard.sim.soft.soft_body import SoftBody
    from roboyard.transforms import Array

kernels = lazy_module("roboyard.sim.soft.repulsion_kernels")

_MOST_CONTACTS = 24
"""Most contacts, as a multiple of the number of faces; further ones are skipped."""


class Repulsion:
    """The repulsion between the parts of one soft body."""

    def __init__(self, soft: SoftBody) -> None:
        faces = np.ascontiguousarray(soft.surface, dtype=np.int32)
        if soft.elements.shape[1] == 3:
            faces = shuffled(faces)
        tree = face_tree(faces)
        count, nodes = len(faces), len(soft.masses)
        room = _MOST_CONTACTS * count
        self._soft = soft
        self._faces, self._children = faces, tree.children
        self._held = np.zeros(nodes, np.int32)
        self._one_sided = int(soft.elements.shape[1] == 4)
        stack = np.zeros((8 * tree.height + 16, 2), np.int32)
        tree_arrays = np.zeros((2 * count - 1, 6)), np.zeros((2 * count - 1, 3)), np.zeros(2 * count - 1)
        contact_arrays = np.zeros((room, 2), np.int32), np.zeros((room, 6)), np.zeros(room, np.int32)
        self._work = (stack, *tree_arrays, *contact_arrays)

    def change(self, model: Any, data: Any, timestep: float, speed: Array) -> int:
        """Change the velocities (n, 3) (m/s) of the nodes; return the number of contacts.

        Args:
            model: MjModel.
            data: MjData whose contacts have rows.
            timestep: of the whole step (s).
            speed: of the nodes.
        """
        soft, held = self._soft, self._held
        held[:] = 0
        if data.ncon:
            c = data.contact
            kernels().mark_held(
                *(c.geom, c.flex, c.efc_address, c.elem, c.vert, model.flex_dim, soft.flex),
                *(soft.elements, held),
            )
        for anchor in soft.anchors:
            held[anchor.node] = 1
        friction = float(model.flex_friction[soft.flex, 0]) ** 2
        return kernels().repel(
            *(self._faces, self._children, data.xpos, soft.first_node[0], soft.free_masses, held),
            *(soft.radius, soft.repulsion, friction, self._one_sided, timestep, *self._work, speed),
        )
