"""A soft body in a world: its nodes as NumPy arrays, its pose, and anchors."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._mujoco import mujoco
from roboyard._records import dataclass
from roboyard.errors import RoboyardError, StaleHandleError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.link import Link
from roboyard.sim.soft.build import NODE_INERTIA, SoftElements, SoftShape
from roboyard.sim.soft.rest_shape import Ints, Lattice, Solid, surface_of
from roboyard.sim.soft.skin import Skin
from roboyard.sim.soft.stability import fastest_rates
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix

if TYPE_CHECKING:
    from roboyard.shapes.mesh import TriangleMesh


@dataclass(kw_only=True, slots=True, eq=False)
class Anchor:
    """A node held at a point of a link, or of the world."""

    node: int
    link: Link | None
    """None for the world."""
    elements: tuple[Any, ...]
    """Equality and sites in the spec."""


class SoftBody:
    """A soft body; `World.add_soft_body` makes one. Its `body` has its name and id, and no joints."""

    def __init__(
        self,
        world: Engine[Body],
        body: Body,
        shape: SoftShape,
        elements: SoftElements,
        parts: tuple[Lattice | Solid, ...],
        skin: Skin,
    ) -> None:
        self._world = world
        self.body = body
        """Its entry among the bodies of the world."""
        self.masses = shape.masses
        """(n,) of the nodes (kg)."""
        self.elements: Ints = shape.elements
        """(m, 3) triangles or (m, 4) tetrahedra of nodes."""
        self.radius = shape.radius
        """Distance from the nodes at which surfaces are (m)."""
        self.repulsion = (shape.repulsion or 0.0) if shape.self_collision else 0.0
        """Stiffness (N/m) of springs that keep its parts apart."""
        self.repels = shape.self_collision and shape.repulsion is not None
        """Whether such springs act."""
        self.parts = parts
        """Its springs and tetrahedra."""
        self.anchors: list[Anchor] = []
        """The nodes that are held."""
        self.skin = skin
        """The surface that cameras see."""
        self._built = elements
        self._rest = shape.positions - np.average(shape.positions, axis=0, weights=shape.masses)
        self._drawn: tuple[Array, TriangleMesh] | None = None
        self._revision = -1
        self._row = self._dof = self._qpos = 0

    def __repr__(self) -> str:
        return f"<SoftBody {self.body.id} {self.body.name!r}: {len(self.masses)} nodes>"

    @cached_property
    def surface(self) -> Ints:
        """(m, 3) triangles of nodes on the outside."""
        return self.elements if self.elements.shape[1] == 3 else surface_of(self.elements)

    @cached_property
    def fastest_rates(self) -> tuple[float, float]:
        """Largest squared angular frequency (rad²/s²) and rate of damping (1/s) of its nodes at rest."""
        return fastest_rates(self._rest, self.masses, self.parts)

    @property
    def flex(self) -> int:
        """Row of the flex in MuJoCo's arrays."""
        self._refresh()
        return int(self._built.flex.id)

    @property
    def first_node(self) -> tuple[int, int]:
        """Row of the first node in MuJoCo's body arrays, and its first degree of freedom; others follow."""
        self._refresh()
        return self._row, self._dof

    @property
    def dofs(self) -> slice:
        """Its degrees of freedom in MuJoCo's arrays, three of each node."""
        self._refresh()
        return slice(self._dof, self._dof + 3 * len(self.masses))

    @property
    def positions(self) -> Array:
        """(n, 3) nodes in the world frame (m)."""
        self._refresh()
        return self._offsets() + self._view("qpos", self._qpos)

    @positions.setter
    def positions(self, values: ArrayLike) -> None:
        given = self._checked(values, "positions")
        self._refresh()
        self._view("qpos", self._qpos)[:] = given - self._offsets()
        self._world.mark_moved()

    @property
    def velocities(self) -> Array:
        """(n, 3) velocities of the nodes in the world frame (m/s)."""
        self._refresh()
        return self._view("qvel", self._dof).copy()

    @velocities.setter
    def velocities(self, values: ArrayLike) -> None:
        given = self._checked(values, "velocities")
        self._refresh()
        self._view("qvel", self._dof)[:] = given
        self._world.mark_moved()

    @property
    def free_masses(self) -> Array:
        """(n,) masses of the nodes (kg), 0 for those that are held to the world."""
        held = [anchor.node for anchor in self.anchors if anchor.link is None]
        masses = self.masses.copy()
        if len(held) < len(masses):
            masses[held] = 0.0
        return masses

    @property
    def pose(self) -> tuple[Array, Array]:
        """Centre of mass (3,) (m) of the free nodes, and the rotation (4,) x, y, z, w that fits them best.

        Source: S. Umeyama, "Least-squares estimation of transformation parameters", PAMI 13(4), 1991.
        """
        positions, weights = self.positions, self.free_masses
        centre = np.average(positions, axis=0, weights=weights)
        rest = self._rest - np.average(self._rest, axis=0, weights=weights)
        u, _, v = np.linalg.svd((positions - centre).T @ (weights[:, None] * rest))
        u[:, 2] *= np.sign(np.linalg.det(u @ v))
        return centre, quaternion_from_matrix(u @ v)

    def set_pose(self, position: ArrayLike, orientation: ArrayLike) -> None:
        """Move and turn the whole body as it is deformed; its nodes come to rest.

        Args:
            position: (3,) of the centre of mass (m).
            orientation: (4,) x, y, z, w.
        """
        centre, present = self.pose
        turn = matrix_from_quaternion(np.asarray(orientation)) @ matrix_from_quaternion(present).T
        self.positions = (self.positions - centre) @ turn.T + np.asarray(position, dtype=float)
        self.velocities = np.zeros_like(self._rest)

    def set_friction(self, value: float) -> None:
        """Set the sliding friction coefficient of the surface.

        Raises:
            RoboyardError: it is negative or not finite.
        """
        if not 0.0 <= value < np.inf:
            raise RoboyardError(f"soft body {self.body.name!r}: friction must be at least 0, got {value}")
        self._built.flex.friction[0] = value
        if self._world.takes_numbers():
            self._world.live_model.flex_friction[self.flex, 0] = value

    def set_mass(self, mass: float) -> None:
        """Set the mass of all nodes together (kg).

        Raises:
            RoboyardError: it is not positive or not finite.
        """
        if not 0.0 < mass < np.inf:
            raise RoboyardError(f"soft body {self.body.name!r}: mass must be positive, got {mass}")
        self.masses *= mass / self.masses.sum()
        for node, share in zip(self._built.nodes, self.masses, strict=True):
            node.mass, node.inertia = share, [share * NODE_INERTIA] * 3
        vars(self).pop("fastest_rates", None)
        self._world.mark_stale()

    def anchor(self, node: int, link: Link | None = None, position: ArrayLike | None = None) -> Anchor:
        """Hold a node at a point of a link or of the world.

        Args:
            node: index of the node.
            link: None for the world.
            position: (3,) point in the link's frame, or in the world's (m); None for where the node is now.

        Raises:
            RoboyardError: there is no such node, or the link belongs to another world.
        """
        if not 0 <= node < len(self.masses):
            raise RoboyardError(
                f"soft body {self.body.name!r} has nodes 0 to {len(self.masses) - 1}, not {node}"
            )
        if link is not None and link.body.world is not self._world:
            raise RoboyardError(f"link {link.name!r} belongs to another world; anchor to one of this world")
        spec = self._world.raw_spec
        if position is None:
            at = self.positions[node]
            if link is not None:
                origin, turned = link.pose
                at = matrix_from_quaternion(turned).T @ (at - origin)
        else:
            at = np.asarray(position, dtype=float)
        holder = spec.worldbody if link is None else link._built.element
        name = f"{self.body.name}/anchor{len(self.anchors)}-{node}"
        while spec.site(name) is not None:
            name += "'"
        first = self._built.nodes[node].add_site(name=name)
        second = holder.add_site(name=f"{name}/at", pos=at)
        equality = spec.add_equality(
            type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_SITE, name1=name, name2=f"{name}/at"
        )
        equality.solref, equality.solimp = [0.005, 1.0], [0.99, 0.999, 0.001, 0.5, 2.0]
        made = Anchor(node=node, link=link, elements=(equality, first, second))
        self.anchors.append(made)
        self._world.mark_stale()
        return made

    def release(self, anchor: Anchor) -> None:
        """Let a node go.

        Raises:
            StaleHandleError: the anchor does not exist any more.
        """
        if anchor not in self.anchors:
            raise StaleHandleError(f"soft body {self.body.name!r} does not have this anchor any more")
        self.anchors.remove(anchor)
        for element in anchor.elements:
            self._world.raw_spec.delete(element)
        self._world.mark_stale()

    def discard(self) -> None:
        """Remove anchors and surface from the spec; the world calls this before it removes the body."""
        for anchor in tuple(self.anchors):
            self.release(anchor)
        self._world.raw_spec.delete(self._built.flex)

    def drawn_mesh(self) -> TriangleMesh:
        """Return the surface that cameras see, as it is deformed now, in the frame of the body's root (m)."""
        positions = self.positions - self._world.live_model.body_pos[self._row - 1]
        if self._drawn is None or not np.array_equal(positions, self._drawn[0]):
            self._drawn = positions, self.skin.deformed(positions)
        return self._drawn[1]

    # ----------------------------------------------------------------------------------------------- arrays

    def _refresh(self) -> None:
        world = self._world
        world.ensure_compiled()
        if self._revision != world.revision:
            first = self._built.nodes[0]
            self._row = int(first.id)
            joint = int(world.live_model.body_jntadr[self._row])
            self._dof = int(world.live_model.jnt_dofadr[joint])
            self._qpos = int(world.live_model.jnt_qposadr[joint])
            self._revision = world.revision

    def _view(self, name: str, start: int) -> Array:
        """Return an (n, 3) view of the nodes' numbers in qpos or qvel."""
        values = getattr(self._world.live_data, name)
        return values[start : start + 3 * len(self.masses)].reshape(-1, 3)

    def _offsets(self) -> Array:
        """Return the (n, 3) nodes at qpos 0 in the world frame (m)."""
        model, row = self._world.live_model, self._row
        return model.body_pos[row : row + len(self.masses)] + model.body_pos[row - 1]

    def _checked(self, values: ArrayLike, what: str) -> Array:
        given = np.asarray(values, dtype=float)
        if given.shape != self._rest.shape or not np.isfinite(given).all():
            raise RoboyardError(
                f"soft body {self.body.name!r}: {what} must be finite and of shape {self._rest.shape}, "
                f"got shape {given.shape}"
            )
        return given
