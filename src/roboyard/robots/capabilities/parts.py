"""A torso, a head, and joints that carry the robot: groups of joints with a name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.robots.joint_arrays import Indices
from roboyard.sim.link import Link
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody


class JointPart:
    """Some joints of a robot that belong together."""

    def __init__(self, robot: RobotBody, name: str, joints: tuple[str, ...]) -> None:
        self._robot = robot
        self.name = name
        self.joint_names = joints
        self.control_idx: Indices = robot.joints.places(joints)
        """Places of the joints in the robot's vectors."""

    @property
    def joint_positions(self) -> Array:
        """(n,) rad or m"""
        return self._robot.joints.q[self.control_idx]

    @property
    def joint_velocities(self) -> Array:
        """(n,) rad/s or m/s"""
        return self._robot.joints.v[self.control_idx]

    def proprioception(self, q: Array, v: Array) -> dict[str, Any]:
        """Positions and velocities under this part's name."""
        own = self.control_idx
        return {
            f"{self.name}_qpos": q[own],
            f"{self.name}_qpos_sin": np.sin(q[own]),
            f"{self.name}_qpos_cos": np.cos(q[own]),
            f"{self.name}_qvel": v[own],
        }

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        return tuple(f"{self.name}_{key}" for key in ("qpos_sin", "qpos_cos", "qvel"))


class ArticulatedTrunk(JointPart):
    """A torso that moves."""

    @property
    def tip(self) -> Link:
        """The link on the last joint."""
        return self._robot.body.joint(self.joint_names[-1]).child

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        return ("trunk_qpos", "trunk_qvel")


class ActiveCamera(JointPart):
    """A head that moves."""


class Locomotion(JointPart):
    """Joints that carry the robot."""

    def __init__(self, robot: RobotBody, joints: tuple[str, ...], floor_links: tuple[str, ...]) -> None:
        super().__init__(robot, "base", joints)
        self.floor_touching_links: tuple[Link, ...] = tuple(robot.body.link(name) for name in floor_links)
