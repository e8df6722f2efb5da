"""Compiled commands of single motors."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import compiled, record


class Motors(NamedTuple):
    """Arrays of the motors of one body."""

    motors: Any
    """(n, 5) mode, kp, velocity, kd, largest velocity of the body's degrees of freedom."""
    targets: Any
    """(n, 4) positions."""
    rows: Any
    """(j,) row of each joint, -1 for one without a motor of one degree of freedom."""
    limits: Any
    """(j, 2) smallest and largest position (rad or m)."""
    impulses: Any
    """(j,) largest impulse that is in use, NaN where it is unknown."""


_MOTORS = record(Motors, "f8[:,:] f8[:,:] i8[:] f8[:,:] f8[:]")


@compiled(_MOTORS, "i8 i8 f8 f8 f8 f8 f8 f8 f8 -> i8")
def aim_motor(  # pragma: no cover
    arrays, joint, mode, position, velocity, force, kp, kd, fastest, time_step
):
    """Set target and gains of a joint's motor; see `MotorCommands.set`.

    Returns:
        0 without any effect for arguments that need the general path, 1, or 2 where the largest impulse is
        another.
    """
    motors, targets, rows, limits, impulses = arrays
    if joint < 0 or joint >= len(rows) or rows[joint] < 0 or not force > 0.0:
        return 0
    if mode == 2:
        position = min(max(position, limits[joint, 0]), limits[joint, 1])
        fastest = max(fastest, 0.0)
    elif mode == 0:
        position = kp = fastest = 0.0
    else:
        return 0
    total = position + velocity + kp + kd + fastest
    if total - total != 0.0:
        return 0
    write_motor(motors, targets, rows[joint], mode, position, velocity, kp, kd, fastest)
    return 1 if force * time_step == impulses[joint] else 2


def write_motor(  # pragma: no cover
    motors, targets, row, mode, position, velocity, kp, kd, fastest
):
    """Write target and gains of a motor, 2 for position control and 0 for velocity control."""
    motors[row, 0] = 2.0 if mode == 2 else 1.0
    motors[row, 1], motors[row, 2], motors[row, 3], motors[row, 4] = kp, velocity, kd, fastest
    if mode == 2:
        targets[row, 0] = position


@compiled("f8[:,::1] f8[::1] i8[::1] f8[::1] f8[:,::1] f8[::1] -> i8")
def solve_damped(mass, damping, own, right, factor, out):  # pragma: no cover
    """Solve (M + D) x = b for some degrees of freedom by Cholesky's factors; return 1, or 0 without any.

    mass: (nv, nv) symmetric M. damping: (nv,) diagonal D. own: (n,) those degrees of freedom. right: (nv,) b.
    factor: (n, n) or larger, work array. out: (nv,) x, of which those are written.
    """
    count = own.shape[0]
    for a in range(count):
        i = own[a]
        for b in range(a):
            total = mass[i, own[b]]
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            factor[a, b] = total / factor[b, b]
        total, value = mass[i, i] + damping[i], right[i]
        for c in range(a):
            total -= factor[a, c] * factor[a, c]
            value -= factor[a, c] * out[own[c]]
        if not total > 0.0:
            return 0
        factor[a, a] = np.sqrt(total)
        out[i] = value / factor[a, a]
    for a in range(count - 1, -1, -1):
        value = out[own[a]]
        for c in range(a + 1, count):
            value -= factor[c, a] * out[own[c]]
        out[own[a]] = value / factor[a, a]
    return 1
