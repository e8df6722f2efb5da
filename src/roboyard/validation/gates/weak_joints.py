"""Joints whose effort limit is below what gravity needs: a fault of the file, which no gains can repair."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from roboyard._arrays import NDArray
from roboyard.robots import Robot

UNDRIVEN = ("spherical", "planar", "floating")
"""Types of joints with several degrees of freedom."""
FULL = 0.98
"""Share of the effort limit from which a drive is at it."""
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


def at_limit(robot: Robot) -> NDArray[np.bool_]:
    """Return (n,) whether a joint's drive gave its greatest effort in the last step; a mimic joint has the
    drive of its leader.
    """
    arrays, limits = robot.joint_arrays, robot.limits.effort
    full = (np.abs(arrays.efforts) > FULL * limits) & (limits > 0.0)
    leaders = np.arange(robot.n_dof)
    for index, name in enumerate(robot.joint_names):
        mimic = robot.description.joint_by_name[name].mimic
        if mimic is not None and mimic.joint in arrays.index:
            leaders[index] = arrays.index[mimic.joint]
    return full[leaders]


def because_full(robot: Robot, joint: str) -> str:
    """Return the end of a finding about a joint whose drive, or that of its leader, is at its limit."""
    mimic = robot.description.joint_by_name[joint].mimic
    driven = joint if mimic is None or mimic.joint not in robot.joint_arrays.index else mimic.joint
    limit = robot.limits.effort[robot.joint_arrays.index[driven]]
    return f"; the drive of {driven!r} is at its effort limit of {limit:.3g}"


def because_undriven(robot: Robot, joints: Iterable[str]) -> str:
    """Return the end of a finding that names joints of types that no controller drives; empty without."""
    known = robot.description.joint_by_name
    names = [name for name in joints if name in known and known[name].type in UNDRIVEN]
    if not names:
        return ""
    shown = ", ".join(map(repr, names[:3])) + (", ..." if len(names) > 3 else "")
    kind = known[names[0]].type
    return (
        f"; the file's joint {shown} is of type {kind!r}, which is no type of URDF and which no drive holds; "
        "write three revolute joints"
        if kind == "spherical"
        else f"; the file's joint {shown} is of type {kind!r}, which no drive holds"
    )


def because_weak(robot: Robot, joint: str) -> str:
    """Return `weakness` as the end of a finding: "; gravity needs ..."."""
    found = weakness(robot, joint)
    return f"; {found}" if found else ""


def text_of(load: float, limit: float) -> str:
    """Return a load (N or N m) and an effort limit as text; empty where the limit suffices."""
    return f"gravity needs {load:.3g} of its effort limit of {limit:.3g}" if load > SHARE * limit else ""


def because_loose(robot: Robot, moving: str) -> str:
    """Return the end of a finding about a joint, or the base, that does not come to rest."""
    return because_weak(robot, moving) or because_undriven(robot, robot.description.joint_by_name)
