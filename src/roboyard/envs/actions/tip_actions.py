"""Actions of end effectors: changes of the tip's pose, by inverse kinematics in all environments at once.

At every action the joints' targets are q + d, with q their positions, e the error of the tip's pose and

    d = Jᵀ (J Jᵀ + λ² I)⁻¹ g e + (I - Jᵀ (J Jᵀ + λ² I)⁻¹ J) r (q_rest - q)

Damped least squares: Wampler 1986; Nakamura and Hanafusa 1986.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from roboyard.envs.actions import tip_kernels
from roboyard.envs.actions.action import Action, BoundAction, Place, group_of
from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.transforms import Array

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
        physics, arrays, columns = place.physics, place.arrays, place.indices
        self._tip = tip = arrays.tip(arm)
        dofs = place.robot.joint_arrays.dofs[columns]
        moving = np.flatnonzero(tip.moves_with()[dofs])
        self._goal = np.zeros((physics.count, 3))
        self._turn = np.zeros((physics.count, 4))
        self._state = (
            physics.field("xpos")[:, tip.row],
            physics.field("xquat")[:, tip.row],
            physics.field("xquat")[:, arrays.base.row],
            physics.field("subtree_com")[:, tip.root],
            physics.field("cdof"),
            physics.field("qpos"),
        )
        self._setup = (
            arrays.qpos_addresses[columns],
            moving,
            np.ascontiguousarray(dofs[moving], dtype=np.int64),
            columns.astype(np.int64),
            float(action.move),
            float(action.turn or 0.0),
            int(action.turn is not None or action.keeps_orientation),
            min(1.0, APPROACH_RATE * place.dt),
            np.full(6, DAMPING**2),
            REST_RATE * place.dt,
            arrays.lower[columns],
            arrays.upper[columns],
            place.velocity_limits * place.dt,
            arrays.rest[columns],
        )
        self._work = (
            np.zeros((6, len(moving))),
            np.zeros((6, 6)),
            np.zeros((6, 6)),
            np.zeros(6),
            np.zeros(6),
            np.arange(6),
            np.zeros(len(columns)),
        )
        self._target = place.drives.position
        self.reset(np.arange(physics.count))

    def reset(self, rows: np.ndarray) -> None:
        position, quaternion = self._state[:2]
        self._goal[rows] = position[rows]
        self._turn[rows] = quaternion[rows]

    def apply(self, command: Array) -> None:
        tip_kernels.move_tips(
            command, self._goal, self._turn, *self._state, *self._setup, *self._work, self._target
        )
