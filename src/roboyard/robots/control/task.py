"""Goal poses of an end effector: the base class of inverse kinematics and operational space control.

Commands are in the robot's base frame. Absolute poses are kept in it; goals of the other modes are kept in
the parent frame of the chain, so that an arm moves with the torso. Commands by mode
(positions m, rotations as rotation vectors, rad):

    absolute_pose            6   the pose itself; needs both command limits null
    pose_absolute_ori        6   change of position, orientation itself
    pose_delta_ori           6   change of position, change of orientation about base axes: R* = R(Δ) R
    position_fixed_ori       3   change of position; the orientation is that of the first command
    position_compliant_ori   3   change of position; the orientation is free

A change is relative to the measured pose, axis by axis: along an axis whose change is zero, and for the
orientation when its change is zero, the goal stays. So a tip under load keeps its height while it moves
sideways, and does not drift under zero commands (OmniGibson re-targets the whole measured pose at each
command). With `goal_update_mode: target` changes are relative to the goal instead, and add up exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Literal

import numpy as np
from pydantic import model_validator

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError, RoboyardError
from roboyard.kinematics import ChainArrays, forward_kinematics
from roboyard.robots.control.controller import (
    EYE4,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
)
from roboyard.robots.control.rotations import inverse, matrix_of_vector, vector_of_matrix
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix

Mode = Literal[
    "absolute_pose", "pose_absolute_ori", "pose_delta_ori", "position_fixed_ori", "position_compliant_ori"
]
PoseLimiter = Callable[[Array, Array], tuple[ArrayLike, ArrayLike]]
"""(3,) position (m) and (4,) quaternion of a goal in the base frame to allowed ones."""

POSITION_STEP = 0.2
"""Default output limit of positions (m)."""
ROTATION_STEP = 0.5
"""Default output limit of rotations (rad)."""


class TaskSettings(ControllerSettings):
    """Keys of a task-space controller."""

    mode: Mode = "pose_delta_ori"
    goal_update_mode: Literal["measured", "target"] = "measured"
    """Pose that changes are relative to."""
    workspace_pose_limiter: PoseLimiter | None = None
    """Limits goal poses, in the base frame."""
    reset_joint_pos: tuple[float, ...] | None = None
    """(n,) posture of the null space (rad or m); the robot's reset posture by default."""

    @model_validator(mode="after")
    def _limits_fit(self) -> TaskSettings:
        if self.mode == "absolute_pose" and not (
            self.command_input_limits is None and self.command_output_limits is None
        ):
            raise ValueError(
                "mode 'absolute_pose' needs command_input_limits and command_output_limits null (and"
                f" action_normalize false), got {self.command_input_limits} and {self.command_output_limits}"
            )
        return self


class TaskController(Controller):
    """A controller with a goal pose for the tip of a chain of joints."""

    settings: TaskSettings
    needs_mount: ClassVar[bool] = True
    """Whether states need `mount`."""

    def __init__(
        self, limits: GroupLimits, settings: TaskSettings, *, chain: ChainArrays, rest: Array
    ) -> None:
        """Create the controller of a chain.

        Args:
            limits: of the group's joints.
            settings: keys of this controller.
            chain: n joints from the parent frame of the group to the tip, with the names of the group.
            rest: (n,) posture of the null space, in the chain's order (rad or m).

        Raises:
            ConfigError: chain or posture do not fit the group.
        """
        if chain.size != limits.size:
            raise ConfigError(f"the chain has {chain.size} joints, the group {limits.size}")
        super().__init__(limits, settings)
        self.chain = chain
        self.rest = rest if settings.reset_joint_pos is None else np.array(settings.reset_joint_pos)
        if self.rest.shape != (chain.size,):
            raise ConfigError(f"reset_joint_pos: must have {chain.size} values, got {len(self.rest)}")
        self._fixed: Array | None = None
        self._goal_mount: Array = EYE4
        self._posture: Array | None = None

    @property
    def command_dim(self) -> int:
        """Numbers in a command, by mode."""
        return 3 if self.settings.mode.startswith("position") else 6

    @property
    def is_orientation_free(self) -> bool:
        """Whether only the position has a goal."""
        return self.settings.mode == "position_compliant_ori"

    def reset(self) -> None:
        """Discard the goal."""
        super().reset()
        self._fixed = self._posture = None

    @property
    def preferred(self) -> Array:
        """(n,) posture that the null space moves to (rad or m): `rest`, or the last of `follow_posture`."""
        return self.rest if self._posture is None else self._posture

    def follow_posture(self, posture: Array, state: GroupState) -> None:
        """Take the pose of the tip in a posture as goal, and reach it in that posture, until `reset`.

        A planned motion is followed so, a posture for each control step; a command by `update_goal` sets
        another goal pose, but joints still prefer the posture.

        Args:
            posture: (n,) positions (rad or m), in the chain's order.
            state: of the joints.
        """
        self._posture = np.array(posture, dtype=float)
        self.goal = state.mount @ forward_kinematics(self.chain, self._posture)
        self._goal_mount = state.mount

    def target(self, state: GroupState) -> Array:
        """Return the (4, 4) goal pose in the parent frame of the chain."""
        mount = state.mount if self.settings.mode == "absolute_pose" else self._goal_mount
        return inverse(mount) @ self.goal

    def tip(self, state: GroupState) -> Array:
        """Return the (4, 4) measured pose of the tip in the base frame."""
        return state.mount @ forward_kinematics(self.chain, state.q)

    def _default_output_limits(self) -> tuple[ArrayLike, ArrayLike]:
        if self.settings.mode == "pose_absolute_ori":
            bound = np.array([1.0] * 3 + [np.pi] * 3)
        else:
            bound = np.array([POSITION_STEP] * 3 + [ROTATION_STEP] * 3)[: self.command_dim]
        return -bound, bound

    def _goal(self, command: Array, state: GroupState) -> Array:
        mode = self.settings.mode
        measured = self.tip(state)
        held = measured if self.goal is None else state.mount @ self.target(state)
        self._goal_mount = state.mount
        origin = held if self.settings.goal_update_mode == "target" else measured
        goal = np.eye(4)
        if mode == "absolute_pose":
            goal[:3, 3] = command[:3]
        else:
            change = command[:3]
            goal[:3, 3] = np.where(change == 0.0, held[:3, 3], origin[:3, 3] + change)
        goal[:3, :3] = self._orientation(command, held, origin, measured)
        return self._limited(goal)

    def _orientation(self, command: Array, held: Array, origin: Array, measured: Array) -> Array:
        match self.settings.mode:
            case "absolute_pose" | "pose_absolute_ori":
                return matrix_of_vector(command[3:])
            case "pose_delta_ori":
                if not command[3:].any():
                    return held[:3, :3]
                return matrix_of_vector(command[3:]) @ origin[:3, :3]
            case "position_fixed_ori":
                if self._fixed is None:
                    self._fixed = measured[:3, :3].copy()
                return self._fixed
            case _:
                return measured[:3, :3]

    def _limited(self, goal: Array) -> Array:
        limiter = self.settings.workspace_pose_limiter
        if limiter is None:
            return goal
        position, quaternion = limiter(goal[:3, 3].copy(), quaternion_from_matrix(goal[:3, :3]))
        goal[:3, 3] = position
        goal[:3, :3] = matrix_from_quaternion(quaternion)
        if not np.isfinite(goal).all():
            raise RoboyardError(f"workspace_pose_limiter returned a pose that is not finite: {goal.tolist()}")
        return goal

    def _noop_goal(self, state: GroupState) -> Array:
        self._goal_mount = state.mount
        return self.tip(state)

    def _noop(self, state: GroupState) -> Array:
        command = np.zeros(self.command_dim)
        kept = self.tip(state) if self.goal is None else state.mount @ self.target(state)
        if self.settings.mode == "absolute_pose":
            command[:3] = kept[:3, 3]
        if self.settings.mode in ("absolute_pose", "pose_absolute_ori"):
            command[3:] = vector_of_matrix(kept[:3, :3])
        return command
