"""Base, end effectors, trunk and arms, as the configuration states or as geometry and joints suggest."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import Conclusion, EndEffector, SemanticDescription
from roboyard.description.understanding import conclusions
from roboyard.importer.config.schema import ImportConfig
from roboyard.importer.config.write import THIN
from roboyard.importer.context import ImportContext
from roboyard.morphology.analyze import complete_semantics


def add_semantics(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with complete semantics except postures and disabled collision pairs."""
    found = robot.semantic if robot.semantic.conclusions else None
    stated = stated_semantics(robot.semantic, context.config)
    semantic = complete_semantics(robot.description, stated, found)
    context.log.facts["conclusions"] = conclusions(semantic)
    for conclusion in semantic.conclusions:
        if conclusion.confidence < THIN:
            context.log.warn(f"please check, the evidence is thin: {_conclusion_note(conclusion)}")
        elif conclusion.confidence < 1.0:
            context.log.note(_conclusion_note(conclusion))
    return replace(robot, semantic=semantic)


def stated_semantics(semantic: SemanticDescription, config: ImportConfig) -> SemanticDescription:
    """Return what is certain: the virtual joints of the base, and the configuration's wheels, end effectors
    and trunk.
    """
    moved = bool(semantic.virtual_joints)
    return SemanticDescription(
        base_link=semantic.base_link,
        base=semantic.base if moved else "none",
        base_joints=semantic.base_joints if moved else (),
        virtual_joints=semantic.virtual_joints,
        wheel_links=semantic.wheel_links,
        end_effectors=tuple(
            EndEffector(link=link, gripper_links=tuple(g.links), gripper_joints=tuple(g.joints))
            for link, g in config.curobo.eef_to_gripper_info.items()
        ),
        trunk_joints=tuple(config.curobo.torso_joints),
        postures=semantic.postures,
    )


def _conclusion_note(found: Conclusion) -> str:
    value = ", ".join(map(str, found.value)) if isinstance(found.value, list) else str(found.value)
    reasons = f" ({'; '.join(found.evidence[:3])})" if found.evidence else ""
    change = f"; to change it: {found.setting}" if found.setting else ""
    sure = f"{100 * found.confidence:.0f} % sure"
    return f"{found.field.replace('_', ' ')}: {value or 'none'}, {sure}{reasons}{change}"
