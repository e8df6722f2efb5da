"""The two directions along a surface in which Bullet solves a contact's friction.

They follow from the normal that points to the first of both shapes. Rounds of the solver depend on them:
where the inertia of what slides differs by direction, and in when they end, since Bullet adds up the changes
of velocity along both before it squares them.
"""

from __future__ import annotations

import numpy as np

PLANE, FIELD = 0, 1
"""MuJoCo's types of these geoms."""
NEARLY_FLAT = np.sqrt(0.5)
"""Height of a unit normal above which the first direction is across x instead of horizontal."""
TURNED = 1e-12
"""Sine of the angle below which directions are the same."""


def turn_slides(contacts, sequence, mechanism, surface, points, solver, velocity):  # pragma: no cover
    """Turn pairs of sliding and rolling rows, and the frames of their contacts, to Bullet's directions."""
    order, ends, frame, address = solver.order, solver.ends, contacts.frame, contacts.address
    sliding, rolling = ends[3], ends[2]
    for k in range(sequence.shape[0]):
        i = sequence[k]
        if address[i] < 0 or contacts.dim[i] < 3 or sliding >= ends[4] or order[sliding, 0] != address[i] + 1:
            continue
        a, b = contacts.geom[i, 0], contacts.geom[i, 1]
        cosine, sine = turn_frame(frame, i, a, b, mechanism.geom_type, surface.compound, points.entered)
        rolls = contacts.dim[i] > 5
        if sine != 0.0:
            turn_pair(solver, velocity, sliding, cosine, sine)
            if rolls:
                turn_pair(solver, velocity, rolling, cosine, sine)
        sliding += 2
        rolling += 2 if rolls else 0


def turn_frame(frame, i, a, b, geom_type, compound, ages):
    """Turn contact i's frame about its normal to Bullet's directions; return the angle's cosine and sine.

    a, b: the contact's geoms. Frames that are turned by less than `TURNED` remain; the sine is 0 then.
    """
    sign = 1.0 if comes_second(geom_type, compound, ages, a, b) else -1.0
    x, y, z = sign * frame[i, 0], sign * frame[i, 1], sign * frame[i, 2]
    # of Bullet's two directions the one that completes a right-handed frame with MuJoCo's normal
    if abs(z) > NEARLY_FLAT:
        scale = 1.0 / np.sqrt(y * y + z * z)
        tx, ty, tz = 0.0, -z * scale, y * scale
    else:
        scale = 1.0 / np.sqrt(x * x + y * y)
        tx, ty, tz = -y * scale, x * scale, 0.0
    if sign < 0.0:
        tx, ty, tz = y * tz - z * ty, z * tx - x * tz, x * ty - y * tx
    cosine = tx * frame[i, 3] + ty * frame[i, 4] + tz * frame[i, 5]
    sine = tx * frame[i, 6] + ty * frame[i, 7] + tz * frame[i, 8]
    if abs(sine) <= TURNED:
        return cosine, 0.0
    for d in range(3):
        u, v = frame[i, 3 + d], frame[i, 6 + d]
        frame[i, 3 + d], frame[i, 6 + d] = cosine * u + sine * v, cosine * v - sine * u
    return cosine, sine


def turn_pair(solver, velocity, n, cosine, sine):
    """Turn rows n and n + 1."""
    jacobian, row, other = solver.jacobian, solver.order[n, 0], solver.order[n + 1, 0]
    for k in range(solver.spans[n, 1] + solver.spans[n, 3]):
        u, v = jacobian[n, k], jacobian[n + 1, k]
        jacobian[n, k], jacobian[n + 1, k] = cosine * u + sine * v, cosine * v - sine * u
    u, v = velocity[row], velocity[other]
    velocity[row], velocity[other] = cosine * u + sine * v, cosine * v - sine * u


def comes_second(geom_type, compound, ages, a, b):
    """Return whether Bullet lists geom b before a: compounds first, then convex shapes, then surfaces.

    Parts of compounds within compounds come before other parts.
    """
    one, two = kind_of(geom_type, compound, a), kind_of(geom_type, compound, b)
    return two > one or (two == one and ages[b] < ages[a])


def kind_of(geom_type, compound, geom):
    """Return a number that is larger for geoms that Bullet lists before others."""
    return 0 if geom_type[geom] == PLANE or geom_type[geom] == FIELD else 1 + compound[geom]
