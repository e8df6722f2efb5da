"""Robot descriptions: read URDF, walk the tree, write it back. Plain data, no physics."""

from __future__ import annotations

from roboyard.urdf.auditing import Audit, Finding, Severity, audit
from roboyard.urdf.kinematics import chain, forward_kinematics
from roboyard.urdf.model import (
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
from roboyard.urdf.omnigibson_alias import install_omnigibson_alias
from roboyard.urdf.preprocessing import (
    copy_robot_to_models,
    link_has_dedicated_collision,
    override_joint_limits,
    rewrite_mesh_paths,
    sanitize_names,
    set_joint_dynamics,
    stage_meshes,
    strip_mimic_joints,
    urdf_audit,
)
from roboyard.urdf.read import load_urdf
from roboyard.urdf.repairing import Repair, repair
from roboyard.urdf.resolve import Resolved, Resolver
from roboyard.urdf.write import to_element, write_urdf

__all__ = [
    "Audit",
    "Box",
    "Capsule",
    "Collision",
    "Contact",
    "Cylinder",
    "Finding",
    "Geometry",
    "Heightfield",
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
    "Repair",
    "Resolved",
    "Resolver",
    "RobotDescription",
    "Severity",
    "Source",
    "Sphere",
    "Visual",
    "audit",
    "chain",
    "copy_robot_to_models",
    "forward_kinematics",
    "install_omnigibson_alias",
    "link_has_dedicated_collision",
    "load_urdf",
    "override_joint_limits",
    "repair",
    "rewrite_mesh_paths",
    "sanitize_names",
    "set_joint_dynamics",
    "stage_meshes",
    "strip_mimic_joints",
    "to_element",
    "urdf_audit",
    "write_urdf",
]
