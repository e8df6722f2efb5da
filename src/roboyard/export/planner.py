"""Values that all planner files have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.description.model import Joint
from roboyard.export.names import identifier
from roboyard.kinematics.joint_order import prim_order_joints, single_dof_joints

if TYPE_CHECKING:
    from roboyard.description.robot_model import PlanningData, RobotModel

SPHERE_BUFFER = 0.002
"""Padding of every sphere against the world (m)."""
ATTACHED_SPHERES = 32
"""Number of spheres reserved for a grasped object."""
MAX_JERK, MAX_ACCELERATION = 500.0, 15.0
"""Limits of every joint (rad/s³ or m/s³, rad/s² or m/s²)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Planner:
    """A robot with the values that planner files state."""

    robot: RobotModel
    data: PlanningData

    @property
    def root(self) -> str:
        """Path of the robot's USD prim."""
        return f"/{identifier(self.robot.name, 'robot')}"

    @property
    def base_link(self) -> str:
        """Root link of the planner's tree, above the virtual joints."""
        return self.robot.description.root.name

    @property
    def end_links(self) -> tuple[str, ...]:
        """End-effector links in the order they were given; the root where there are none."""
        return tuple(effector.link for effector in self.robot.semantic.end_effectors) or (self.base_link,)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All joints of one number in the order of every vector; followers of other joints included."""
        return single_dof_joints(prim_order_joints(self.robot.description))

    @property
    def locked(self) -> dict[str, float]:
        """Joint name to the position at which it is locked (rad or m)."""
        return {name: float(value) for name, value in self.data.lock_joints.items()}

    def rest(self, joint: Joint) -> float:
        """Return a joint's rest position (rad or m); zero or the limit nearest to it where none is given."""
        value = self.robot.semantic.rest.get(joint.name)
        if value is not None:
            return float(value)
        limits = joint.position_limits()
        return 0.0 if limits is None else float(np.clip(0.0, *limits))

    def spheres(self) -> dict[str, list[dict[str, Any]]]:
        """Return the spheres of each link as plain data, links in their given order (m)."""
        return {
            link: [
                {"center": [float(c) for c in sphere.center], "radius": float(sphere.radius)}
                for sphere in spheres
            ]
            for link, spheres in self.data.spheres.items()
        }

    def attached(self) -> dict[str, str]:
        """Return the link of each grasped object with the end effector that holds it."""
        return {f"attached_object_{e.link}": e.link for e in self.robot.semantic.end_effectors}

    def ignore(self, *, attached: bool) -> dict[str, list[str]]:
        """Return the pairs of links not checked for collision; with `attached` also grippers and grasped
        objects.
        """
        pairs = {link: list(others) for link, others in self.data.ignore.items()}
        if attached:
            for effector in self.robot.semantic.end_effectors:
                for link in effector.gripper_links:
                    pairs.setdefault(link, []).append(f"attached_object_{effector.link}")
        return pairs
