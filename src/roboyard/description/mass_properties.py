"""Mass properties a rigid body can have, from what a description says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roboyard.description.model import Inertial
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix

MIN_INERTIA = 1e-12
"""kg m²: below this MuJoCo takes a moving body for one without inertia (its own limit is 1e-15)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MassProperties:
    """What the simulator is given for one link."""

    mass: float
    """kg"""
    position: Array
    """(3,) centre of mass in the link frame; m"""
    quaternion: Array
    """(4,) x, y, z, w: principal axes in the link frame"""
    principal: Array
    """(3,) moments about the principal axes; kg m²"""
    note: str | None = None
    """What had to be changed for a rigid body to have these, or None."""


def mass_properties(inertial: Inertial, scale: float = 1.0) -> MassProperties:
    """Principal moments of an `<inertial>`, changed only where no rigid body could have them.

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
    """The usual case in short: a diagonal tensor that a rigid body can have. None for any other."""
    xx, xy, xz, yy, yz, zz = inertial.inertia
    if xy or xz or yz or not inertial.mass > 0:
        return None
    moments = [moment * scale**5 for moment in (xx, yy, zz)]
    small, middle, large = sorted(moments)
    if not (small >= max(large * 1e-6, MIN_INERTIA) and large - small - middle <= 0):
        return None
    return MassProperties(
        mass=inertial.mass * scale**3,
        position=np.asarray(inertial.origin.position) * scale,
        quaternion=np.asarray(inertial.origin.quaternion),
        principal=np.array(moments),
    )


def possible_moments(principal: Array) -> tuple[Array, str | None]:
    """Nearest principal moments a rigid body can have, and what was wrong with the given ones."""
    moments = np.array(principal, dtype=float)
    problem = None
    floor = max(moments.max() * 1e-6, MIN_INERTIA)
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
