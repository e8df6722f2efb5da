"""Joints whose effort limit is below what gravity needs: a fault of the file, which no gains can repair."""

from __future__ import annotations

from roboyard.robots import Robot

SHARE = 0.95
"""Share of the effort limit that gravity may need."""


def weakness(robot: Robot, joint: str) -> str:
    """Return the effort that a joint's load needs and its limit, as text; empty where it can hold the load.

    Args:
        robot: in the posture that the joint has to hold.
        joint: name of a joint of one degree of freedom.
    """
    if joint not in robot.joint_arrays.index:
        return ""
    robot.joint_arrays.refresh()
    index = robot.joint_arrays.index[joint]
    return text_of(abs(float(robot.joint_arrays.bias[index])), float(robot.limits.effort[index]))


def because_weak(robot: Robot, joint: str) -> str:
    """Return `weakness` as the end of a finding: "; gravity needs ..."."""
    found = weakness(robot, joint)
    return f"; {found}" if found else ""


def text_of(load: float, limit: float) -> str:
    """Return a load (N or N m) and an effort limit as text; empty where the limit suffices."""
    return f"gravity needs {load:.3g} of its effort limit of {limit:.3g}" if load > SHARE * limit else ""
