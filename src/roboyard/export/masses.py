"""Mass properties that rigid-body engines accept, by link."""

from __future__ import annotations

import numpy as np

from roboyard.description.mass_properties import MIN_INERTIA, MassProperties, mass_properties
from roboyard.description.model import RobotDescription

MASSLESS_FRACTION = 1e-6
"""Of the robot's mass: what a body is given that has none but must."""


def link_masses(description: RobotDescription) -> dict[str, MassProperties | None]:
    """What each `<inertial>` says, changed only where no rigid body could have it; None for no mass."""
    found: dict[str, MassProperties | None] = {}
    for link in description.links:
        mass = None if link.inertial is None else mass_properties(link.inertial)
        found[link.name] = mass if mass is not None and mass.mass > 0 else None
    return found


def massless_parts(description: RobotDescription, *, fixed_base: bool) -> tuple[str, ...]:
    """Links on a moving joint that weigh nothing together with all links fixed to them.

    Args:
        description: the robot.
        fixed_base: the root does not move and so needs no mass.
    """
    masses = link_masses(description)
    root = description.root.name
    part_of, moving = {root: root}, [] if fixed_base else [root]
    for joint in description.depth_first_joints:
        part_of[joint.child] = joint.child if joint.is_moving else part_of[joint.parent]
        if joint.is_moving:
            moving.append(joint.child)
    heavy = {part for link, part in part_of.items() if masses[link] is not None}
    return tuple(name for name in moving if name not in heavy)


def trace_mass(description: RobotDescription) -> MassProperties:
    """A millionth of the robot: light enough to change nothing, heavy enough to move."""
    masses = [mass.mass for mass in link_masses(description).values() if mass is not None]
    mass = (sum(masses) or 1.0) * MASSLESS_FRACTION
    moment = max(mass * _reach(description) ** 2, MIN_INERTIA)
    return MassProperties(
        mass=mass,
        position=np.zeros(3),
        quaternion=np.array([0.0, 0.0, 0.0, 1.0]),
        principal=np.full(3, moment),
        note="weighs nothing; given a trace",
    )


def _reach(description: RobotDescription) -> float:
    """Longest way from the root to a joint, at least 1 cm; m."""
    distance = {description.root.name: 0.0}
    for joint in description.depth_first_joints:
        distance[joint.child] = distance[joint.parent] + float(np.linalg.norm(joint.origin.position))
    return max(0.01, *distance.values())
