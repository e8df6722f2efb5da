"""Compiled loops over MuJoCo's contacts that slide."""

from __future__ import annotations

import numpy as np

from roboyard.native import compiled

SHARE = 0.5
"""Of the braking that its weight gives a body. With all of it bodies hop; with none they sink deeper."""


@compiled("u1[:] i4[:,:] i4[:] i4[:] f8[:] -> f8")
def largest_slip(exempt, geom, dim, address, velocity):  # pragma: no cover
    """Return the largest slip (m/s) of all contacts with friction, but for those of two exempt shapes.

    exempt: (ngeom,). geom: (ncon, 2), -1 for none. dim: (ncon,) dimensions of each contact. address: (ncon,)
    row of its normal, -1 for none. velocity: (nefc,) of the constraint rows.
    """
    largest = 0.0
    for i in range(address.shape[0]):
        row, a, b = address[i], geom[i, 0], geom[i, 1]
        if a < 0 or b < 0 or (exempt[a] and exempt[b]):
            continue
        if row >= 0 and dim[i] >= 3:
            largest = max(largest, velocity[row + 1] ** 2 + velocity[row + 2] ** 2)
    return np.sqrt(largest)


@compiled("u1[:] i4[:,:] i4[:] i4[:] f8[:,:] f8 f8[:] f8[:]")
def estimate_lift(exempt, geom, dim, address, friction, gravity, base, aref):  # pragma: no cover
    """Lower the normal references of all contacts as if friction slowed a body down that its weight presses.

    base: (nefc,) receives the normal references as they were. friction: (ncon, 5) coefficients.
    gravity: m/s^2.
    """
    for i in range(address.shape[0]):
        row, a, b = address[i], geom[i, 0], geom[i, 1]
        if row < 0 or a < 0 or b < 0 or (exempt[a] and exempt[b]):
            continue
        base[row] = aref[row]
        total = 0.0
        for k in range(1, dim[i]):
            total += (friction[i, k - 1] * aref[row + k]) ** 2
        aref[row] -= max(0.0, np.sqrt(total) - SHARE * friction[i, 0] ** 2 * gravity)


@compiled("u1[:] i4[:,:] i4[:] i4[:] f8[:,:] f8[:] f8[:] f8 f8[:] f8[:] -> f8")
def remove_lift(  # pragma: no cover
    exempt, geom, dim, address, friction, acceleration, force, timestep, base, aref
):
    """Lower the normal reference of each loaded contact by what its cone adds; return the change (m/s).

    An elliptic cone demands a_n - aref_n >= |mu (a_t - aref_t)| of accelerations a: a contact that the solver
    lets slip separates. acceleration, force: (nefc,) solution. Solve again while the largest change, which is
    returned, is large.
    """
    largest = 0.0
    for i in range(address.shape[0]):
        row, a, b = address[i], geom[i, 0], geom[i, 1]
        if row < 0 or a < 0 or b < 0 or (exempt[a] and exempt[b]) or dim[i] < 3:
            continue
        total = 0.0
        if force[row] > 0.0:
            for k in range(1, dim[i]):
                total += (friction[i, k - 1] * (acceleration[row + k] - aref[row + k])) ** 2
        wanted = base[row] - np.sqrt(total)
        if force[row] > 0.0 or wanted > aref[row]:
            largest = max(largest, abs(wanted - aref[row]) * timestep)
            aref[row] = wanted
    return largest
