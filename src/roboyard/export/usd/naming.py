"""Prim names and paths of a robot, worked out once for all the files here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from roboyard.export.names import identifier, identifiers

if TYPE_CHECKING:
    from roboyard.description.robot_model import RobotModel

SCOPES = ("Looks", "PhysicsMaterials")
"""Children of the robot that are no links."""
LINK_CHILDREN = ("visuals", "collisions")
"""Children of every link, so that no joint may be called like them."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Paths:
    """Where prims are."""

    root: str
    """`/<name>`"""
    links: Mapping[str, str]
    """Link name to prim name."""
    joints: Mapping[str, str]
    """Joint name to prim name; unique over the whole robot."""

    def link(self, name: str) -> str:
        """Path of a link's prim."""
        return f"{self.root}/{self.links[name]}"

    def joint(self, parent: str, name: str) -> str:
        """Path of a joint's prim, under its parent link."""
        return f"{self.link(parent)}/{self.joints[name]}"


def paths_of(robot: RobotModel) -> Paths:
    """Prim names for every link and joint."""
    description = robot.description
    sensors = {sensor.name for sensor in robot.sensors} | {"Camera", "Lidar", "VisualSphere"}
    return Paths(
        root=f"/{identifier(robot.name, 'robot')}",
        links=identifiers((link.name for link in description.links), SCOPES, "link"),
        joints=identifiers((joint.name for joint in description.joints), (*LINK_CHILDREN, *sensors), "joint"),
    )


def keep_name(prim: Any, name: str, robot: RobotModel) -> None:
    """Keep the vendor's name where the prim could not have it."""
    original = robot.original_names.get(name, name)
    if original == prim.GetName():
        return
    prim.SetDisplayName(original)
    prim.SetCustomDataByKey("urdf_name", original)
