"""The soft bodies of a world: their forces in each time step, and their part in contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.soft.forces import Call
    from roboyard.sim.soft.soft_body import SoftBody


class SoftBodies:
    """The soft bodies of one world, by body id."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self.by_id: dict[int, SoftBody] = {}
        """The soft bodies."""
        self._parts = (0.0, 0)
        self._calls: list[Call] | None = None

    def __bool__(self) -> bool:
        return bool(self.by_id)

    def add(self, soft: SoftBody) -> None:
        """Note a new soft body."""
        self.by_id[soft.body.id] = soft
        self._parts = (0.0, 0)

    def forget(self, body_id: int) -> None:
        """Remove what refers to a body, soft or not, that is removed."""
        for soft in self.by_id.values():
            for anchor in tuple(soft.anchors):
                if anchor.link is not None and anchor.link.body.id == body_id:
                    soft.release(anchor)
        soft = self.by_id.pop(body_id, None)
        if soft is not None:
            soft.discard()
        self._parts = (0.0, 0)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._calls = None

    def parts(self, timestep: float) -> int:
        """Return into how many parts a time step (s) has to be divided."""
        if self._parts[0] != timestep:
            from roboyard.sim.soft.stability import parts_of_step

            found = (parts_of_step(timestep, *soft.fastest_rates) for soft in self.by_id.values())
            self._parts = timestep, max(found, default=1)
        return self._parts[1]

    def add_forces(self, model: Any, data: Any) -> None:
        """Add the forces of springs and solids to MuJoCo's passive forces, after mj_step1."""
        if self._calls is None:
            from roboyard.sim.soft.forces import force_calls

            state = data.xpos, data.qvel, data.qfrc_passive
            self._calls = [
                call
                for soft in self.by_id.values()
                for call in force_calls(soft.parts, *soft.first_node, *state)
            ]
        for function, arguments in self._calls:
            function(*arguments)

    def rows_without_push(self, model: Any, contact: Any) -> np.ndarray:
        """Return the first rows (k,) of contacts between a link and elements of which it holds a node.

        These elements move with the link.
        """
        found = []
        for soft in self.by_id.values():
            holders = [(a.node, a.link) for a in soft.anchors if a.link is not None]
            if not holders:
                continue
            of_flex = contact.flex == soft.flex
            rows = np.flatnonzero(of_flex.any(axis=1) & (contact.geom >= 0).any(axis=1))
            side = of_flex[rows].argmax(axis=1)
            body = model.geom_bodyid[contact.geom[rows, 1 - side]]
            element, vertex = contact.elem[rows, side], contact.vert[rows, side]
            for node, link in holders:
                touches = np.where(element >= 0, (soft.elements == node).any(axis=1)[element], vertex == node)
                found.append(rows[touches & (body == link.body.mujoco_ids[link.index])])
        if not found:
            return np.zeros(0, dtype=np.intp)
        address = contact.efc_address[np.unique(np.concatenate(found))]
        return address[address >= 0]

    def surfaces_of(self, contact: Any, geoms: int) -> np.ndarray:
        """Return the (ncon, 2) surfaces of contacts: rows of geoms, then of flexes from `geoms` on."""
        return np.where(contact.geom >= 0, contact.geom, contact.flex + geoms).astype(np.int32)

    def with_flexes(self, rows: Array, flexes: Array | float) -> Array:
        """Return (ngeom, ...) numbers of geoms, then (nflex, ...) those of flexes."""
        count = self._world.live_model.nflex
        more = np.broadcast_to(flexes, (count, *rows.shape[1:]))
        return np.concatenate([rows, more])

    def owner_of_flex(self) -> dict[int, int]:
        """Return the body id of each flex."""
        return {soft.flex: body_id for body_id, soft in self.by_id.items()}
