"""A robot under OmniGibson's names: its getters and setters, breadth-first joint vectors, torch tensors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import RoboyardError
from roboyard.kinematics.joint_order import breadth_first_joint_names, reorder
from roboyard.omnigibson.backends import Backend, as_backend, as_numpy
from roboyard.robots import Robot
from roboyard.robots.control.setup import ControllerConfig
from roboyard.robots.joint_arrays import Indices
from roboyard.transforms import Array


def wrap(robot: Robot, *, backend: Backend = "numpy") -> OmniGibsonRobot:
    """Return a robot under OmniGibson's names.

    Args:
        robot: that calls are passed on to.
        backend: "numpy", or "torch" for getters that return torch tensors. Setters take both.
    """
    return OmniGibsonRobot(robot, backend=backend)


class OmniGibsonRobot:
    """A robot under OmniGibson's names. Joint vectors are breadth first from the root, as in PhysX."""

    def __init__(self, robot: Robot, *, backend: Backend = "numpy") -> None:
        """Wrap a robot; `wrap` is the function to call."""
        self.robot = robot
        """The wrapped robot, whose joint vectors are depth first."""
        self.backend: Backend = backend
        self._names = breadth_first_joint_names(robot.description)
        self._to_breadth = reorder(robot.joint_names, self._names)
        self._to_depth = reorder(self._names, robot.joint_names)

    def __repr__(self) -> str:
        return f"<OmniGibsonRobot {self.robot.name!r}: {self.n_dof} joints, {self.backend} arrays>"

    @property
    def name(self) -> str:
        """Name in the world."""
        return self.robot.name

    # ------------------------------------------------------------------------------------------------- joints

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints with one degree of freedom, breadth first: the order of joint vectors."""
        return self._names

    @property
    def n_dof(self) -> int:
        """Length of joint vectors."""
        return len(self._names)

    @property
    def joint_lower_limits(self) -> Any:
        """(n,) lower position limits (rad or m), -inf for none."""
        return self._given(self.robot.limits.lower[self._to_breadth])

    @property
    def joint_upper_limits(self) -> Any:
        """(n,) upper position limits (rad or m), inf for none."""
        return self._given(self.robot.limits.upper[self._to_breadth])

    @property
    def control_idx(self) -> dict[str, Indices]:
        """Group name to the (k,) indices of its joints in joint vectors."""
        return {name: self._to_depth[indices] for name, indices in self.robot.control_idx.items()}

    def get_joint_positions(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """Return the joint positions.

        Args:
            normalized: scale to -1..1 between the limits; joints without limits stay as they are.
            backend: of the result.

        Returns:
            (n,) rad or m.
        """
        q = self.robot.joint_positions
        if normalized:
            limits = self.robot.limits
            bounded = np.isfinite(limits.lower) & np.isfinite(limits.upper)
            lower, upper = np.where(bounded, limits.lower, -1.0), np.where(bounded, limits.upper, 1.0)
            q = np.where(upper > lower, (2 * q - upper - lower) / np.maximum(upper - lower, 1e-12), 0.0)
        return self._given(q[self._to_breadth], backend)

    def get_joint_velocities(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """Return the (n,) joint velocities (rad/s or m/s), `normalized` by the velocity limits."""
        v = self.robot.joint_velocities
        v = v / self.robot.limits.velocity if normalized else v
        return self._given(v[self._to_breadth], backend)

    def get_joint_efforts(self, *, normalized: bool = False, backend: Backend | None = None) -> Any:
        """Return the (n,) efforts of the drives in the last step (N m or N), `normalized` by their limits."""
        efforts = self.robot.joint_efforts
        efforts = efforts / self.robot.limits.effort if normalized else efforts
        return self._given(efforts[self._to_breadth], backend)

    def set_joint_positions(self, positions: ArrayLike, indices: ArrayLike | None = None) -> None:
        """Move joints at once, at rest; goals are reset, and values outside the limits clipped.

        Args:
            positions: (n,), or (k,) for `indices` (rad or m).
            indices: (k,) of the joints in joint vectors; all by default.

        Raises:
            RoboyardError: the shape does not fit, or a number is not finite.
        """
        self.robot.joint_positions = self._vector(self.robot.joint_positions, positions, indices, "positions")

    def set_joint_velocities(self, velocities: ArrayLike, indices: ArrayLike | None = None) -> None:
        """Set joint velocities.

        Args:
            velocities: (n,), or (k,) for `indices` (rad/s or m/s).
            indices: (k,) of the joints in joint vectors; all by default.

        Raises:
            RoboyardError: the shape does not fit, or a number is not finite.
        """
        self.robot.joint_velocities = self._vector(
            self.robot.joint_velocities, velocities, indices, "velocities"
        )

    def _vector(self, present: Array, given: ArrayLike, indices: ArrayLike | None, kind: str) -> Array:
        """Return the robot's (n,) vector `present`, with breadth-first values replaced by `given`."""
        out = present[self._to_breadth]
        values = np.asarray(as_numpy(given), dtype=float)
        where = slice(None) if indices is None else np.asarray(as_numpy(indices), dtype=np.intp)
        shape = out[where].shape
        if values.shape not in ((), shape) or not np.isfinite(values).all():
            raise RoboyardError(
                f"robot {self.name!r}: joint {kind} must be {shape[0]} finite numbers, got {values} of shape "
                f"{values.shape}"
            )
        out[where] = values
        return out[self._to_depth]

    def _given(self, values: Array, backend: Backend | None = None) -> Any:
        return as_backend(values, backend or self.backend)

    # -------------------------------------------------------------------------------------------------- base

    def get_position_orientation(self, *, backend: Backend | None = None) -> tuple[Any, Any]:
        """Return position (3,) (m) and quaternion (4,) x, y, z, w of the base frame in the world frame."""
        position, quaternion = self.robot.pose
        return self._given(position, backend), self._given(quaternion, backend)

    def set_position_orientation(
        self, position: ArrayLike | None = None, orientation: ArrayLike | None = None
    ) -> None:
        """Move the base frame at once; joints stay, goals are reset.

        Args:
            position: (3,) in the world frame (m); the present one by default.
            orientation: (4,) quaternion x, y, z, w in the world frame; the present one by default.

        Raises:
            RoboyardError: a shape does not fit, or a number is not finite.
        """
        self.robot.set_pose(as_numpy(position), as_numpy(orientation))

    def get_linear_velocity(self, *, backend: Backend | None = None) -> Any:
        """Return the (3,) velocity of the base frame's origin, in world axes (m/s)."""
        return self._given(self.robot.velocity[0], backend)

    def get_angular_velocity(self, *, backend: Backend | None = None) -> Any:
        """Return the (3,) angular velocity of the base frame, in world axes (rad/s)."""
        return self._given(self.robot.velocity[1], backend)

    def keep_still(self) -> None:
        """Set all velocities to zero."""
        self.robot.stop()

    # -------------------------------------------------------------------------------------------------- arms

    @property
    def arm_names(self) -> tuple[str, ...]:
        """Names of the arms."""
        return tuple(self.robot.arms)

    def get_eef_pose(
        self, arm: str = "default", *, frame: str = "world", backend: Backend | None = None
    ) -> tuple[Any, Any]:
        """Return the pose of an end effector.

        Args:
            arm: name; the first arm by default.
            frame: "world", or "base" for the robot's base frame.
            backend: of the result.

        Returns:
            Position (3,) (m) and quaternion (4,) x, y, z, w.

        Raises:
            RoboyardError: there is no such arm or frame.
        """
        if self.robot.manipulation is None:
            raise RoboyardError(
                f"robot {self.name!r} has no arm {arm!r}; add a manipulation block to its definition"
            )
        position, quaternion = self.robot.manipulation.eef_pose(arm, frame=frame)
        return self._given(position, backend), self._given(quaternion, backend)

    def get_eef_position(self, arm: str = "default", *, backend: Backend | None = None) -> Any:
        """Return the (3,) position of an end effector in the world frame (m)."""
        return self.get_eef_pose(arm, backend=backend)[0]

    def get_eef_orientation(self, arm: str = "default", *, backend: Backend | None = None) -> Any:
        """Return the orientation of an end effector in the world frame, (4,) x, y, z, w."""
        return self.get_eef_pose(arm, backend=backend)[1]

    def get_relative_eef_pose(
        self, arm: str = "default", *, backend: Backend | None = None
    ) -> tuple[Any, Any]:
        """Return position (3,) (m) and quaternion (4,) of an end effector in the robot's base frame."""
        return self.get_eef_pose(arm, frame="base", backend=backend)

    def is_grasping(self, arm: str = "default") -> bool | None:
        """Return whether a gripper holds an object; None where its controller cannot detect that.

        Raises:
            RoboyardError: there is no such arm.
        """
        if self.robot.manipulation is None:
            raise RoboyardError(
                f"robot {self.name!r} has no arm {arm!r}; add a manipulation block to its definition"
            )
        return self.robot.manipulation.is_grasping(arm)

    # ---------------------------------------------------------------------------------- actions, observations

    @property
    def action_dim(self) -> int:
        """Length of an action."""
        return self.robot.action_dim

    @property
    def controller_action_idx(self) -> dict[str, slice]:
        """Group name to the slice of its command in an action."""
        return self.robot.controller_action_idx

    def apply_action(self, action: ArrayLike | Mapping[str, ArrayLike]) -> None:
        """Set the controllers' goals.

        Args:
            action: (action_dim,) numbers in group order, or commands by group.

        Raises:
            RoboyardError: the length does not fit, a group is unknown, or a number is not finite.
        """
        if isinstance(action, Mapping):
            self.robot.apply_action({name: as_numpy(command) for name, command in action.items()})
        else:
            self.robot.apply_action(as_numpy(action))

    def reset(self) -> None:
        """Move the joints into the reset posture, at rest, and reset all goals; the base keeps its pose."""
        self.robot.reset()

    def tuck(self) -> None:
        """Move the joints into the tucked posture at once."""
        self.robot.tuck()

    def untuck(self) -> None:
        """Move the joints into the untucked posture at once."""
        self.robot.untuck()

    def reload_controllers(self, controllers: ControllerConfig | None = None) -> None:
        """Replace all controllers, from the definition's defaults and these keys by group."""
        self.robot.reload_controllers(controllers)

    def get_proprioception(
        self, keys: tuple[str, ...] | None = None, *, backend: Backend | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Return the robot's own state; keys that begin with "joint_" are breadth-first joint vectors.

        Args:
            keys: entries of the vector; the robot's `default_proprioception` by default.
            backend: of the result.

        Returns:
            The arrays of `keys`, concatenated; all arrays by key.

        Raises:
            RoboyardError: a key does not exist.
        """
        _, arrays = self.robot.proprioception(keys)
        for key in arrays:
            if key.startswith("joint_"):
                arrays[key] = arrays[key][self._to_breadth]
        chosen = self.robot.default_proprioception if keys is None else keys
        vector = np.concatenate([np.zeros(0), *(arrays[key] for key in chosen)])
        return self._given(vector, backend), {key: self._given(a, backend) for key, a in arrays.items()}

    def get_obs(self, *, fresh: bool = False) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Return the observations of all sensors, and the names in their segmentation images.

        Args:
            fresh: update all sensors now, not at their own rates.

        Returns:
            Sensor name to modality to array, with "proprio" (see `get_proprioception`); sensor name to "seg"
            to names.
        """
        observations, info = self.robot.observe(fresh=fresh)
        observations["proprio"] = self.get_proprioception()[0]
        return observations, info
