"""Robot descriptions: read URDF, walk the tree, write it back. Plain data, no physics."""

from __future__ import annotations

from roboyard._lazy import deferred

with deferred("xml.etree.ElementPath"):  # for paths to elements, which few readers ask for
    import xml.etree.ElementTree as ElementTree  # noqa: F401

from roboyard.description.files.resolver import Resolved, Resolver
from roboyard.description.loader import load_description
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Heightfield,
    Inertial,
    Joint,
    JointType,
    Limit,
    Link,
    LoopJoint,
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
from roboyard.description.urdf.write import to_element, write_urdf

__all__ = [
    "Box",
    "Capsule",
    "Collision",
    "Contact",
    "Cylinder",
    "Geometry",
    "Heightfield",
    "Inertial",
    "Joint",
    "JointType",
    "Limit",
    "Link",
    "LoopJoint",
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
    "load_description",
    "to_element",
    "write_urdf",
]
