"""Compiled commands of single motors."""

from __future__ import annotations

from typing import Any

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
