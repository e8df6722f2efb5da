"""Base, end effectors, trunk and arms, as the configuration states or as geometry and joints suggest."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import EndEffector, SemanticDescription
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.context import ImportContext
from roboyard.morphology.analyze import complete_semantics


def add_semantics(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with complete semantics except postures and disabled collision pairs."""
    semantic = complete_semantics(robot.description, stated_semantics(robot.semantic, context.config))
    if not context.config.curobo.eef_to_gripper_info:
        context.log.note(_end_effector_note(semantic))
    if semantic.trunk_joints and not context.config.curobo.torso_joints:
        context.log.note(f"torso: {', '.join(semantic.trunk_joints)}, which moves all arms")
    return replace(robot, semantic=semantic)


def stated_semantics(semantic: SemanticDescription, config: ImportConfig) -> SemanticDescription:
    """Return the semantics with the configuration's end effectors and trunk."""
    return replace(
        semantic,
        end_effectors=tuple(
            EndEffector(link=link, gripper_links=tuple(g.links), gripper_joints=tuple(g.joints))
            for link, g in config.curobo.eef_to_gripper_info.items()
        ),
        trunk_joints=tuple(config.curobo.torso_joints),
    )


def _end_effector_note(semantic: SemanticDescription) -> str:
    effectors = semantic.end_effectors
    if not effectors[0].gripper_links:
        return f"end effector: {effectors[0].link!r}, the tip of the longest chain of joints"
    grippers = ", ".join(f"{e.link!r} ({len(e.gripper_links)} links)" for e in effectors)
    return f"end effectors: {grippers}, where chains of joints split into fingers"
