"""Groups of joints with a name: torso, head, and the joints of a base."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.robots.capabilities.robot_parts import RobotParts
from roboyard.robots.joint_arrays import Indices
from roboyard.sim.link import Link
from roboyard.transforms import Array


class JointPart:
    """A named group of joints of a robot."""

    def __init__(self, robot: RobotParts, name: str, joints: tuple[str, ...]) -> None:
        """Create a group from its name and the names of its joints."""
        self._robot = robot
        self.name = name
        self.joint_names = joints
        self.control_idx: Indices = robot.joint_arrays.indices_of(joints)
        """(k,) indices of the joints in the robot's joint vectors."""

    @property
    def joint_positions(self) -> Array:
        """(k,) joint positions (rad or m)."""
        return self._robot.joint_arrays.q[self.control_idx]

    @property
    def joint_velocities(self) -> Array:
        """(k,) joint velocities (rad/s or m/s)."""
        return self._robot.joint_arrays.v[self.control_idx]

    def proprioception(self, q: Array, v: Array) -> dict[str, Any]:
        """Return positions and velocities under this group's name.

        Args:
            q: (n,) joint positions of the robot (rad or m).
            v: (n,) joint velocities of the robot (rad/s or m/s).

        Returns:
            (k,) arrays by key: positions, their sines and cosines, velocities.
        """
        own = self.control_idx
        return {
            f"{self.name}_qpos": q[own],
            f"{self.name}_qpos_sin": np.sin(q[own]),
            f"{self.name}_qpos_cos": np.cos(q[own]),
            f"{self.name}_qvel": v[own],
        }

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        """Keys of `proprioception` that are observed by default."""
        return tuple(f"{self.name}_{key}" for key in ("qpos_sin", "qpos_cos", "qvel"))


class ArticulatedTrunk(JointPart):
    """A torso that moves."""

    @property
    def tip(self) -> Link:
        """The link on the last joint."""
        return self._robot.body.joint(self.joint_names[-1]).child

    @property
    def default_proprioception(self) -> tuple[str, ...]:
        """Keys of `proprioception` that are observed by default."""
        return ("trunk_qpos", "trunk_qvel")


class ActiveCamera(JointPart):
    """A head that moves."""


class Locomotion(JointPart):
    """The joints of a base: wheels, legs, or the driven virtual joints of a holonomic base."""

    def __init__(self, robot: RobotParts, joints: tuple[str, ...], floor_links: tuple[str, ...]) -> None:
        """Create the group from its joints and the links that touch the floor."""
        super().__init__(robot, "base", joints)
        self.floor_touching_links: tuple[Link, ...] = tuple(robot.body.link(name) for name in floor_links)
