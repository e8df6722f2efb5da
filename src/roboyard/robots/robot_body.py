"""A robot without its controllers: joints, base frame and capabilities of a body with a definition."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import RobotDescription
from roboyard.errors import RoboyardError, unknown_name
from roboyard.robots import capabilities
from roboyard.robots.control.controller import Controller
from roboyard.robots.control.setup import Group
from roboyard.robots.definition.guides import world_guides
from roboyard.robots.definition.schema import VIRTUAL_JOINTS, RobotDefinition
from roboyard.robots.joint_arrays import Indices, JointArrays
from roboyard.robots.limits import joint_limits
from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.sim.link import Link
from roboyard.sim.world import World
from roboyard.transforms import Array, conjugate, normalized, rotate


class RobotBody:
    """A body with the capabilities that a definition gives it.

    Joint vectors are NumPy arrays in `joint_names` order: depth first, as those of `Body`.
    """

    def __init__(
        self,
        body: Body,
        definition: RobotDefinition,
        description: RobotDescription,
        *,
        model: str = "",
    ) -> None:
        """Create a robot from a body, a definition that fits it, and the body's description."""
        self.body = body
        self.definition = definition
        self.description = description
        self.model = model
        """Name of the kind of robot ("r1"); `name` is the name in the world."""
        self.joint_arrays = JointArrays(body, body.joint_names)
        """Joint state and dynamics as arrays, in `joint_names` order."""
        self.limits = joint_limits(self.joint_arrays)
        """Joint limits that controllers respect, with defaults where the file has none."""
        base = definition.base_footprint_link_name
        self.base_link: Link = body.links[0] if base is None else body.link(base)
        """The link whose frame is the robot's base frame."""
        self._add_capabilities()

    @property
    def guide_joints(self) -> tuple[str, ...]:
        """Joints by which the world guides the base of a robot on legs, root first: it moves in a plane or
        along a rail, and its root link is the world.
        """
        return world_guides(self.definition, self.description)

    def _add_capabilities(self) -> None:
        definition, block = self.definition, self.definition.manipulation
        self.manipulation = None if block is None else capabilities.Manipulation(self, block)
        self.locomotion: capabilities.Locomotion | None = None
        self.two_wheel: capabilities.TwoWheel | None = None
        if (locomotion := definition.locomotion) is not None:
            floor = locomotion.floor_touching_base_link_names
            self.locomotion = capabilities.Locomotion(self, locomotion.base_joint_names, floor)
            if definition.two_wheel is not None:
                self.two_wheel = capabilities.TwoWheel(self, definition.two_wheel, self.locomotion)
        self.trunk: capabilities.ArticulatedTrunk | None = None
        if (trunk := definition.articulated_trunk) is not None:
            self.trunk = capabilities.ArticulatedTrunk(self, "trunk", trunk.trunk_joint_names)
        self.camera: capabilities.ActiveCamera | None = None
        if (camera := definition.active_camera) is not None:
            self.camera = capabilities.ActiveCamera(self, "camera", camera.camera_joint_names)
        self.mobile_manipulation: capabilities.MobileManipulation | None = None
        if definition.mobile_manipulation is not None:
            self.mobile_manipulation = capabilities.MobileManipulation(self)
        self.base: capabilities.FixedBase
        if definition.holonomic_base is not None:
            self.base = capabilities.HolonomicBase(self)
        else:
            self.base = (
                capabilities.FixedBase(self) if self.body.is_fixed else capabilities.FloatingBase(self)
            )

    @property
    def name(self) -> str:
        """Name in the world."""
        return self.body.name

    @property
    def world(self) -> World:
        """The world that the robot is in."""
        return World.of(self.body)

    @property
    def capabilities(self) -> tuple[str, ...]:
        """Names of the capability blocks of the definition."""
        return self.definition.capabilities

    @property
    def arms(self) -> Mapping[str, capabilities.Arm]:
        """Arms by name; empty for a robot without. An unknown name raises a RoboyardError."""
        return capabilities.Arms() if self.manipulation is None else self.manipulation.arms

    @property
    def links(self) -> tuple[Link, ...]:
        """All links, the root first."""
        return self.body.links

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints, fixed ones included."""
        return self.body.joints

    def link(self, name: str) -> Link:
        """Return the link of this name.

        Raises:
            RoboyardError: there is none; the message lists the nearest.
        """
        return self.body.link(name)

    def joint(self, name: str) -> Joint:
        """Return the joint of this name.

        Raises:
            RoboyardError: there is none; the message lists the nearest.
        """
        return self.body.joint(name)

    @property
    def mass(self) -> float:
        """Mass of all links (kg)."""
        return self.body.mass

    # -------------------------------------------------------------------------------------------- controllers

    @property
    def groups(self) -> Mapping[str, Group]:
        """Group name to its joints and controller, in action order; empty without controllers."""
        return {}

    @property
    def controllers(self) -> Mapping[str, Controller]:
        """Group name to controller, in action order."""
        return {name: group.controller for name, group in self.groups.items()}

    @property
    def control_idx(self) -> dict[str, Indices]:
        """Group name to the (k,) indices of its joints in joint vectors."""
        found = {name: group.indices for name, group in self.groups.items()}
        if self.manipulation is not None and "combined" in self.manipulation.arm_control_idx:
            found["combined"] = self.manipulation.arm_control_idx["combined"]
        return found

    @property
    def action_dim(self) -> int:
        """Length of an action."""
        return sum(controller.command_dim for controller in self.controllers.values())

    @property
    def controller_action_idx(self) -> dict[str, slice]:
        """Group name to the slice of its command in an action."""
        found, start = {}, 0
        for name, controller in self.controllers.items():
            found[name] = slice(start, start + controller.command_dim)
            start += controller.command_dim
        return found

    # ------------------------------------------------------------------------------------------------- joints

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints with one degree of freedom: the order of every joint vector.

        Depth first from the root, children in file order, as in `Body.joint_names` and MuJoCo.
        """
        return self.joint_arrays.names

    @property
    def n_dof(self) -> int:
        """Length of joint vectors."""
        return len(self.joint_names)

    @property
    def joint_limits(self) -> Array:
        """(n, 2) lower and upper position limits (rad or m), ±inf for none."""
        return np.stack([self.limits.lower, self.limits.upper], axis=1)

    @property
    def joint_positions(self) -> Array:
        """(n,) joint positions (rad or m).

        Assigning (n,) values, or a mapping of joint names to values, moves the joints at once and stops them;
        values outside the joint limits are clipped, and controller goals are reset.
        """
        return self.joint_arrays.q

    @joint_positions.setter
    def joint_positions(self, values: ArrayLike | Mapping[str, float]) -> None:
        q = np.clip(
            self._joint_vector(self.joint_arrays.q, values, "joint_positions"),
            self.limits.lower,
            self.limits.upper,
        )
        self.joint_arrays.q = q
        self.joint_arrays.v = np.zeros(len(q))
        self._on_jump()

    @property
    def joint_velocities(self) -> Array:
        """(n,) joint velocities (rad/s or m/s); assign (n,) values or a mapping of joint names to values."""
        return self.joint_arrays.v

    @joint_velocities.setter
    def joint_velocities(self, values: ArrayLike | Mapping[str, float]) -> None:
        self.joint_arrays.v = self._joint_vector(self.joint_arrays.v, values, "joint_velocities")

    @property
    def joint_efforts(self) -> Array:
        """(n,) effort of the drives in the last step (N m or N)."""
        return self.joint_arrays.efforts

    def _joint_vector(self, present: Array, values: ArrayLike | Mapping[str, float], kind: str) -> Array:
        """Return `present` with new values, given for all joints or by name."""
        out = present.copy()
        if isinstance(values, Mapping):
            for name in values:
                if name not in self.joint_arrays.index:
                    raise RoboyardError(
                        f"robot {self.name!r}: {unknown_name('joint', name, self.joint_names)}"
                    )
            out[self.joint_arrays.indices_of(values)] = list(values.values())
        else:
            given = np.asarray(values, dtype=float)
            if given.shape not in ((), out.shape):
                raise RoboyardError(
                    f"robot {self.name!r}: {kind} must be {self.n_dof} numbers, got shape {given.shape}"
                )
            out[:] = given
        if not np.isfinite(out).all():
            raise RoboyardError(f"robot {self.name!r}: {kind} must be finite, got {values}")
        return out

    def _on_jump(self) -> None:
        """Reset what depends on the previous positions, after joints or base were moved at once."""

    def with_present_base(self, posture: Array) -> Array:
        """Return a posture in which virtual base joints and driven wheels keep their present positions.

        Args:
            posture: (n,) joint positions (rad or m).

        Returns:
            (n,) joint positions (rad or m).
        """
        out = posture.copy()
        kept = [name for name in VIRTUAL_JOINTS if name in self.joint_arrays.index]
        if self.two_wheel is not None and self.locomotion is not None:
            kept += self.locomotion.joint_names
        indices = self.joint_arrays.indices_of(kept)
        out[indices] = self.joint_arrays.q[indices]
        return out

    # -------------------------------------------------------------------------------------------------- base

    @property
    def pose(self) -> tuple[Array, Array]:
        """Position (3,) (m) and quaternion (4,) x, y, z, w of the base frame in the world frame."""
        return self.base_link.pose

    @property
    def position(self) -> Array:
        """(3,) position of the base frame in the world frame (m)."""
        return self.pose[0]

    @property
    def orientation(self) -> Array:
        """(4,) quaternion x, y, z, w of the base frame in the world frame."""
        return self.pose[1]

    def set_pose(self, position: ArrayLike | None = None, orientation: ArrayLike | None = None) -> None:
        """Move the base frame at once; joints other than those of the base stay, controller goals are reset.

        Args:
            position: (3,) in the world frame (m); the present one by default.
            orientation: (4,) quaternion x, y, z, w in the world frame; the present one by default.

        Raises:
            RoboyardError: a value has another shape or is not finite.
        """
        present_position, present_orientation = self.pose
        xyz = present_position if position is None else np.asarray(position, dtype=float)
        if xyz.shape != (3,) or not np.isfinite(xyz).all():
            raise RoboyardError(f"robot {self.name!r}: position must be 3 finite numbers, got {position}")
        given = present_orientation if orientation is None else np.asarray(orientation, dtype=float)
        if given.shape != (4,) or not np.isfinite(given).all():
            raise RoboyardError(
                f"robot {self.name!r}: orientation must be 4 finite numbers, got {orientation}"
            )
        self.base.set_pose(xyz, present_orientation if orientation is None else normalized(given))
        self._on_jump()

    @property
    def velocity(self) -> tuple[Array, Array]:
        """Linear (3,) (m/s) and angular (3,) (rad/s) velocity of the base frame, in world axes."""
        return self.base_link.velocity

    @property
    def velocity_in_base(self) -> tuple[Array, Array]:
        """Linear (3,) (m/s) and angular (3,) (rad/s) velocity of the base frame, in its own axes."""
        quaternion_base_world = conjugate(self.base_link.pose[1])
        linear, angular = self.base_link.velocity
        return rotate(quaternion_base_world, linear), rotate(quaternion_base_world, angular)

    def set_velocity(self, linear: ArrayLike | None = None, angular: ArrayLike | None = None) -> None:
        """Set the velocity of the base, in world axes.

        Args:
            linear: (3,) m/s; the present one by default.
            angular: (3,) rad/s; the present one by default.

        Raises:
            RoboyardError: the base is fixed, or a value has another shape or is not finite.
        """
        vectors: list[Array | None] = []
        for name, value in (("linear", linear), ("angular", angular)):
            vector = None if value is None else np.asarray(value, dtype=float)
            if vector is not None and (vector.shape != (3,) or not np.isfinite(vector).all()):
                raise RoboyardError(
                    f"robot {self.name!r}: {name} velocity must be 3 finite numbers, got {value}"
                )
            vectors.append(vector)
        self.base.set_velocity(*vectors)
