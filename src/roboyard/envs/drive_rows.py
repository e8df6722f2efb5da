"""The drives of one robot in n environments: targets of all joints, written once for each action.

The drive law is that of `roboyard.robots.control.control_loop`, with gains for the inertia of the start
posture; gravity is compensated at every action.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from roboyard.envs.batch_physics import BatchPhysics
from roboyard.envs.body_arrays import RobotArrays
from roboyard.robots.control.control_loop import CREEP_SPEED
from roboyard.robots.control.velocity_tracking import INTEGRAL_RATE, MAX_INTEGRAL
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.robot import Robot


def prepare_drives(robot: Robot, velocity_joints: Iterable[str], driven: Iterable[str]) -> None:
    """Write the gains of a robot's drives into its world, at the present posture.

    Args:
        robot: of a compiled world.
        velocity_joints: joints that actions drive by velocity.
        driven: all joints that actions drive; others hold the reset posture where the robot's controllers or
            position limits hold them.
    """
    robot.joint_arrays.refresh()
    is_velocity = np.isin(robot.joint_names, list(velocity_joints))
    free = _free_joints(robot, set(driven))
    kp, kd = robot.loop.gains(~is_velocity)
    kp[is_velocity | free] = 0.0
    kd[free] = 0.0
    rows = robot.joint_arrays.driven
    robot.joint_arrays.drives.write_gains(kp[rows], kd[rows])


def _free_joints(robot: Robot, driven: set[str]) -> np.ndarray:
    """(j,) whether nothing holds a joint: casters, and the virtual joints that no controller drives."""
    held = {name for group in robot.groups.values() for name in group.joints} | driven
    return np.array(
        [
            joint.name not in held and (joint.limits is None or joint.name in VIRTUAL_JOINTS)
            for joint in robot.joint_arrays.joints
        ],
        dtype=bool,
    )


class DriveRows:
    """Targets of the joints of one robot in n environments."""

    def __init__(
        self,
        physics: BatchPhysics,
        arrays: RobotArrays,
        velocity_joints: np.ndarray,
        driven: Iterable[str],
        dt: float,
    ) -> None:
        """Create targets that hold the reset posture.

        Args:
            physics: of the environments.
            arrays: of the robot.
            velocity_joints: (k,) indices of the joints that actions drive by velocity.
            driven: names of all joints that actions drive.
            dt: time between actions (s).
        """
        robot, joints = arrays.robot, arrays.robot.joint_arrays
        model = physics.world.model
        rows = np.array([joints.joints[i]._built.actuator.id for i in joints.driven], dtype=np.intp)
        self._driven = joints.driven
        self._address = model.actuator_ctrladr[rows].astype(np.intp)
        self._ctrl = physics.field("ctrl")
        self._bias = physics.field("qfrc_bias")
        self._dofs = joints.dofs[joints.driven]
        self._rest = robot.joint_positions
        self.position = np.tile(self._rest, (physics.count, 1))
        """(n, j) target positions (rad or m)."""
        self.velocity = np.zeros_like(self.position)
        """(n, j) target velocities (rad/s or m/s)."""
        self._compensated = np.where(_free_joints(robot, set(driven))[self._driven], 0.0, 1.0)
        for group in robot.groups.values():
            if group.controller.settings.use_gravity_compensation is False:
                self._compensated[np.isin(self._driven, group.indices)] = 0.0
        self._arrays, self._dt = arrays, dt
        self._tracked = np.asarray(velocity_joints, dtype=np.intp)
        self._sum = np.zeros((physics.count, len(self._tracked)))
        self._most = MAX_INTEGRAL * robot.limits.velocity[self._tracked]
        self._damping, self._friction = joints.damping[self._driven], joints.friction[self._driven]
        self._resists = bool(self._damping.any() or self._friction.any())

    def reset(self, rows: np.ndarray, q: np.ndarray) -> None:
        """Start episodes at joint positions q (k, j) (rad or m)."""
        self.position[rows] = q
        self.velocity[rows] = 0.0
        self._sum[rows] = 0.0

    def write(self) -> None:
        """Send the targets to the drives."""
        speed = self.velocity[:, self._driven]
        effort = self._bias[:, self._dofs] * self._compensated
        if self._resists and speed.any():
            effort += self._damping * speed + self._friction * np.tanh(speed / CREEP_SPEED)
        self._ctrl[:, self._address] = self.position[:, self._driven]
        self._ctrl[:, self._address + 1] = self._tracking()[:, self._driven] if len(self._tracked) else speed
        self._ctrl[:, self._address + 2] = effort

    def _tracking(self) -> np.ndarray:
        """Return (n, j) velocities that have no steady error under load: see `velocity_tracking`."""
        tracked = self._tracked
        target = self.velocity[:, tracked]
        change = INTEGRAL_RATE * self._dt * (target - self._arrays.v[:, tracked])
        self._sum = np.clip(self._sum + change, -self._most, self._most)
        sent = self.velocity.copy()
        sent[:, tracked] = target + self._sum
        return sent
