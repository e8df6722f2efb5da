"""The soft bodies of a world: their forces in each time step, and their part in contacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.soft.damping import Damping
    from roboyard.sim.soft.forces import Call
    from roboyard.sim.soft.repulsion import Repulsion
    from roboyard.sim.soft.soft_body import SoftBody

kernels = lazy_module("roboyard.sim.soft.kernels")

_ONE_POINT = 1e-6
"""How near (m) a contact of a node is to the line along its normal, and its normal to that of its copy."""


class SoftBodies:
    """The soft bodies of one world, by body id."""

    def __init__(self, world: Engine[Body]) -> None:
        self._world = world
        self.by_id: dict[int, SoftBody] = {}
        """The soft bodies."""
        self._parts = (0.0, 0)
        self._calls: list[Call] | None = None
        self.whole_step = 0.0
        """Time (s) of the step of which the next forces are those of the first part; 0 in later parts."""
        self._repulsions: dict[int, Repulsion] = {}
        self._dampings: dict[int, Damping | None] = {}
        """Of the bodies whose damping is that of the velocities after the step."""
        self._nodes: tuple[Any, ...] | None = None
        """Arguments of `merge_contacts` that stay: elements, nodes, and how near they count as one."""
        self.has_rigid_contacts = False
        """Whether shapes touch each other in this step."""
        self._surfaces = np.zeros((0, 2), np.int32)
        self._rows: dict[str, Array] = {}
        """Results of `with_flexes`."""

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
        self._repulsions.pop(body_id, None)
        self._dampings.pop(body_id, None)
        if soft is not None:
            soft.discard()
        self._parts = (0.0, 0)

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new."""
        self._calls = self._nodes = None
        self._rows = {}

    def parts(self, timestep: float) -> int:
        """Return into how many parts a time step (s) has to be divided."""
        if self._parts[0] != timestep:
            found = [self._parts_of(soft, timestep) for soft in self.by_id.values()]
            self._parts, self._calls = (timestep, max(found, default=1)), None
        return self._parts[1]

    @property
    def _acts_at_the_end(self) -> bool:
        """Whether steps go by accelerations that may be changed once constraints are solved."""
        profile = self._world.profile
        return profile.integrator == "euler" and profile.largest_velocity is not None

    def _parts_of(self, soft: SoftBody, timestep: float) -> int:
        """Return into how many parts a body has to divide a step, and choose the kind of its damping.

        Damping by the velocities after the step needs no parts, but a system of equations is solved for it.
        """
        from roboyard.sim.soft.damping import Damping, is_possible
        from roboyard.sim.soft.stability import parts_of_step

        squared, rate = soft.fastest_rates
        count = parts_of_step(timestep, squared, rate)
        self._dampings[soft.body.id] = None
        if self._acts_at_the_end and is_possible(soft):
            fewer = parts_of_step(timestep, squared, 0.0)
            if 2 * fewer <= count:
                self._dampings[soft.body.id] = Damping(soft)
                return fewer
        return count

    def add_forces(self, model: Any, data: Any) -> None:
        """Add the forces of springs and solids to MuJoCo's passive forces, after mj_step1."""
        if self._calls is None:
            from roboyard.sim.soft.forces import force_calls

            state = data.xpos, data.qvel, data.qfrc_passive
            self._calls = [
                call
                for soft in self.by_id.values()
                for call in force_calls(
                    soft.parts, *soft.first_node, *state, is_damped=self._dampings.get(soft.body.id) is None
                )
            ]
        for function, arguments in self._calls:
            function(*arguments)
        if self._acts_at_the_end or self.whole_step == 0.0:
            return
        for soft in self.by_id.values():
            if soft.repels:
                dofs = soft.dofs
                speed = data.qvel[dofs].reshape(-1, 3).copy()
                self._repulsion_of(soft).change(model, data, self.whole_step, speed)
                force = (speed.ravel() - data.qvel[dofs]) * np.repeat(soft.masses, 3) / model.opt.timestep
                data.qfrc_passive[dofs] += force

    def change_accelerations(self, model: Any, data: Any) -> None:
        """Change accelerations by what the velocities after the step cause, once constraints are solved.

        That is strong damping, and in the first part of a step the repulsion between parts of a body.
        """
        if not self._acts_at_the_end:
            return
        timestep = model.opt.timestep
        for body_id, soft in self.by_id.items():
            damping = self._dampings.get(body_id)
            repels = soft.repels and self.whole_step > 0.0
            if damping is None and not repels:
                continue
            dofs = soft.dofs
            before = data.qvel[dofs]
            speed = (before + timestep * data.qacc[dofs]).reshape(-1, 3)
            if damping is not None:
                damping.change(model, data, timestep, speed)
            if repels:
                self._repulsion_of(soft).change(model, data, self.whole_step, speed)
            data.qacc[dofs] = (speed.ravel() - before) / timestep

    def _repulsion_of(self, soft: SoftBody) -> Repulsion:
        known = self._repulsions.get(soft.body.id)
        if known is None:
            from roboyard.sim.soft.repulsion import Repulsion

            known = self._repulsions[soft.body.id] = Repulsion(soft)
        return known

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

    def merge_contacts(self, model: Any, data: Any) -> None:
        """Give contacts with shapes at nodes to the nodes, once each, after mj_collision."""
        self.has_rigid_contacts = False
        if not data.ncon:
            return
        if self._nodes is None:
            self._nodes = (
                *(model.flex_elem, model.flex_elemdataadr, model.flex_dim, model.flex_vertadr),
                *(data.flexvert_xpos, _ONE_POINT),
            )
        c = data.contact
        rigid = kernels().merge_contacts(
            c.geom, c.flex, c.elem, c.vert, c.dist, c.pos, c.frame, c.exclude, *self._nodes
        )
        self.has_rigid_contacts = rigid > 0

    def surfaces_of(self, contact: Any, geoms: int) -> np.ndarray:
        """Return the (ncon, 2) surfaces of contacts: rows of geoms, then of flexes from `geoms` on."""
        geom = contact.geom
        if len(self._surfaces) < len(geom):
            self._surfaces = np.zeros((2 * len(geom), 2), np.int32)
        found = self._surfaces[: len(geom)]
        kernels().name_surfaces(geom, contact.flex, geoms, found)
        return found

    def with_flexes(self, name: str, rows: Array, flexes: Array | float) -> Array:
        """Return (ngeom, ...) numbers of geoms, then (nflex, ...) those of flexes.

        Args:
            name: of the numbers; the result is valid until the next call with it.
            rows: of geoms.
            flexes: of flexes.
        """
        known, count = self._rows.get(name), len(rows)
        if known is None:
            shape = count + self._world.live_model.nflex, *rows.shape[1:]
            known = self._rows[name] = np.zeros(shape)
        known[:count], known[count:] = rows, flexes
        return known

    def owner_of_flex(self) -> dict[int, int]:
        """Return the body id of each flex."""
        return {soft.flex: body_id for body_id, soft in self.by_id.items()}
