"""A link of a body in a world: its state, mass and contact properties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, Protocol

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.mass_properties import TRACE_NOTE, MassProperties, mass_properties
from roboyard.description.model import Inertial
from roboyard.sim.build.masses import write_mass
from roboyard.sim.build.planned import PlannedBody
from roboyard.sim.build.records import Built, BuiltLink
from roboyard.sim.engine import Engine
from roboyard.transforms import Array, from_wxyz


class LinkBody(Protocol):
    """The members of a `Body` that its links and joints use."""

    id: int
    name: str
    scale: float
    mujoco_ids: np.ndarray
    qpos_addresses: np.ndarray
    dof_addresses: np.ndarray
    dof_offsets: tuple[int, ...]
    joint_dofs: int
    first_dof: int
    form: Built | PlannedBody

    @property
    def built(self) -> Built:
        """The elements of the body in the spec."""
        ...

    @property
    def world(self) -> Engine[Any]:
        """The world of the body."""
        ...

    @property
    def links(self) -> Sequence[Link]:
        """All links, the root first."""
        ...

    def note_armature(self, joint: int, value: float) -> None:
        """Note the inertia of a motor (kg m² or kg) that the elements of a joint got."""
        ...


class Link:
    """One link: `pose`, `velocity`, mass and contact properties, external forces."""

    __slots__ = ("body", "index", "name")

    def __init__(self, body: LinkBody, index: int, name: str) -> None:
        self.body = body
        self.index = index
        """Index in `body.links`: 0 for the root, then depth first."""
        self.name = name

    def __repr__(self) -> str:
        return f"<Link {self.name!r} of {self.body.name!r}>"

    @property
    def _built(self) -> BuiltLink:
        """Its elements in the spec."""
        return self.body.built.links[self.index]

    @property
    def parent(self) -> Link | None:
        """The parent link; None for the root."""
        parent = self.body.form.links[self.index].parent
        return None if parent < 0 else self.body.links[parent]

    @property
    def mujoco_id(self) -> int:
        """Row of this link in MuJoCo's body arrays; changes when bodies are added or removed."""
        self.body.world.ensure_compiled()
        return int(self.body.mujoco_ids[self.index])

    # ---------------------------------------------------------------------------------------------- state

    @property
    def pose(self) -> tuple[Array, Array]:
        """Position (3,) (m) and quaternion (4,) x, y, z, w of the link frame in the world frame."""
        data = self.body.world.kinematics()
        row = self.body.mujoco_ids[self.index]
        return data.xpos[row].copy(), from_wxyz(data.xquat[row])

    @property
    def inertial_pose(self) -> tuple[Array, Array]:
        """Position (3,) (m) and quaternion (4,) x, y, z, w of the principal axes in the world frame."""
        data = self.body.world.kinematics()
        row = self.body.mujoco_ids[self.index]
        return data.xipos[row].copy(), from_wxyz(data.xiquat[row])

    @property
    def velocity(self) -> tuple[Array, Array]:
        """Linear (3,) (m/s) and angular (3,) (rad/s) velocity of the link frame in the world frame."""
        return self.body.world.object_velocity(int(self.mujoco_id), at_inertial=False)

    @property
    def com_velocity(self) -> tuple[Array, Array]:
        """Linear (3,) (m/s) velocity of the centre of mass and angular (3,) (rad/s), in the world frame."""
        return self.body.world.object_velocity(int(self.mujoco_id), at_inertial=True)

    # --------------------------------------------------------------------------------------------- inertia

    @property
    def mass(self) -> float:
        """Mass (kg) as described; 0 where the description gives none."""
        self.body.world.write_late()
        found = self._built.mass
        return 0.0 if found is None or found.note == TRACE_NOTE else found.mass

    def set_inertial(self, inertial: Inertial) -> None:
        """Replace mass, centre of mass and inertia tensor.

        Raises:
            ValueError: a number is not finite.
        """
        given = (inertial.mass, *inertial.origin.position, *inertial.origin.quaternion, *inertial.inertia)
        if not all(map(isfinite, given)):
            raise ValueError(f"link {self.name!r}: mass properties must be finite, got {inertial}")
        world = self.body.world
        world.write_late()
        world.note_edit()
        old = self._built.mass
        self._built.mass = new = mass_properties(inertial)
        write_mass(self._built.element, new)
        if not world.takes_numbers():
            return
        if old is None or not (old.mass and new.mass and _has_axes_of(new, old)):
            world.mark_stale()  # the structure of MuJoCo's model depends on it
            return
        model, row = world.live_model, self.body.mujoco_ids[self.index]
        model.body_mass[row], model.body_inertia[row] = new.mass, new.principal
        world.mark_inertia_changed()

    def set_gravity_share(self, share: float) -> None:
        """Let a share of gravity act on this link: 1 for all of it, 0 for none."""
        element, taken = self._built.element, 1.0 - share
        if element.gravcomp == taken:
            return
        world = self.body.world
        world.write_late()
        world.note_edit()
        element.gravcomp = taken
        if world.takes_numbers():
            world.live_model.body_gravcomp[self.body.mujoco_ids[self.index]] = taken
            world.mark_inertia_changed()  # MuJoCo counts such bodies with the masses

    def keep_mass(self, numbers: Array) -> None:
        """Write a (4,) mass (kg) and principal moments (kg m²), about the same axes, into the spec."""
        built = self._built
        assert built.mass is not None
        self.body.world.note_edit()
        built.mass = replace(built.mass, mass=float(numbers[0]), principal=numbers[1:].copy())
        write_mass(built.element, built.mass)

    def keep_friction(self, numbers: Array) -> None:
        """Write the (3,) coefficients of sliding, spinning and rolling friction into the spec."""
        self.body.world.note_edit()
        for geom in self._built.geoms:
            geom.friction = numbers

    # --------------------------------------------------------------------------------------------- contact

    @property
    def friction(self) -> float:
        """Sliding friction coefficient; between two links the larger one acts."""
        self.body.world.write_late()
        geoms = self._built.geoms
        return float(geoms[0].friction[0]) if geoms else 0.0

    @friction.setter
    def friction(self, value: float) -> None:
        self.set_friction(sliding=value)

    def set_friction(
        self, *, sliding: float | None = None, spinning: float | None = None, rolling: float | None = None
    ) -> None:
        """Set friction coefficients; None keeps a coefficient.

        Args:
            sliding: without unit.
            spinning: about the contact normal (m).
            rolling: about the tangents (m).

        Raises:
            ValueError: a coefficient is negative or not finite.
        """
        given = [(0, sliding), (1, spinning), (2, rolling)]
        for _, value in given:
            if value is not None and not 0 <= value < np.inf:
                raise ValueError(f"link {self.name!r}: friction must be at least 0 and finite, got {value}")
        condim = 6 if rolling else 4 if spinning else 3
        world = self.body.world
        world.write_late()
        model = world.live_model if world.takes_numbers() else None
        form = self.body.form
        if type(form) is PlannedBody:
            form.frictions.append((self.index, sliding, spinning, rolling))
            return
        for geom in self._built.geoms:
            row = geom.id
            old = (geom.friction if model is None else model.geom_friction[row]).tolist()
            values = [was if value is None else value for was, (_, value) in zip(old, given, strict=True)]
            if values != old:
                world.note_edit(is_rewritten=True)
                geom.friction = values
                if model is not None:
                    model.geom_friction[row] = values
            narrow = int(geom.condim if model is None else model.geom_condim[row])
            if narrow < condim:
                world.note_edit(is_rewritten=True)
                geom.condim = condim
                if model is not None:
                    model.geom_condim[row] = condim

    def set_frictionless(self, friction: float = 0.0) -> None:
        """Let this link slide with a friction coefficient, on all surfaces, as omnidirectional wheels do.

        Without this the larger friction of two touching links acts.

        Raises:
            ValueError: the coefficient is negative or not finite.
        """
        if not 0 <= friction < np.inf:
            raise ValueError(f"link {self.name!r}: friction must be at least 0 and finite, got {friction}")
        world = self.body.world
        world.write_late()
        world.note_edit()
        for geom in self._built.geoms:
            geom.condim, geom.priority = 3 if friction > 0 else 1, 1
            geom.friction = np.array([friction, *geom.friction[1:]])
            if world.takes_numbers():
                model, row = world.live_model, geom.id
                model.geom_condim[row], model.geom_priority[row] = geom.condim, 1
                model.geom_friction[row, 0] = friction

    def flatten_spheres(self, half_width: float) -> None:
        """Turn this link's collision spheres into ellipsoids of a half width (m) along their z axes.

        A wheel of that shape touches the floor in one point below its axle, where a cylinder touches it with
        two edges that scrub in turns.

        Raises:
            ValueError: the half width is not above 0 and finite.
        """
        from roboyard._mujoco import mujoco

        if not 0 < half_width < np.inf:
            raise ValueError(f"link {self.name!r}: half_width must be above 0 and finite, got {half_width}")

        for geom in self._built.geoms:
            if geom.type == mujoco.mjtGeom.mjGEOM_SPHERE:
                radius = geom.size[0]
                geom.type = mujoco.mjtGeom.mjGEOM_ELLIPSOID
                geom.size = [radius, radius, min(half_width, radius)]
        self.body.world.mark_stale()

    @property
    def restitution(self) -> float:
        """Coefficient of restitution, 0 to 1: speed after a bounce over speed before it."""
        return self.body.world.surfaces.restitution(self)

    @restitution.setter
    def restitution(self, value: float) -> None:
        self.body.world.surfaces.set_restitution(self, value)

    def set_damping(self, *, linear: float = 0.0, angular: float = 0.0) -> None:
        """Set the drag: force -m k v and torque -I k w, with coefficients k (1/s)."""
        self.body.world.surfaces.set_damping(self, linear, angular)

    @property
    def geom_ids(self) -> list[int]:
        """Rows of this link's collision geoms in MuJoCo's arrays."""
        self.body.world.ensure_compiled()
        return [int(geom.id) for geom in self._built.geoms]

    # ---------------------------------------------------------------------------------------------- wrench

    def apply_wrench(
        self,
        force: ArrayLike = (0, 0, 0),
        torque: ArrayLike = (0, 0, 0),
        *,
        point: ArrayLike | None = None,
        local: bool = False,
    ) -> None:
        """Apply a force and a torque during the next time step; several calls add up.

        Args:
            force: (3,) (N).
            torque: (3,) (N m).
            point: (3,) where the force acts (m). None: at the centre of mass.
            local: force, torque and point are in the link frame instead of the world frame.

        Raises:
            RoboyardError: a number is not finite.
        """
        self.body.world.wrenches.add(self, force, torque, point, local)


def _has_axes_of(new: MassProperties, old: MassProperties) -> bool:
    """Return whether two links have the same centre of mass and principal axes."""
    return (
        new.position.tolist() == old.position.tolist() and new.quaternion.tolist() == old.quaternion.tolist()
    )
