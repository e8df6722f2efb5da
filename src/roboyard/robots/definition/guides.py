"""Joints by which the world guides a robot on legs: the slides and the turn of a planar walker."""

from __future__ import annotations

from roboyard.description.model import RobotDescription
from roboyard.morphology.base.virtual import guide_joints
from roboyard.robots.definition.schema import RobotDefinition


def world_guides(definition: RobotDefinition, description: RobotDescription) -> tuple[str, ...]:
    """Return the undriven joints between a root link that is the world and the base, root first; empty for
    robots that are not on legs, and where a group drives one of them.
    """
    base, block = definition.base_footprint_link_name, definition.locomotion
    is_legged = block is not None and definition.two_wheel is None and definition.holonomic_base is None
    if not is_legged or base is None or base not in description.link_by_name:
        return ()
    trunk = definition.articulated_trunk
    driven = {*(block.base_joint_names if block is not None else ())}
    driven |= {*(trunk.trunk_joint_names if trunk is not None else ())}
    found = guide_joints(description, base)
    return () if driven.intersection(found) else found
