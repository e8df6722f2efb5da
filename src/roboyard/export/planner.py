"""What planner files have in common, worked out once."""

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
"""m: padding of every sphere against the world."""
ATTACHED_SPHERES = 32
"""Spheres kept free for an object in the hand."""
MAX_JERK, MAX_ACCELERATION = 500.0, 15.0
"""Of every joint, in rad or m and seconds."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Planner:
    """A robot as a planner sees it."""

    robot: RobotModel
    data: PlanningData

    @property
    def root(self) -> str:
        """Path of the robot's prim."""
        return f"/{identifier(self.robot.name, 'robot')}"

    @property
    def base_link(self) -> str:
        """Where planning starts: the root of the tree, virtual joints included."""
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
        """Joint name to where it is kept."""
        return {name: float(value) for name, value in self.data.lock_joints.items()}

    def rest(self, joint: Joint) -> float:
        """Rest position; zero, or the limit nearest to it, where none is given."""
        value = self.robot.semantic.rest.get(joint.name)
        if value is not None:
            return float(value)
        limits = joint.position_limits()
        return 0.0 if limits is None else float(np.clip(0.0, *limits))

    def spheres(self) -> dict[str, list[dict[str, Any]]]:
        """Link name to spheres, links in the order they were given."""
        return {
            link: [
                {"center": [float(c) for c in ball.center], "radius": float(ball.radius)} for ball in balls
            ]
            for link, balls in self.data.spheres.items()
        }

    def attached(self) -> dict[str, str]:
        """Link that stands for an object in the hand, to the end effector it hangs from."""
        return {f"attached_object_{e.link}": e.link for e in self.robot.semantic.end_effectors}

    def ignore(self, *, attached: bool) -> dict[str, list[str]]:
        """Links whose collision is not checked; with `attached`, grippers may touch what they hold."""
        pairs = {link: list(others) for link, others in self.data.ignore.items()}
        if attached:
            for effector in self.robot.semantic.end_effectors:
                for link in effector.gripper_links:
                    pairs.setdefault(link, []).append(f"attached_object_{effector.link}")
        return pairs
