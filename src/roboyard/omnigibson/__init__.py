"""OmniGibson's names on Roboyard: a robot's getters and setters, URDF helpers, and an import alias."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard._lazy import lazy_names
from roboyard.omnigibson.import_alias import install_omnigibson_alias

if TYPE_CHECKING:
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
    from roboyard.omnigibson.wrapped_robot import OmniGibsonRobot, wrap

__all__ = [
    "OmniGibsonRobot",
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
    "wrap",
]

_ROBOT = ("OmniGibsonRobot", "wrap")
__getattr__ = lazy_names(
    __name__,
    {
        name: f"{__name__}.{'wrapped_robot' if name in _ROBOT else 'urdf_helpers'}"
        for name in __all__
        if name != "install_omnigibson_alias"
    },
)
