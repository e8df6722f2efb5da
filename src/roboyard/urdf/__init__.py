"""Robot descriptions: read URDF, walk the tree, write it back. Plain data, no physics."""

from __future__ import annotations

from roboyard.urdf.kinematics import chain, forward_kinematics
from roboyard.urdf.model import (
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    JointType,
    Limit,
    Link,
    Material,
    Mesh,
    Mimic,
    Plane,
    Pose,
    RobotDescription,
    Source,
    Sphere,
    Visual,
)
from roboyard.urdf.read import load_urdf
from roboyard.urdf.resolve import Resolved, Resolver
from roboyard.urdf.write import to_element, write_urdf

__all__ = [
    "Box",
    "Capsule",
    "Collision",
    "Contact",
    "Cylinder",
    "Geometry",
    "Inertial",
    "Joint",
    "JointType",
    "Limit",
    "Link",
    "Material",
    "Mesh",
    "Mimic",
    "Plane",
    "Pose",
    "Resolved",
    "Resolver",
    "RobotDescription",
    "Source",
    "Sphere",
    "Visual",
    "chain",
    "forward_kinematics",
    "load_urdf",
    "to_element",
    "write_urdf",
]
