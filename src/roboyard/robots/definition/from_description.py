"""The definition of a robot without a definition file, from its semantics: base, trunk, arms and grippers."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import SemanticDescription
from roboyard.errors import MeshError
from roboyard.export.definition_blocks import definition_blocks
from roboyard.kinematics.joint_order import breadth_first_joints, single_dof_joints
from roboyard.morphology.analyze import complete_semantics, infer_semantics
from roboyard.morphology.upright import standing_orientation
from roboyard.robots.definition.schema import VIRTUAL_JOINTS, RobotDefinition


def default_definition(
    description: RobotDescription, semantic: SemanticDescription | None = None
) -> RobotDefinition:
    """Return a definition with controllers for all driven joints of a robot.

    The groups are those of `roboyard.export.definition_blocks`; arms are driven joint by joint, and joints of
    no other group belong to the trunk.

    Args:
        description: of the robot.
        semantic: of the robot; inferred from its geometry by default.
    """
    semantic = _infer(description) if semantic is None else semantic
    blocks = definition_blocks(description, semantic, arm_controller="JointController")
    data: dict[str, Any] = {"base_footprint_link_name": semantic.base_link, **blocks.data}
    standing = standing_orientation(semantic) if semantic.base_link == description.root.name else None
    if standing is not None and not semantic.wheels:
        data["standing_orientation"] = standing
    if semantic.rest:
        data["default_joint_pos"] = _vector(description, semantic)
    if semantic.disabled_collision_pairs:
        data["disabled_collision_pairs"] = semantic.disabled_collision_pairs
    return RobotDefinition.model_validate(data)


def _vector(description: RobotDescription, semantic: SemanticDescription) -> list[float]:
    """Return the rest posture, breadth first; joints that it does not name are nearest to zero."""
    values = []
    for joint in single_dof_joints(breadth_first_joints(description)):
        lower, upper = joint.position_limits() or (-np.inf, np.inf)
        values.append(float(np.clip(semantic.rest.get(joint.name, 0.0), lower, upper)))
    return values


def _infer(description: RobotDescription) -> SemanticDescription:
    """Return the semantics of a robot by its geometry, or by its virtual joints."""
    joints = description.joint_by_name
    try:
        if not all(name in joints for name in VIRTUAL_JOINTS):
            return infer_semantics(description)
        stated = SemanticDescription(
            base_link=joints[VIRTUAL_JOINTS[5]].child,
            base="holonomic",
            base_joints=tuple(VIRTUAL_JOINTS[k] for k in (0, 1, 5)),
            virtual_joints=VIRTUAL_JOINTS,
        )
        return complete_semantics(description, stated)
    except MeshError:  # without its meshes wheels cannot be recognized; all joints join the trunk
        return SemanticDescription(base_link=description.root.name)
