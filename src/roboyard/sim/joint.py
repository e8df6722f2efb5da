"""A joint of a body in a world: its state, limits and drive."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import JointType, Limit
from roboyard.errors import RoboyardError
from roboyard.kinematics.joint_models import POSITION_SIZE, VELOCITY_SIZE
from roboyard.sim.build.joints import accepted_range
from roboyard.sim.build.planned import PlannedBody, PlannedLink
from roboyard.sim.build.records import BuiltLink
from roboyard.sim.link import Link, LinkBody
from roboyard.transforms import Array, from_wxyz, to_wxyz


class Joint:
    """One joint: `position`, `velocity`, `limits`, and its drive."""

    __slots__ = ("body", "index", "is_scalar", "limit", "name", "type")

    def __init__(
        self,
        body: LinkBody,
        index: int,
        form: BuiltLink | PlannedLink,
        kind: JointType,
        limit: Limit | None,
    ) -> None:
        self.body = body
        self.index = index
        """Index in `body.joints`: depth first; the child link's index is one more."""
        assert form.joint is not None or form.joint_elements or kind == "fixed"
        self.name = form.joint.name if form.joint is not None else form.joint_name or form.name
        self.type = kind
        self.is_scalar = kind in ("revolute", "continuous", "prismatic")
        """Whether the joint has one degree of freedom."""
        self.limit = limit
        """Limits of the description."""

    def __repr__(self) -> str:
        return f"<Joint {self.name!r} ({self.type}) of {self.body.name!r}>"

    @property
    def _built(self) -> BuiltLink:
        """The elements of the child link and of this joint in the spec."""
        return self.body.built.links[self.index + 1]

    @property
    def child(self) -> Link:
        """The child link."""
        return self.body.links[self.index + 1]

    @property
    def parent(self) -> Link:
        """The parent link."""
        return self.body.links[self.body.form.links[self.index + 1].parent]

    @property
    def axis(self) -> Array:
        """Unit axis (3,) in the child link's frame."""
        joint = self.body.form.links[self.index + 1].joint
        return np.array(joint.axis if joint is not None else self._built.joint_elements[0].axis, dtype=float)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lower and upper position limit (rad or m); None for a joint without limits."""
        joint = self.body.form.links[self.index + 1].joint
        if joint is not None:
            found = joint.position_limits()
            scale = self.body.scale if self.type == "prismatic" else 1.0
            return None if found is None else (found[0] * scale, found[1] * scale)
        if not self.is_scalar or not self._built.joint_elements:
            return None
        model = self.body.world.live_model
        row = self._built.joint_elements[0].id
        if not model.jnt_limited[row]:
            return None
        lower, upper = (float(bound) for bound in model.jnt_range[row])
        return lower, upper

    def set_limits(self, lower: float, upper: float) -> None:
        """Set position limits (rad or m) of a joint with one degree of freedom; `lower > upper` removes them.

        `limits` still returns those of the description.

        Raises:
            RoboyardError: the joint has no single position, or a limit is not a number.
        """
        from roboyard._mujoco import mujoco

        if lower != lower or upper != upper or (lower <= upper and max(abs(lower), abs(upper)) == np.inf):
            raise RoboyardError(
                f"joint {self.name!r}: limits must be finite, got {lower} and {upper}; "
                "give a lower limit above the upper one to remove them"
            )
        if not self.is_scalar or not self._built.joint_elements:
            raise RoboyardError(f"joint {self.name!r} ({self.type}) has no position limits to set")
        limited = lower <= upper
        element, world = self._built.joint_elements[0], self.body.world
        world.write_late()
        world.note_edit()
        flags = mujoco.mjtLimited
        element.limited = flags.mjLIMITED_TRUE if limited else flags.mjLIMITED_FALSE
        if limited:
            element.range = accepted_range(lower, upper)
        if world.takes_numbers():
            world.live_model.jnt_limited[element.id] = limited
            if limited:
                world.live_model.jnt_range[element.id] = lower, upper

    def limit_places(self) -> tuple[Array, ...] | None:
        """Return MuJoCo's (2,) limits for writing, if they are there now; None for a joint without any."""
        elements, world = self._built.joint_elements, self.body.world
        if not elements or not self.is_scalar:
            return None
        if world.is_stale:
            return () if elements[0].limited == 1 else None
        model, row = world.live_model, elements[0].id
        return (model.jnt_range[row],) if model.jnt_limited[row] else None

    def keep_limits(self, numbers: Array) -> None:
        """Write (2,) position limits (rad or m) of a limited joint into the spec."""
        self.body.world.note_edit()
        self._built.joint_elements[0].range = accepted_range(*numbers.tolist())

    @property
    def damping(self) -> float:
        """Joint damping of each degree of freedom (N m s/rad or N s/m)."""
        self.body.world.write_late()
        elements = self._built.joint_elements
        return float(elements[0].damping[0]) if elements else 0.0

    @damping.setter
    def damping(self, value: float) -> None:
        if not 0 <= value < np.inf:
            raise RoboyardError(f"joint {self.name!r}: damping must be at least 0 and finite, got {value}")
        world = self.body.world
        world.write_late()
        self.keep_damping((value,))
        if self._built.joint_elements and world.takes_numbers():
            world.live_model.dof_damping[self.dof_slice] = value

    def damping_places(self) -> tuple[Array, ...] | None:
        """Return MuJoCo's (n,) damping, if it is there now, for writing; None for a fixed joint."""
        if not self._built.joint_elements:
            return None
        world = self.body.world
        return () if world.is_stale else (world.live_model.dof_damping[self.dof_slice],)

    def keep_damping(self, numbers: Array | Sequence[float]) -> None:
        """Write the (1,) joint damping (N m s/rad or N s/m) into the spec."""
        self.body.world.note_edit()
        for element in self._built.joint_elements:
            element.damping = [numbers[0], 0.0, 0.0]

    @property
    def armature(self) -> float:
        """Inertia of the motor at the joint, in addition to the links' own (kg m² or kg).

        A drive without given gains may add to it; see `roboyard.sim.actuation.gains`.
        """
        form = self.body.form
        if type(form) is PlannedBody:
            return form.armatures.get(self.index, 0.0)
        elements = self._built.joint_elements
        return float(elements[0].armature) - self._built.motor_inertia if elements else 0.0

    @armature.setter
    def armature(self, value: float) -> None:
        if not 0 <= value < np.inf:
            raise RoboyardError(f"joint {self.name!r}: armature must be at least 0 and finite, got {value}")
        world, form = self.body.world, self.body.form
        if type(form) is PlannedBody:
            if VELOCITY_SIZE[self.type]:
                form.armatures[self.index] = value
            world.takes_numbers()
            return
        world.note_edit(is_rewritten=True)
        self.body.note_armature(self.index, value)
        total = value + self._built.motor_inertia
        for element in self._built.joint_elements:
            element.armature = total
        if self._built.joint_elements and world.takes_numbers():
            model, dofs = world.live_model, self.dof_slice
            model.dof_M0[dofs] += total - model.dof_armature[dofs]
            model.dof_armature[dofs] = total
            world.mark_inertia_changed()

    @property
    def qpos_slice(self) -> slice:
        """Slice of this joint's position in MuJoCo's qpos."""
        self.body.world.ensure_compiled()
        start = int(self.body.qpos_addresses[self.index])
        return slice(start, start + POSITION_SIZE[self.type])

    @property
    def dof_slice(self) -> slice:
        """Slice of this joint's velocity in MuJoCo's qvel."""
        self.body.world.ensure_compiled()
        start = int(self.body.dof_addresses[self.index])
        return slice(start, start + VELOCITY_SIZE[self.type])

    # ---------------------------------------------------------------------------------------------- state

    @property
    def position(self) -> Any:
        """Joint position (rad or m).

        Spherical joints: (4,) x, y, z, w; planar: (3,) m, m, rad; floating: (7,); fixed: ().
        """
        world = self.body.world
        world.ensure_compiled()
        if self.is_scalar:
            return float(world.live_data.qpos[self.body.qpos_addresses[self.index]])
        return _to_public(self.type, world.live_data.qpos[self.qpos_slice])

    @position.setter
    def position(self, value: ArrayLike) -> None:
        world = self.body.world
        world.ensure_compiled()
        world.live_data.qpos[self.qpos_slice] = self._finite(_from_public(self, value), "position")
        world.mark_moved()

    @property
    def velocity(self) -> Any:
        """Joint velocity (rad/s or m/s); an array for joints of several degrees of freedom."""
        world = self.body.world
        world.ensure_compiled()
        if self.is_scalar:
            return float(world.live_data.qvel[self.body.dof_addresses[self.index]])
        return world.live_data.qvel[self.dof_slice].copy()

    @velocity.setter
    def velocity(self, value: ArrayLike) -> None:
        world = self.body.world
        world.ensure_compiled()
        world.live_data.qvel[self.dof_slice] = self._finite(value, "velocity")
        world.mark_moved()

    def _finite(self, value: Any, what: str) -> Any:
        finite = math.isfinite(value) if isinstance(value, float | int) else np.isfinite(value).all()
        if not finite:
            raise RoboyardError(f"joint {self.name!r}: {what} must be finite, got {value}")
        return value

    # ---------------------------------------------------------------------------------------------- drives

    def drive_position(
        self,
        target: float,
        *,
        velocity: float = 0.0,
        stiffness: float | None = None,
        damping: float | None = None,
        max_effort: float | None = None,
    ) -> None:
        """Drive the joint towards a position until another command; see `roboyard.sim.actuation.drives`.

        Args:
            target: position (rad or m).
            velocity: target velocity (rad/s or m/s).
            stiffness: gain kp (N m/rad or N/m); by default from the joint's inertia and effort limit.
            damping: gain kd (N m s/rad or N s/m); by default critical.
            max_effort: effort limit from now on (N m or N).

        Raises:
            RoboyardError: the joint has no drive, or a value is not finite or negative.
        """
        self.body.world.drives.position(self, target, velocity, stiffness, damping, max_effort)

    def drive_velocity(
        self, target: float, *, damping: float | None = None, max_effort: float | None = None
    ) -> None:
        """Drive the joint towards a velocity until another command.

        Args:
            target: velocity (rad/s or m/s).
            damping: gain kd (N m s/rad or N s/m); by default from the joint's inertia.
            max_effort: effort limit from now on (N m or N).
        """
        self.body.world.drives.velocity(self, target, damping, max_effort)

    def drive_effort(self, effort: float) -> None:
        """Apply an effort (N m or N) until another command."""
        self.body.world.drives.effort(self, effort)

    def disable_drive(self) -> None:
        """Switch the drive off, so that the joint moves freely."""
        self.body.world.drives.disable(self)

    @property
    def applied_effort(self) -> float:
        """Effort of the drive in the last step (N m or N)."""
        return self.body.world.drives.applied(self)


def _to_public(kind: str, qpos: Array) -> Array:
    if kind == "spherical":
        return from_wxyz(qpos)
    if kind == "floating":
        return np.concatenate([qpos[:3], from_wxyz(qpos[3:])])
    return qpos.copy()


def _from_public(joint: Joint, value: ArrayLike) -> Any:
    size = POSITION_SIZE[joint.type]
    if size == 1:
        return value
    given = np.asarray(value, dtype=float)
    if given.shape != (size,):
        raise RoboyardError(
            f"joint {joint.name!r} ({joint.type}): a position has {size} numbers, got shape {given.shape}"
        )
    if joint.type == "spherical":
        return to_wxyz(given / np.linalg.norm(given))
    if joint.type == "floating":
        return np.concatenate([given[:3], to_wxyz(given[3:] / np.linalg.norm(given[3:]))])
    return given
