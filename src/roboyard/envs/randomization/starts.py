"""Differences of the states in which episodes start: joints, and poses of free bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization.declared import Draw, Randomization, Range, check_range, robot_of
from roboyard.errors import ConfigError
from roboyard.transforms import multiply


@dataclass(frozen=True)
class JointNoise(Randomization):
    """Joints of a robot start away from the start posture (rad or m), within their limits."""

    robot: str = "robot"
    position: float = 0.05
    velocity: float = 0.0
    names: tuple[str, ...] = ()
    """Joints; all that have limits by default."""

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws joint positions."""
        robot_of(env, self.robot)
        arrays = env.robots[self.robot]
        limited = [j.name for j in arrays.robot.joint_arrays.joints if j.limits is not None]
        indices = arrays.indices_of(self.names or limited)

        def draw(rows: Rows, random: RandomRows) -> None:
            q, v = arrays.q[rows], np.array(arrays.v[rows])
            q[:, indices] += random.uniform(-self.position, self.position, size=len(indices))
            v[:, indices] += random.uniform(-self.velocity, self.velocity, size=len(indices))
            arrays.set_joints(rows, np.clip(q, arrays.lower, arrays.upper), v)

        return draw


@dataclass(frozen=True)
class Pose(Randomization):
    """A free body starts elsewhere: shifted along x and y and turned about z from where the world has it."""

    body: str
    x: Range = (0.0, 0.0)
    y: Range = (0.0, 0.0)
    yaw: Range = (-np.pi, np.pi)

    def bind(self, env: EnvArrays) -> Draw:
        """Return the function that draws poses."""
        for name in ("x", "y", "yaw"):
            check_range(f"Pose.{name}", getattr(self, name))
        body = env.body(self.body)
        position, quaternion = body.body.pose

        def draw(rows: Rows, random: RandomRows) -> None:
            shift = np.stack([random.uniform(*self.x), random.uniform(*self.y), np.zeros(len(rows))], axis=1)
            turn = random.yaw_quaternion(*self.yaw)
            body.set_pose(rows, position + shift, multiply(turn, np.broadcast_to(quaternion, turn.shape)))

        if not body.is_free:
            raise ConfigError(f"Pose: {self.body!r} is fixed to the world")
        return draw
