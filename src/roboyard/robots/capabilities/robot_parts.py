"""The members of a robot that its capabilities use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from roboyard.description.model import RobotDescription
from roboyard.robots.control.setup import Group
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.joint_arrays import JointArrays
from roboyard.sim.body import Body
from roboyard.sim.link import Link


class RobotParts(Protocol):
    """A robot's body, joints and controller groups; `roboyard.robots.robot_body.RobotBody` implements it."""

    body: Body
    definition: RobotDefinition
    description: RobotDescription
    joint_arrays: JointArrays
    base_link: Link
    """The link whose frame is the robot's base frame."""

    @property
    def name(self) -> str:
        """Name in the world."""
        ...

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints of one degree of freedom, in the order of joint vectors."""
        ...

    @property
    def groups(self) -> Mapping[str, Group]:
        """Controller groups by name, in action order."""
        ...
