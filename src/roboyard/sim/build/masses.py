"""The masses of a robot's links for MuJoCo, which rejects moving bodies without mass."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from roboyard.sim.build.records import BuildOptions

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


def masses_of(description: RobotDescription, options: BuildOptions) -> dict[str, MassProperties | None]:
    """Return `simulated_masses` of a body that is built with options."""
    share = LEAST_SHARE if options.hard else MASSLESS_FRACTION
    return simulated_masses(description, fixed_base=options.fixed_base, scale=options.scale, share=share)


def write_mass(element: Any, mass: MassProperties | None) -> None:
    """Write mass properties into a spec body; None and mass 0 make it massless, about its own frame."""
    for name, value in mass_fields(mass).items():
        setattr(element, name, value)


def mass_fields(mass: MassProperties | None) -> dict[str, Any]:
    """Return the fields of a spec body that `write_mass` writes."""
    if mass is None or mass.mass == 0.0:
        nowhere, unturned = np.zeros(3), (1.0, 0.0, 0.0, 0.0)
        return {
            "explicitinertial": True, "mass": 0.0, "ipos": nowhere, "iquat": unturned, "inertia": nowhere,
        }  # fmt: skip
    return {
        "explicitinertial": True,
        "mass": mass.mass,
        "ipos": mass.position,
        "iquat": to_wxyz(mass.quaternion),
        "inertia": mass.principal,
    }
