"""A body in a world: a robot or an object, its links and joints, and its state as NumPy vectors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import isfinite
from typing import Any, cast

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard._mujoco import mujoco
from roboyard.description.model import JointType, Plane, RobotDescription
from roboyard.errors import RoboyardError, StaleHandleError, unknown_name
from roboyard.sim.build.bodies import build
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.plain_bodies import build_plain
from roboyard.sim.build.planned import PlannedBody
from roboyard.sim.build.records import BodyRows, Built, BuiltLink
from roboyard.sim.engine import Engine
from roboyard.sim.joint import POSITION_SIZE, VELOCITY_SIZE, Joint
from roboyard.sim.link import Link
from roboyard.sim.pool.lone_bodies import LoneBody
from roboyard.transforms import Array, from_wxyz, normalized, rotate, to_wxyz

_NO_ADDRESSES, _NO_SCALAR = np.zeros(0, np.int32), np.zeros(0, bool)
"""Of a body without joints."""


class Body:
    """A tree of links. Joint vectors are in `joint_names` order: depth first, children in file order."""

    def __init__(
        self,
        world: Engine[Any],
        body_id: int,
        name: str,
        form: Built | PlannedBody,
        description: RobotDescription | None,
        *,
        fixed_base: bool,
        scale: float = 1.0,
    ) -> None:
        self._world: Engine[Any] | None = world
        self.id = body_id
        """Number of this body in its world; the value in segmentation images."""
        self.name = name
        self.description = description
        """None for a body of an MJCF file."""
        self.is_fixed = fixed_base
        self.scale = scale
        self.form = form
        """Its elements in the spec, or the plan of what these will be."""
        self._plan: PlannedBody | None = None
        """The plan that its elements were built from, if there was one."""
        self._plan_edits = -1
        """Edits of the spec's elements so far when they were built."""
        self.links: tuple[Link, ...] = tuple(
            Link(self, i, record.name) for i, record in enumerate(form.links)
        )
        self.joints: tuple[Joint, ...] = ()
        self.mujoco_ids = np.zeros(len(self.links), dtype=np.int32)
        """Row of each link in MuJoCo's body arrays; valid while the world is compiled."""
        self.qpos_addresses = self.dof_addresses = _NO_ADDRESSES
        self.free_qpos = -1
        """Start of the free joint in qpos; -1 for a fixed base."""
        self.free_dof = -1
        self.first_dof = -1
        """First dof of the joints (after the base's own); -1 without joints."""
        self.joint_dofs = 0
        """Number of degrees of freedom of all joints."""
        self.dof_offsets: tuple[int, ...] = ()
        """Index of each joint's first degree of freedom among those of all joints."""
        self._scalar = _NO_SCALAR
        if len(self.links) > 1:
            self._add_joints(form)
        self._geom_rows: list[list[int]] | None = None
        self._positions: slice | np.ndarray = slice(0, 0)
        self._velocities: slice | np.ndarray = slice(0, 0)

    def _add_joints(self, form: Built | PlannedBody) -> None:
        """Make the joints and the arrays of their places."""
        self.joints = tuple(
            Joint(self, i, record, _joint_type(record), record.joint.limit if record.joint else None)
            for i, record in enumerate(form.links[1:])
        )
        self.qpos_addresses = np.full(len(self.joints), -1, dtype=np.int32)
        self.dof_addresses = np.full(len(self.joints), -1, dtype=np.int32)
        self.joint_dofs = sum(VELOCITY_SIZE[joint.type] for joint in self.joints)
        self.dof_offsets = _dof_offsets(self.joints, form)
        self._scalar = np.array([joint.is_scalar for joint in self.joints], dtype=bool)

    def __repr__(self) -> str:
        driven = int(self._scalar.sum())
        return f"<Body {self.id} {self.name!r}: {len(self.links)} links, {driven} driven joints>"

    @property
    def built(self) -> Built:
        """Its elements in the spec, which it gets now where it is only planned."""
        form = self.form
        if type(form) is PlannedBody:
            self.world.build_planned()
            form = self.form
        return cast("Built", form)

    @property
    def notes(self) -> tuple[str, ...]:
        """Changes to the description that MuJoCo made necessary."""
        return tuple(self.built.notes)

    @property
    def world(self) -> Engine[Any]:
        """The world of this body; `World.of(body)` has the type `World`.

        Raises:
            StaleHandleError: the body was removed.
        """
        if self._world is None:
            raise StaleHandleError(f"body {self.name!r} was removed from its world; add it again")
        return self._world

    @property
    def is_removed(self) -> bool:
        """Whether this body was removed from its world."""
        return self._world is None

    def detach(self) -> None:
        """Mark this body as removed; the world calls this."""
        self._world = None

    # ----------------------------------------------------------------------------------------------- names

    @cached_property
    def _link_index(self) -> Mapping[str, int]:
        return {link.name: link.index for link in self.links}

    @cached_property
    def _joint_index(self) -> Mapping[str, int]:
        return {joint.name: joint.index for joint in self.joints}

    def link(self, name: str) -> Link:
        """Return the link of a name.

        Raises:
            RoboyardError: there is none; the message lists the nearest names.
        """
        if name not in self._link_index:
            raise RoboyardError(f"body {self.name!r}: {unknown_name('link', name, self._link_index)}")
        return self.links[self._link_index[name]]

    def joint(self, name: str) -> Joint:
        """Return the joint of a name.

        Raises:
            RoboyardError: there is none; the message lists the nearest names.
        """
        if name not in self._joint_index:
            raise RoboyardError(f"body {self.name!r}: {unknown_name('joint', name, self._joint_index)}")
        return self.joints[self._joint_index[name]]

    def joint_of(self, link: Link) -> Joint | None:
        """Return the joint that connects a link of this body to its parent; None for the root."""
        return None if link.index == 0 else self.joints[link.index - 1]

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints with one degree of freedom: the order of all joint vectors."""
        return tuple(joint.name for joint in self.joints if joint.is_scalar)

    # ------------------------------------------------------------------------------------------ joint vectors

    @property
    def joint_positions(self) -> Array:
        """Joint positions (n,) in `joint_names` order (rad or m)."""
        world = self.world
        world.ensure_compiled()
        return world.live_data.qpos[self._positions].copy()

    @joint_positions.setter
    def joint_positions(self, values: ArrayLike | Mapping[str, float]) -> None:
        world = self.world
        world.ensure_compiled()
        if isinstance(values, Mapping):
            for name, value in values.items():
                self.joint(name).position = value
            return
        given = np.asarray(values, dtype=float)
        if given.shape not in ((), (len(self.joint_names),)):
            raise RoboyardError(
                f"body {self.name!r} has {len(self.joint_names)} joint positions, got shape {given.shape}"
            )
        _check_finite(given, self.name, "joint positions")
        world.live_data.qpos[self._positions] = given
        world.mark_moved()

    @property
    def joint_velocities(self) -> Array:
        """Joint velocities (n,) in `joint_names` order (rad/s or m/s)."""
        world = self.world
        world.ensure_compiled()
        return world.live_data.qvel[self._velocities].copy()

    @joint_velocities.setter
    def joint_velocities(self, values: ArrayLike) -> None:
        world = self.world
        world.ensure_compiled()
        given = np.asarray(values, dtype=float)
        _check_finite(given, self.name, "joint velocities")
        world.live_data.qvel[self._velocities] = given
        world.mark_moved()

    @property
    def joint_efforts(self) -> Array:
        """(n,) effort of the drives in the last step (N m or N) in `joint_names` order; 0 without one."""
        return np.array([joint.applied_effort for joint in self.joints if joint.is_scalar], dtype=float)

    @cached_property
    def joint_limits(self) -> Array:
        """(n, 2) lower and upper limits in `joint_names` order, ±inf where there is none (rad or m)."""
        rows = [joint.limits or (-np.inf, np.inf) for joint in self.joints if joint.is_scalar]
        return np.array(rows, dtype=float).reshape(-1, 2)

    # ------------------------------------------------------------------------------------------------- base

    @property
    def pose(self) -> tuple[Array, Array]:
        """Position (3,) (m) and quaternion (4,) x, y, z, w of the root link's frame in the world frame."""
        world = self.world
        world.ensure_compiled()
        if self.free_qpos >= 0:
            qpos = world.live_data.qpos[self.free_qpos : self.free_qpos + 7]
            return qpos[:3].copy(), from_wxyz(qpos[3:])
        row = self.mujoco_ids[0]
        return world.live_model.body_pos[row].copy(), from_wxyz(world.live_model.body_quat[row])

    @property
    def position(self) -> Array:
        """Position (3,) of the root link's frame in the world frame (m)."""
        return self.pose[0]

    @property
    def orientation(self) -> Array:
        """Quaternion (4,) x, y, z, w of the root link's frame in the world frame."""
        return self.pose[1]

    @property
    def placed(self) -> tuple[Array, Array] | None:
        """`pose` (3,), (4,) while a compile is awaited, which does not change it; None at other times."""
        form, world = self.form, self.world
        if type(form) is PlannedBody:
            return form.position.copy(), from_wxyz(normalized(to_wxyz(form.quaternion)))
        if self.built.is_ground or (self.mujoco_ids[0] > 0 and not world.is_stale):
            return None
        if self.free_qpos >= 0:
            qpos = world.compiled_data.qpos[self.free_qpos : self.free_qpos + 7]
            return qpos[:3].copy(), from_wxyz(qpos[3:])
        element = self.built.links[0].element
        return np.array(element.pos), from_wxyz(normalized(element.quat))

    def set_pose(
        self,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
        *,
        keep_velocity: bool = False,
    ) -> None:
        """Move the root link's frame; joint positions stay the same.

        Args:
            position: (3,) in the world frame (m); None keeps it.
            orientation: (4,) quaternion x, y, z, w in the world frame; None keeps it.
            keep_velocity: keep the velocity of a floating base, which is set to zero otherwise.

        Raises:
            RoboyardError: the position is not finite, or the body is the fixed part of an MJCF file.
        """
        world = self.world
        xyz = None if position is None else np.asarray(position, dtype=float)
        wxyz = None
        if orientation is not None:
            x, y, z, w = normalized(orientation).tolist()
            wxyz = np.array([w, x, y, z])
        if xyz is not None and not all(map(isfinite, xyz.tolist())):
            raise RoboyardError(f"body {self.name!r}: position {xyz} is not finite")
        form = self.form
        if type(form) is PlannedBody and (xyz is None or xyz.shape == (3,)):
            form.position = form.position if xyz is None else xyz.copy()
            form.quaternion = form.quaternion if orientation is None else normalized(orientation)
            world.takes_numbers()
            return
        if self.built.is_ground:
            raise RoboyardError(f"body {self.name!r} is the fixed part of an MJCF file and cannot be moved")
        floating_and_live = self.free_qpos >= 0 and self.mujoco_ids[0] > 0
        if floating_and_live:
            world.ensure_compiled()
            qpos = world.live_data.qpos[self.free_qpos : self.free_qpos + 7]
            if xyz is not None:
                qpos[:3] = xyz
            if wxyz is not None:
                qpos[3:] = wxyz
            if not keep_velocity:
                world.live_data.qvel[self.free_dof : self.free_dof + 6] = 0.0
            world.mark_moved()
            return
        element = self.built.links[0].element
        if xyz is not None:
            element.pos = xyz
        if wxyz is not None:
            element.quat = wxyz
        if world.takes_numbers():
            row = self.mujoco_ids[0]
            if xyz is not None:
                world.live_model.body_pos[row] = xyz
            if wxyz is not None:
                world.live_model.body_quat[row] = wxyz
            world.mark_fixed_moved()
        else:
            world.is_outdated = True

    def free_base(self) -> None:
        """Free a fixed base, which then moves from its present pose, at rest, with its link's mass.

        Raises:
            RoboyardError: the base has an infinite plane, or is the fixed part of an MJCF file.
        """
        if not self.is_fixed:
            return
        root = self.built.links[0]
        if self.built.is_ground or _has_plane(root):
            raise RoboyardError(f"body {self.name!r} is infinite or part of the world and cannot move")
        self.built.free_joint = root.element.add_freejoint(name=f"{root.element.name}/free", align=0)
        self.built.dofs += 6
        self.is_fixed = False
        self.world.mark_stale()

    @property
    def velocity(self) -> tuple[Array, Array]:
        """Linear (3,) (m/s) and angular (3,) (rad/s) velocity of the root link's frame in the world frame."""
        world = self.world
        world.ensure_compiled()
        if self.free_dof < 0:
            return np.zeros(3), np.zeros(3)
        qvel = world.live_data.qvel[self.free_dof : self.free_dof + 6]
        return qvel[:3].copy(), rotate(self.pose[1], qvel[3:])

    def set_velocity(self, linear: ArrayLike | None = None, angular: ArrayLike | None = None) -> None:
        """Set the velocity of a floating base; a fixed base does not change.

        Args:
            linear: (3,) of the root link's origin in the world frame (m/s); None keeps it.
            angular: (3,) in the world frame (rad/s); None keeps it.

        Raises:
            RoboyardError: a number is not finite.
        """
        for what, given in (("linear velocity", linear), ("angular velocity", angular)):
            if given is not None:
                _check_finite(np.asarray(given, dtype=float), self.name, what)
        world = self.world
        world.ensure_compiled()
        if self.free_dof < 0:
            return
        qvel = world.live_data.qvel[self.free_dof : self.free_dof + 6]
        if linear is not None:
            qvel[:3] = linear
        if angular is not None:
            x, y, z, w = self.pose[1]
            qvel[3:] = rotate(np.array([-x, -y, -z, w]), np.asarray(angular, dtype=float))
        world.mark_moved()

    # ---------------------------------------------------------------------------------------------- measures

    @property
    def mass(self) -> float:
        """Mass of all links (kg)."""
        return float(sum(link.mass for link in self.links))

    @property
    def center_of_mass(self) -> Array:
        """Centre of mass (3,) in the world frame (m)."""
        data = self.world.kinematics()
        masses = self.world.live_model.body_mass[self.mujoco_ids]
        total = masses.sum()
        if total == 0:
            return data.xpos[self.mujoco_ids[0]].copy()
        return masses @ data.xipos[self.mujoco_ids] / total

    @property
    def bounds(self) -> Array:
        """(2, 3) bounding box of all shapes, visual ones included, in the world frame (m).

        Infinite planes count as their origin.
        """
        return self.world.bounds_of(self.mujoco_ids)

    # --------------------------------------------------------------------------------------------- life cycle

    def build(self, spec: Any, assets: MeshAssets) -> None:
        """Add the elements of this body, which was only planned, to the spec; the world calls this."""
        plan = self.form
        assert isinstance(plan, PlannedBody)
        self._plan = plan
        repeated = build_plain(spec, plan)
        if repeated is not None:
            self.form, self._plan_edits = repeated, self.world.element_edits
            return
        self.form = build(
            spec, assets, plan.description, plan.prefix, plan.position, plan.quaternion, plan.options
        )
        self.set_frictions(plan)
        for joint, armature in plan.armatures.items():
            self.joints[joint].armature = armature
        self._plan_edits = self.world.element_edits

    def set_frictions(self, plan: PlannedBody) -> None:
        """Set the coefficients of friction of a plan."""
        for link, sliding, spinning, rolling in plan.frictions:
            self.links[link].set_friction(sliding=sliding, spinning=spinning, rolling=rolling)

    @property
    def plan_of_elements(self) -> PlannedBody | None:
        """The plan that its elements agree with but for friction; None where they may not."""
        is_so = self._world is not None and self._plan_edits == self._world.element_edits
        return self._plan if is_so else None

    def note_armature(self, joint: int, value: float) -> None:
        """Note the inertia of a motor (kg m² or kg) that the elements of a joint got."""
        if self._plan is not None:
            self._plan = replace(self._plan, armatures={**self._plan.armatures, joint: value})

    def plan_now(self) -> PlannedBody | None:
        """Return the plan of which elements like the present ones can be built; None where there is none."""
        if type(self.form) is PlannedBody:
            return self.form
        if self._plan is None:
            return None
        root = self.built.links[0].element
        return self._plan.at(np.array(root.pos), from_wxyz(root.quat))

    def plan_again(self, plan: PlannedBody) -> None:
        """Let the elements be built again, of a plan."""
        self.form = plan

    def dofs_of(self, joint: int) -> slice:
        """Return the rows of a joint in qvel."""
        return self.joints[joint].dof_slice

    def take_over(self, plan: PlannedBody, built: Built) -> None:
        """Let the elements be those of another body that was built of such a plan."""
        self._plan, self.form, self._plan_edits = plan, built, self.world.element_edits

    @property
    def plan_of_tree(self) -> PlannedBody | None:
        """The plan that links and joints agree with; None where there is none, or the base was freed."""
        plan = self.form if type(self.form) is PlannedBody else self._plan
        return plan if plan is not None and plan.options.fixed_base == self.is_fixed else None

    def take_state(self, lone: LoneBody) -> None:
        """Take over velocities and joint positions from this body alone, before the world had it."""
        firsts = [
            min((int(row) for row in rows if row >= 0), default=0)
            for rows in (self.qpos_addresses, self.dof_addresses)
        ]
        lone.copy_to(self.world.live_data, self.free_dof, *firsts)

    @property
    def geom_rows(self) -> list[list[int]]:
        """Rows of the collision geoms of each link in MuJoCo's arrays, while the world is compiled."""
        if self._geom_rows is None:
            self._geom_rows = [[geom.id for geom in record.geoms] for record in self.built.links]
        return self._geom_rows

    def rows(self) -> BodyRows:
        """Return its rows in the arrays of the compiled model."""
        return BodyRows(
            links=self.mujoco_ids.copy(),
            positions=self.qpos_addresses.copy(),
            velocities=self.dof_addresses.copy(),
            free=(self.free_qpos, self.free_dof, self.first_dof),
            of_joints=(self._positions, self._velocities),
        )

    def take_rows(self, rows: BodyRows) -> None:
        """Take the rows of another body that had the same elements."""
        self._geom_rows = None
        self.mujoco_ids[:] = rows.links
        self.free_qpos, self.free_dof, self.first_dof = rows.free
        if self.joints:
            self.qpos_addresses[:], self.dof_addresses[:] = rows.positions, rows.velocities
            self._positions, self._velocities = rows.of_joints

    def refresh(self, model: Any) -> None:
        """Look up this body's rows in the arrays of a compiled model; the world calls this."""
        self._geom_rows = None
        for i, record in enumerate(self.built.links):
            self.mujoco_ids[i] = record.element.id
            if i and record.joint_elements:
                joint = record.joint_elements[0].id
                self.qpos_addresses[i - 1] = model.jnt_qposadr[joint]
                self.dof_addresses[i - 1] = model.jnt_dofadr[joint]
        if self.built.free_joint is not None:
            joint = self.built.free_joint.id
            self.free_qpos, self.free_dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        if not self.joints:
            return
        moving = self.dof_addresses[self.dof_addresses >= 0]
        self.first_dof = int(moving.min()) if len(moving) else -1
        self._positions = _as_slice(self.qpos_addresses[self._scalar])
        self._velocities = _as_slice(self.dof_addresses[self._scalar])


def _has_plane(record: BuiltLink) -> bool:
    """Return whether a fixed link has an infinite plane."""
    link = record.link
    if link is None:
        return any(geom.type == mujoco.mjtGeom.mjGEOM_PLANE for geom in (*record.geoms, *record.visuals))
    shapes = (*link.collisions, *(link.visuals if record.visuals else ()))  # reading types takes 0.04 s once
    return any(isinstance(shape.geometry, Plane) for shape in shapes)


def _dof_offsets(joints: Sequence[Joint], form: Built | PlannedBody) -> tuple[int, ...]:
    """Return the number of degrees of freedom before each joint in MuJoCo's order."""
    offsets, sum_so_far = [0] * len(joints), 0
    for k in sorted(range(len(joints)), key=lambda k: form.links[k + 1].place):
        offsets[k] = sum_so_far
        sum_so_far += VELOCITY_SIZE[joints[k].type]
    return tuple(offsets)


def _joint_type(record: Any) -> JointType:
    if record.joint is not None:
        return record.joint.type
    return record_type_of_elements(record.joint_elements)


def record_type_of_elements(elements: Sequence[Any]) -> JointType:
    """Return the joint type of a body of an MJCF file, from its MuJoCo joints."""
    from roboyard._mujoco import mujoco

    kinds = mujoco.mjtJoint
    types = [element.type for element in elements]
    if not types:
        return "fixed"
    if types == [kinds.mjJNT_BALL]:
        return "spherical"
    if types == [kinds.mjJNT_SLIDE]:
        return "prismatic"
    if types == [kinds.mjJNT_HINGE]:
        lower, upper = elements[0].range
        return "revolute" if upper > lower else "continuous"
    raise RoboyardError(f"a link must have one joint, got {len(elements)}")


def _as_slice(indices: np.ndarray) -> slice | np.ndarray:
    """Return indices as a slice where they are consecutive, which avoids copies."""
    if len(indices) and (np.diff(indices) == 1).all():
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices.astype(np.intp)


__all__ = ["POSITION_SIZE", "VELOCITY_SIZE", "Body"]


def _check_finite(numbers: Array, name: str, what: str) -> None:
    if not np.isfinite(numbers).all():
        raise RoboyardError(f"body {name!r}: {what} must be finite, got {numbers.tolist()}")
