"""Variants of a robot with another gripper: the changed definition, and the description of its links."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.registry import RegisteredRobot


def with_end_effector(definition: RobotDefinition, name: str) -> tuple[str, RobotDefinition]:
    """Return the model name and the definition of a robot with an end effector.

    Raises:
        ConfigError: the definition has no such variant, or the variant has no URDF.
    """
    block = definition.manipulation
    variants = (block.end_effectors if block is not None else None) or {}
    if block is None or name not in variants:
        raise ConfigError(f"end_effector: {unknown_name('end effector', name, variants)}")
    variant = variants[name]
    if variant.not_support_urdf:
        raise ConfigError(f"end_effector: {name!r} has no URDF (not_support_urdf); choose another")
    arms = block.model_copy(
        update={
            "eef_link_names": variant.eef_link_names,
            "finger_link_names": variant.finger_link_names,
            "finger_joint_names": variant.finger_joint_names,
            "opening_direction": {
                arm: way
                for arm, way in (block.opening_direction or {}).items()
                if variant.finger_joint_names.get(arm) == block.finger_joint_names.get(arm)
            },
            "teleop_rotation_offset": variant.teleop_rotation_offset or block.teleop_rotation_offset,
            "assisted_grasp_start_points": variant.ag_start_points or block.assisted_grasp_start_points,
            "assisted_grasp_end_points": variant.ag_end_points or block.assisted_grasp_end_points,
        }
    )
    pairs = variant.disabled_collision_pairs
    changed = definition.model_copy(
        update={
            "manipulation": arms,
            "default_joint_pos": variant.default_joint_pos,
            "disabled_collision_pairs": definition.disabled_collision_pairs if pairs is None else pairs,
            "urdf_path": variant.urdf_path or definition.urdf_path,
            "usd_path": variant.usd_path or definition.usd_path,
            "curobo_path": variant.curobo_path or definition.curobo_path,
        }
    )
    return variant.model, changed


def description_with(robot: RegisteredRobot, definition: RobotDefinition, name: str) -> RobotDescription:
    """Return the description of a registered robot with an end effector.

    It is loaded from the variant's `urdf_path`, else from the robot of the variant's `model`.

    Raises:
        ConfigError: there is no URDF.
        DescriptionError: the URDF cannot be loaded.
    """
    block = definition.manipulation
    assert block is not None and block.end_effectors is not None
    variant = block.end_effectors[name]
    if variant.urdf_path is None and variant.model != robot.name:
        file = robot.folder.parent / variant.model / f"{variant.model}.yaml"
        definition = definition.model_copy(update={"urdf_path": None})
        robot = replace(robot, name=variant.model, file=file)
    return robot.description(definition)
