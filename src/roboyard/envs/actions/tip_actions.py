"""Actions of end effectors: changes of the tip's pose, by inverse kinematics in all environments at once.

At every action the joints' targets are q + d, with q their positions, e the error of the tip's pose and

    d = Jᵀ (J Jᵀ + λ² I)⁻¹ g e + (I - Jᵀ (J Jᵀ + λ² I)⁻¹ J) r (q_rest - q)

Damped least squares: Wampler 1986; Nakamura and Hanafusa 1986.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard.envs.actions.action import Action, BoundAction, Place, group_of
from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.transforms import Array, conjugate, multiply, rotate

DAMPING = 0.05
"""λ (m or rad per rad)."""
APPROACH_RATE = 25.0
"""Rate at which the error decreases (1/s)."""
REST_RATE = 0.5
"""Rate towards the start posture in the null space (1/s)."""


@dataclass(frozen=True)
class TipDelta(Action):
    """Changes of an end effector's pose from the present one, in the robot's base frame.

    x, y, z (m), and with `turn` a rotation vector (rad). Along an axis whose number is 0 the goal stays.
    """

    move: float = 0.05
    """Largest change along each axis (m)."""
    turn: float | None = None
    """Largest rotation about each axis (rad); None: three numbers only, and the orientation stays."""
    keeps_orientation: bool = True
    """Whether the orientation is kept where no rotation is commanded."""

    def bind(self, place: Place) -> BoundAction:
        """Return the action of n environments.

        Raises:
            ConfigError: the group is no arm.
        """
        return _Tip(place, arm_of(place.robot, place.group), self)

    def controller(self, robot: Robot, group: str) -> dict[str, Any]:
        """Return the keys of the robot's `InverseKinematicsController` that does the same."""
        group_of(robot, group)
        if self.turn is None:
            return super().controller(robot, group)
        bound = [self.move] * 3 + [self.turn] * 3
        return {
            "name": "InverseKinematicsController",
            "mode": "pose_delta_ori",
            "command_output_limits": [[-b for b in bound], bound],
        }


def arm_of(robot: Robot, group: str) -> str:
    """Return the arm of a group of joints, "left" for "arm_left".

    Raises:
        ConfigError: the group is no arm.
    """
    kind, _, arm = group.partition("_")
    if kind != "arm" or robot.manipulation is None or arm not in robot.manipulation.arm_names:
        raise ConfigError(f"TipDelta of {group!r}, which is no arm of robot {robot.name!r}")
    return arm


class _Tip(BoundAction):
    def __init__(self, place: Place, arm: str, action: TipDelta) -> None:
        self.size = 3 if action.turn is None else 6
        self._place, self._action = place, action
        self._tip = place.arrays.tip(arm)
        self._base = place.arrays.base
        self._columns = place.indices
        dofs = place.robot.joint_arrays.dofs[place.indices]
        self._moving = np.flatnonzero(self._tip.moves_with()[dofs])
        self._dofs = dofs[self._moving]
        place.physics.field("cdof")
        self._low, self._high = place.arrays.lower[self._columns], place.arrays.upper[self._columns]
        self._reach = place.velocity_limits * place.dt
        self._rest = place.arrays.rest[self._columns]
        self._gain = min(1.0, APPROACH_RATE * place.dt)
        self._holds = action.turn is not None or action.keeps_orientation
        self._goal = np.zeros((place.physics.count, 3))
        self._turn = np.tile([0.0, 0.0, 0.0, 1.0], (place.physics.count, 1))
        self.reset(np.arange(place.physics.count))

    def reset(self, rows: np.ndarray) -> None:
        self._goal[rows] = self._tip.position[rows]
        self._turn[rows] = self._tip.quaternion[rows]

    def apply(self, command: Array) -> None:
        place, action = self._place, self._action
        position = self._tip.position
        base = self._base.quaternion
        here = rotate(conjugate(base), self._goal - position)
        goal = np.where(command[:, :3] == 0.0, here, command[:, :3] * action.move)
        self._goal = position + rotate(base, goal)
        if action.turn is not None:
            change = rotate(base, command[:, 3:] * action.turn)
            turned = multiply(_quaternion(change), self._tip.quaternion)
            self._turn = np.where(command[:, 3:].any(axis=1, keepdims=True), turned, self._turn)
        error = self._goal - position
        jacobian, turning = self._tip.jacobian(self._dofs)
        if self._holds:
            turned = _vector(multiply(self._turn, conjugate(self._tip.quaternion)))
            error = np.concatenate([error, turned], axis=1)
            jacobian = np.concatenate([jacobian, turning], axis=1)
        q = place.arrays.q[:, self._columns]
        step = REST_RATE * place.dt * (self._rest - q)
        pull = step[:, None, self._moving]
        # no matrix products: their last bits depend on the number of rows
        square = (jacobian[:, :, None, :] * jacobian[:, None, :, :]).sum(axis=-1)
        diagonal = np.arange(square.shape[1])
        square[:, diagonal, diagonal] += DAMPING**2
        wanted = self._gain * error - (jacobian * pull).sum(axis=-1)
        solved = np.linalg.solve(square, wanted[..., None])
        step[:, self._moving] += (jacobian * solved).sum(axis=1)
        # all joints slower by the same factor, so that the tip moves in the same direction
        step /= np.maximum((np.abs(step) / self._reach).max(axis=1, keepdims=True), 1.0)
        place.drives.position[:, self._columns] = np.clip(q + step, self._low, self._high)


def _quaternion(vector: Array) -> Array:
    """Return (n, 4) quaternions of (n, 3) rotation vectors (rad)."""
    angle = np.sqrt((vector * vector).sum(axis=-1, keepdims=True))
    share = np.where(angle > 1e-12, np.sin(angle / 2) / np.maximum(angle, 1e-12), 0.5)
    return np.concatenate([vector * share, np.cos(angle / 2)], axis=-1)


def _vector(quaternion: Array) -> Array:
    """Return (n, 3) rotation vectors (rad) of (n, 4) unit quaternions."""
    q = np.where(quaternion[:, 3:] < 0.0, -quaternion, quaternion)
    sine = np.sqrt((q[:, :3] ** 2).sum(axis=-1, keepdims=True))
    angle = 2.0 * np.arctan2(sine, q[:, 3:])
    return q[:, :3] * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 2.0)
