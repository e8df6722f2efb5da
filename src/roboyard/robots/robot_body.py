"""A robot as a body: its joints, place and parts, read and set under the names of its definition."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from roboyard.description.model import RobotDescription
from roboyard.errors import RoboyardError
from roboyard.kinematics.joint_order import breadth_first_joint_names
from roboyard.robots import capabilities
from roboyard.robots.backends import Backend, as_backend, as_numpy
from roboyard.robots.definition.schema import VIRTUAL_JOINTS, RobotDefinition
from roboyard.robots.joint_arrays import JointArrays
from roboyard.robots.limits import joint_limits
from roboyard.sim.body import Body
from roboyard.sim.link import Link
from roboyard.sim.world import World
from roboyard.transforms import Array, conjugate, normalized, rotate

if TYPE_CHECKING:
    from roboyard.robots.control.setup import Group


class RobotBody:
    """What a robot is without its controllers. Joint vectors are in `joint_names` order: level by level from
    the root.

    Values come as NumPy arrays, or as torch tensors with `backend="torch"`.
    """

    def __init__(
        self,
        body: Body,
        definition: RobotDefinition,
        description: RobotDescription,
        *,
        model: str = "",
        backend: Backend = "numpy",
    ) -> None:
        """Look at a body through a definition that fits it."""
        self.body = body
        self.definition = definition
        self.description = description
        self.model = model
        """Name of the robot's kind; `name` is the name in the world."""
        self.backend: Backend = backend
        self.joints = JointArrays(body, breadth_first_joint_names(description))
        self.limits = joint_limits(self.joints)
        base = definition.base_footprint_link_name
        self.base_link: Link = body.links[0] if base is None else body.link(base)
        """The link whose frame is the robot's base frame."""
        self._add_interfaces()

    def _add_interfaces(self) -> None:
        definition, block = self.definition, self.definition.manipulation
        self.manipulation = None if block is None else capabilities.Manipulation(self, block)
        self.locomotion: capabilities.Locomotion | None = None
        if (locomotion := definition.locomotion) is not None:
            floor = locomotion.floor_touching_base_link_names
            self.locomotion = capabilities.Locomotion(self, locomotion.base_joint_names, floor)
        self.trunk: capabilities.ArticulatedTrunk | None = None
        if (trunk := definition.articulated_trunk) is not None:
            self.trunk = capabilities.ArticulatedTrunk(self, "trunk", trunk.trunk_joint_names)
        self.camera: capabilities.ActiveCamera | None = None
        if (camera := definition.active_camera) is not None:
            self.camera = capabilities.ActiveCamera(self, "camera", camera.camera_joint_names)
        self.two_wheel: capabilities.TwoWheel | None = None
        if definition.two_wheel is not None:
            self.two_wheel = capabilities.TwoWheel(self, definition.two_wheel)
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
        return World.of(self.body)

    @property
    def capabilities(self) -> tuple[str, ...]:
        """Blocks of the definition that are there."""
        return self.definition.capabilities

    @property
    def groups(self) -> Mapping[str, Group]:
        """Group name to its joints and controller, in action order; a body alone has none."""
        return {}

    def _jumped(self) -> None:
        """Joints or base were put elsewhere: what remembers where they were may forget."""

    # ------------------------------------------------------------------------------------------------- joints

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints of one degree of freedom: the order of every vector here."""
        return self.joints.names

    @property
    def n_dof(self) -> int:
        """Length of joint vectors."""
        return len(self.joint_names)

    @property
    def joint_lower_limits(self) -> Array:
        """(n,) rad or m, -inf for none"""
        return self.limits.lower.copy()

    @property
    def joint_upper_limits(self) -> Array:
        """(n,) rad or m, inf for none"""
        return self.limits.upper.copy()

    def get_joint_positions(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """(n,) rad or m; `normalized` to -1..1 between limits (joints without limits stay as they are)."""
        q = self.joints.q
        if normalized:
            bounded = np.isfinite(self.limits.lower) & np.isfinite(self.limits.upper)
            lower, upper = (
                np.where(bounded, self.limits.lower, -1.0),
                np.where(bounded, self.limits.upper, 1.0),
            )
            q = np.where(upper > lower, (2 * q - upper - lower) / np.maximum(upper - lower, 1e-12), 0.0)
        return self._given(q, backend)

    def get_joint_velocities(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """(n,) rad/s or m/s; `normalized` by the velocity limits."""
        v = self.joints.v
        return self._given(v / self.limits.velocity if normalized else v, backend)

    def get_joint_efforts(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """(n,) N m or N that the drives applied in the last step; `normalized` by the effort limits."""
        efforts = self.joints.efforts
        return self._given(efforts / self.limits.effort if normalized else efforts, backend)

    def set_joint_positions(self, positions: ArrayLike, indices: ArrayLike | None = None) -> None:
        """Jump to joint positions, at rest; goals are forgotten.

        Args:
            positions: (n,) or one for each of `indices`; rad or m. Values beyond limits are brought to them.
            indices: places of the joints; all by default.
        """
        q = self._with(self.joints.q, positions, indices, "joint positions")
        self._put_into(np.clip(q, self.limits.lower, self.limits.upper))

    def set_joint_velocities(self, velocities: ArrayLike, indices: ArrayLike | None = None) -> None:
        """Give joints a velocity; rad/s or m/s."""
        self.joints.v = self._with(self.joints.v, velocities, indices, "joint velocities")

    def _with(self, values: Array, given: ArrayLike, indices: ArrayLike | None, what: str) -> Array:
        wanted = np.asarray(as_numpy(given), dtype=float)
        where = slice(None) if indices is None else np.asarray(as_numpy(indices), dtype=np.intp)
        shape = values[where].shape
        if wanted.shape not in ((), shape) or not np.isfinite(wanted).all():
            raise RoboyardError(
                f"robot {self.name!r}: {what} take {shape[0]} finite numbers; got shape {wanted.shape}"
            )
        out = values.copy()
        out[where] = wanted
        return out

    def _put_into(self, q: Array) -> None:
        self.joints.q = q
        self.joints.v = np.zeros(len(q))
        self._jumped()

    def keeping_base(self, posture: Array) -> Array:
        """A posture with the virtual base joints (and wheels) as they are now."""
        out = posture.copy()
        kept = [name for name in VIRTUAL_JOINTS if name in self.joints.index]
        if self.definition.two_wheel is not None and self.locomotion is not None:
            kept += self.locomotion.joint_names
        places = self.joints.places(kept)
        out[places] = self.joints.q[places]
        return out

    def _given(self, values: Array, backend: Backend | None) -> Any:
        return as_backend(values, backend or self.backend)

    # ------------------------------------------------------------------------------------------------- place

    def get_position_orientation(self, *, backend: Backend | None = None) -> tuple[Any, Any]:
        """Position (3,) m and quaternion (4,) x, y, z, w of the base frame in the world."""
        position, quaternion = self.base_link.pose
        return self._given(position, backend), self._given(quaternion, backend)

    def set_position_orientation(
        self, position: ArrayLike | None = None, orientation: ArrayLike | None = None
    ) -> None:
        """Put the base frame somewhere; the joints stay, goals are forgotten."""
        here, turned = self.base_link.pose
        xyz = here if position is None else np.asarray(as_numpy(position), dtype=float)
        quaternion = turned if orientation is None else normalized(as_numpy(orientation))
        if xyz.shape != (3,) or quaternion.shape != (4,) or not (np.isfinite(xyz).all()):
            raise RoboyardError(f"robot {self.name!r}: a position has 3 finite numbers, an orientation 4")
        self.base.set_pose(xyz, quaternion)
        self._jumped()

    def get_linear_velocity(self, *, backend: Backend | None = None) -> Any:
        """(3,) m/s of the base frame's origin, in world axes."""
        return self._given(self.base_link.velocity[0], backend)

    def get_angular_velocity(self, *, backend: Backend | None = None) -> Any:
        """(3,) rad/s of the base frame, in world axes."""
        return self._given(self.base_link.velocity[1], backend)

    def get_relative_velocity(self) -> tuple[Array, Array]:
        """Linear (3,) m/s and angular (3,) rad/s velocity of the base in its own axes."""
        back = conjugate(self.base_link.pose[1])
        linear, angular = self.base_link.velocity
        return rotate(back, linear), rotate(back, angular)

    # -------------------------------------------------------------------------------------------------- arms

    @property
    def arm_names(self) -> tuple[str, ...]:
        return self.manipulation.arm_names if self.manipulation is not None else ()

    def _need_arms(self) -> capabilities.Manipulation:
        if self.manipulation is None:
            raise RoboyardError(
                f"robot {self.name!r} has no arms; add a manipulation block to its definition"
            )
        return self.manipulation

    def get_eef_pose(
        self, arm: str = "default", *, frame: str = "world", backend: Backend | None = None
    ) -> tuple[Any, Any]:
        """Position (3,) m and quaternion (4,) x, y, z, w of an end effector, in the "world" or "base"
        frame.
        """
        position, quaternion = self._need_arms().eef_pose(arm, frame=frame)
        return self._given(position, backend), self._given(quaternion, backend)

    def get_eef_position(self, arm: str = "default", *, backend: Backend | None = None) -> Any:
        """(3,) m, in the world."""
        return self.get_eef_pose(arm, backend=backend)[0]

    def get_eef_orientation(self, arm: str = "default", *, backend: Backend | None = None) -> Any:
        """(4,) x, y, z, w, in the world."""
        return self.get_eef_pose(arm, backend=backend)[1]

    def get_relative_eef_pose(
        self, arm: str = "default", *, backend: Backend | None = None
    ) -> tuple[Any, Any]:
        """Pose of an end effector in the robot's base frame."""
        return self.get_eef_pose(arm, frame="base", backend=backend)

    def is_grasping(self, arm: str = "default") -> bool | None:
        """Whether a gripper holds something; None where that cannot be told."""
        return self._need_arms().is_grasping(arm)
