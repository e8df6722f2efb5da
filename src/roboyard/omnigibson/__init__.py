"""OmniGibson's names on Roboyard: its URDF helpers, and an import alias for scripts."""

from __future__ import annotations

from roboyard.omnigibson.import_alias import install_omnigibson_alias
from roboyard.omnigibson.urdf_helpers import (
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

__all__ = [
    "copy_robot_to_models",
    "install_omnigibson_alias",
    "link_has_dedicated_collision",
    "override_joint_limits",
    "rewrite_mesh_paths",
    "sanitize_names",
    "set_joint_dynamics",
    "stage_meshes",
    "strip_mimic_joints",
    "urdf_audit",
]
