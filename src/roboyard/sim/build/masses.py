"""The masses of a robot's links for MuJoCo, which rejects moving bodies without mass."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.description.mass_properties import (
    MASSLESS_FRACTION,
    MassProperties,
    link_masses,
    massless_parts,
    trace_mass,
)
from roboyard.description.model import RobotDescription
from roboyard.transforms import to_wxyz

LEAST_SHARE = 1e-12
"""Share of a robot's mass for its massless parts where joints have no drives that need more, as those of an
impulse engine: it lets massless parts between others have no mass at all."""


def simulated_masses(
    description: RobotDescription, *, fixed_base: bool, scale: float, share: float = MASSLESS_FRACTION
) -> dict[str, MassProperties | None]:
    """Return mass properties by link; moving parts without mass get a trace of the robot's mass.

    Args:
        description: the robot.
        fixed_base: whether the root is fixed and needs no mass.
        scale: uniform length scale; mass grows with its cube.
        share: of the robot's mass that such a part gets.
    """
    masses = link_masses(description, scale, keep_massless=True)
    massless = massless_parts(description, masses, fixed_base=fixed_base)
    if massless:
        trace = trace_mass(description, masses, scale, share)
        masses.update(dict.fromkeys(massless, trace))
    return masses


def write_mass(element: Any, mass: MassProperties | None) -> None:
    """Write mass properties into a spec body; None and mass 0 make it massless, about its own frame."""
    element.explicitinertial = True
    if mass is None or mass.mass == 0.0:
        element.mass = 0.0
        element.ipos, element.iquat = np.zeros(3), (1.0, 0.0, 0.0, 0.0)
        element.inertia = np.zeros(3)
        return
    element.mass = mass.mass
    element.ipos = mass.position
    element.iquat = to_wxyz(mass.quaternion)
    element.inertia = mass.principal
