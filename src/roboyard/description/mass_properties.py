"""Mass properties that rigid-body engines accept, from those of a description: of a link and of all links.

`roboyard.shapes.inertia` computes the tensor of a solid from its shape; here the principal moments of an
`<inertial>` are found, corrected where no rigid body has them, and massless moving parts get a trace of mass.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard._records import dataclass
from roboyard.description.model import Inertial, RobotDescription
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix

MIN_INERTIA = 1e-12
"""Smallest principal moment (kg m²) of a moving body; MuJoCo's own limit is 1e-15."""
LEAST_RATIO = 1e-6
"""Smallest principal moment of a moving body, as a share of the largest."""
MASSLESS_FRACTION = 1e-6
"""Mass of a moving part without mass, as a share of the robot's."""
GRAVITY = 9.81
"""Acceleration of free fall, from which the loads of drives and contacts are computed (m/s²)."""
ORIGIN, UNTURNED = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
"""Place and axes of most inertial frames in their links' frames; read only, as many bodies have them."""
ORIGIN.setflags(write=False)
UNTURNED.setflags(write=False)
_NOWHERE, _IDENTITY = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
TRACE_NOTE = "moves but has no mass; assigned a millionth of the robot's mass"


@dataclass(frozen=True, kw_only=True, slots=True)
class MassProperties:
    """Mass, centre of mass and principal moments of one link."""

    mass: float
    """Mass (kg)."""
    position: Array
    """(3,) centre of mass in the link frame (m)."""
    quaternion: Array
    """(4,) x, y, z, w: principal axes in the link frame."""
    principal: Array
    """(3,) moments about the principal axes (kg m²)."""
    note: str | None = None
    """The correction that was necessary, or None."""


def mass_properties(inertial: Inertial, scale: float = 1.0) -> MassProperties:
    """Return the principal moments of an `<inertial>`, corrected only where no rigid body can have them.

    A diagonal tensor keeps the file's own axes. Moments that are not positive are raised to a
    millionth of the largest; where the largest exceeds the sum of the others (the triangle inequality)
    the two smaller ones are raised equally until it does not.

    Args:
        inertial: as in the file.
        scale: uniform length scale; mass grows with its cube, inertia with its fifth power.
    """
    plain = _plain(inertial, scale)
    if plain is not None:
        return plain
    mass = max(inertial.mass, 0.0) * scale**3
    tensor = inertial.matrix() * scale**5
    position = np.asarray(inertial.origin.position) * scale
    quaternion = np.asarray(inertial.origin.quaternion)
    notes = []
    if inertial.mass < 0:
        notes.append(f"mass {inertial.mass:g} kg is negative, taken as 0")
    off_diagonal = np.abs(tensor - np.diag(np.diag(tensor))).max()
    if off_diagonal > 1e-12 * max(np.abs(tensor).max(), 1e-300):
        principal, axes = np.linalg.eigh(tensor)
        if np.linalg.det(axes) < 0:
            axes[:, 0] *= -1.0
        quaternion = quaternion_from_matrix(matrix_from_quaternion(quaternion) @ axes)
    else:
        principal = np.diag(tensor).copy()
    if mass > 0.0:
        principal, problem = possible_moments(principal)
        if problem:
            notes.append(problem)
    else:
        principal = np.zeros(3)
    return MassProperties(
        mass=mass,
        position=position,
        quaternion=quaternion,
        principal=principal,
        note="; ".join(notes) or None,
    )


def _plain(inertial: Inertial, scale: float) -> MassProperties | None:
    """Handle the usual case fast: a diagonal tensor that a rigid body can have. None for any other."""
    xx, xy, xz, yy, yz, zz = inertial.inertia
    if xy or xz or yz or not inertial.mass > 0:
        return None
    factor = scale**5
    moments = [xx * factor, yy * factor, zz * factor]
    small, middle, large = sorted(moments)
    if not (small >= max(large * LEAST_RATIO, MIN_INERTIA) and large - small - middle <= 0):
        return None
    position, quaternion = inertial.origin.position, inertial.origin.quaternion
    return MassProperties(
        mass=inertial.mass * scale**3,
        position=ORIGIN if position == _NOWHERE else np.asarray(position) * scale,
        quaternion=UNTURNED if quaternion == _IDENTITY else np.asarray(quaternion),
        principal=np.array(moments),
    )


def possible_moments(principal: Array) -> tuple[Array, str | None]:
    """Return the nearest (3,) principal moments (kg m²) of a rigid body, and the error of the given ones."""
    moments = np.array(principal, dtype=float)
    problem = None
    floor = max(moments.max() * LEAST_RATIO, MIN_INERTIA)
    if (moments < floor).any():
        if (moments <= 0).any():
            problem = f"principal moments {_listed(principal)} are not all positive"
        moments = np.maximum(moments, floor)
    order = np.argsort(moments)
    small, middle, large = order
    excess = moments[large] - moments[small] - moments[middle]
    if excess > 1e-9 * moments[large]:
        problem = problem or f"principal moments {_listed(principal)} break the triangle inequality"
    if excess > 0:
        moments[small] += excess / 2
        moments[middle] += excess / 2
        while moments[small] + moments[middle] < moments[large]:
            moments[middle] = np.nextafter(moments[middle], np.inf)
    return moments, problem


def _listed(values: Array) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"


def link_masses(
    description: RobotDescription, scale: float = 1.0, *, keep_massless: bool = False
) -> dict[str, MassProperties | None]:
    """Return the mass properties of all links by name; None for a link without mass.

    Args:
        description: the robot.
        scale: uniform length scale; mass grows with its cube.
        keep_massless: return mass properties of mass 0, with their notes, for an inertial without mass.
    """
    found: dict[str, MassProperties | None] = {}
    for link in description.links:
        mass = None if link.inertial is None else mass_properties(link.inertial, scale)
        found[link.name] = mass if mass is not None and (keep_massless or mass.mass > 0) else None
    return found


def part_masses(
    description: RobotDescription, masses: Mapping[str, MassProperties | None]
) -> dict[str, float]:
    """Return the mass (kg) of every part by the name of its first link.

    A part is the root or a link on a moving joint, together with all links fixed to it.
    """
    part_of = {description.root.name: description.root.name}
    for joint in description.depth_first_joints:
        part_of[joint.child] = joint.child if joint.is_moving else part_of[joint.parent]
    total = dict.fromkeys(part_of.values(), 0.0)
    for name, part in part_of.items():
        found = masses[name]
        total[part] += 0.0 if found is None else found.mass
    return total


def massless_parts(
    description: RobotDescription, masses: Mapping[str, MassProperties | None], *, fixed_base: bool
) -> tuple[str, ...]:
    """Return the first links of all moving parts without mass, which no rigid-body engine can simulate.

    Args:
        description: the robot.
        masses: from `link_masses`.
        fixed_base: whether the root is fixed and needs no mass.
    """
    parts = part_masses(description, masses)
    negligible = 1e-12 * (sum(parts.values()) or 1.0)
    root = description.root.name
    return tuple(
        name for name, mass in parts.items() if mass < negligible and not (fixed_base and name == root)
    )


def trace_mass(
    description: RobotDescription,
    masses: Mapping[str, MassProperties | None],
    scale: float = 1.0,
    share: float = MASSLESS_FRACTION,
) -> MassProperties:
    """Return the mass properties to give a massless moving part: a millionth of the robot's mass.

    This is light enough to change nothing, and heavy enough where joint axes coincide.

    Args:
        description: the robot.
        masses: from `link_masses`, with the same scale.
        scale: uniform length scale.
        share: of the robot's mass that the part gets instead.
    """
    mass = (sum(part_masses(description, masses).values()) or 1.0) * share
    moment = max(mass * (_reach(description) * scale) ** 2, MIN_INERTIA)
    return MassProperties(
        mass=mass,
        position=np.zeros(3),
        quaternion=np.array([0.0, 0.0, 0.0, 1.0]),
        principal=np.full(3, moment),
        note=TRACE_NOTE,
    )


def _reach(description: RobotDescription) -> float:
    """Longest path from the root to a joint (m), at least 1 cm."""
    distance = {description.root.name: 0.0}
    for joint in description.depth_first_joints:
        distance[joint.child] = distance[joint.parent] + float(np.linalg.norm(joint.origin.position))
    return max(0.01, *distance.values())
