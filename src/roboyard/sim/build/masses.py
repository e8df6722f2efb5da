"""Masses of a whole robot for MuJoCo, which cannot move what weighs nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.description.mass_properties import MIN_INERTIA, MassProperties, mass_properties
from roboyard.description.model import RobotDescription
from roboyard.transforms import to_wxyz

MASSLESS_FRACTION = 1e-6
"""Of the robot's mass: what a moving part without any mass is given."""
TRACE_NOTE = "moves but has no mass; given a trace"


def link_masses(
    description: RobotDescription, *, fixed_base: bool, scale: float
) -> dict[str, MassProperties | None]:
    """Mass properties by link; parts that move but weigh nothing get a trace of the robot's mass.

    A part is a link on a moving joint together with the links fixed to it.
    """
    masses = {
        link.name: None if link.inertial is None else mass_properties(link.inertial, scale)
        for link in description.links
    }
    part_of = {description.root.name: description.root.name}
    moving = [] if fixed_base else [description.root.name]
    for joint in description.depth_first_joints:
        part_of[joint.child] = joint.child if joint.is_moving else part_of[joint.parent]
        if joint.is_moving:
            moving.append(joint.child)
    weight = dict.fromkeys(part_of.values(), 0.0)
    for name, part in part_of.items():
        found = masses[name]
        weight[part] += 0.0 if found is None else found.mass
    total = sum(weight.values()) or 1.0
    for name in moving:
        if weight[name] < 1e-12 * total:
            masses[name] = _trace(total * MASSLESS_FRACTION, _reach(description) * scale)
    return masses


def _reach(description: RobotDescription) -> float:
    """Longest way from the root to a joint, at least 1 cm; m."""
    distance = {description.root.name: 0.0}
    for joint in description.depth_first_joints:
        distance[joint.child] = distance[joint.parent] + float(np.linalg.norm(joint.origin.position))
    return max(0.01, *distance.values())


def _trace(mass: float, reach: float) -> MassProperties:
    """A millionth of the robot: light enough to change nothing, heavy enough where joint axes line up."""
    moment = max(mass * reach**2, MIN_INERTIA)
    return MassProperties(
        mass=mass,
        position=np.zeros(3),
        quaternion=np.array([0.0, 0.0, 0.0, 1.0]),
        principal=np.full(3, moment),
        note=TRACE_NOTE,
    )


def write_mass(element: Any, mass: MassProperties | None) -> None:
    """Put mass properties on a spec body; None and zero mass leave it massless, about its own frame."""
    element.explicitinertial = True
    element.mass = 0.0
    element.ipos, element.iquat = np.zeros(3), (1.0, 0.0, 0.0, 0.0)
    element.inertia = np.zeros(3)
    if mass is None or mass.mass == 0.0:
        return
    element.mass = mass.mass
    element.ipos = mass.position
    element.iquat = to_wxyz(mass.quaternion)
    element.inertia = mass.principal
