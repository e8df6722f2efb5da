"""Settings that follow from what a robot is understood to be, where the user gave no configuration."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.semantic import SemanticDescription
from roboyard.importer.config.schema import BaseMotion
from roboyard.importer.context import ImportContext


def with_inferred_settings(context: ImportContext, semantic: SemanticDescription) -> ImportContext:
    """Return the context with the settings of the base inferred, unless the user gave a configuration."""
    if context.has_config:
        return context
    config = context.config.model_copy(update={"base_motion": inferred_base_motion(semantic)})
    return replace(context, config=config)


def inferred_base_motion(semantic: SemanticDescription) -> BaseMotion:
    """Return the base's settings: a holonomic base moves by virtual joints, its wheels fixed and spheres."""
    wheels = [wheel.link for wheel in semantic.driven_wheels]
    if semantic.base != "holonomic" or semantic.virtual_joints or not wheels:
        return BaseMotion(wheel_links=wheels)
    rolling = [wheel.joint for wheel in semantic.wheels if not wheel.is_caster]
    fixed = dict.fromkeys((*semantic.steer_joints, *rolling, *semantic.caster_joints))
    return BaseMotion(
        wheel_links=wheels, wheel_joints=list(fixed), use_sphere_wheels=True, use_holonomic_joints=True
    )
