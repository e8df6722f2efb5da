"""Test joint limits: ranges that are not empty, effort and velocity limits above zero, postures inside."""

from __future__ import annotations

from roboyard.robots import Robot
from roboyard.robots.definition.postures import file_postures
from roboyard.robots.limits import LIMITLESS
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

TOLERANCE = 1e-4
"""Distance by which a posture may exceed a limit (rad or m)."""


def limits_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Count joints and posture entries with impossible values."""
    robot = test_world.robot()
    findings = [*_joints(robot), *_postures(robot)]
    return (
        Gate(
            name="limits",
            title="Joint limits are valid and postures within them",
            figure=float(len(findings)),
            threshold=0.0,
            unit="faults",
            detail=f"{robot.n_dof} joints",
            findings=findings,
            advice=(
                "correct <limit> of the joints listed in the URDF (or in the import), or the posture in the "
                "definition"
            ),
        ),
    )


def _joints(robot: Robot) -> list[str]:
    """Return a finding for each limit of a controlled joint that is impossible."""
    claimed = {name for group in robot.groups.values() for name in group.joints}
    found = []
    for joint in robot.joint_arrays.joints:
        if joint.name not in claimed:
            continue
        limit, bounds = joint.limit, joint.limits
        if bounds is not None and bounds[0] >= bounds[1]:
            found.append(f"joint {joint.name!r}: range {bounds[0]:g} to {bounds[1]:g} is empty")
        if bounds is not None and max(abs(bounds[0]), abs(bounds[1])) > LIMITLESS:
            found.append(
                f"joint {joint.name!r}: range {bounds[0]:g} to {bounds[1]:g} is too wide; set the real limits"
            )
        if joint._built.actuator is None:
            continue
        for key in ("effort", "velocity"):
            value = getattr(limit, key) if limit is not None else None
            if value is not None and value <= 0:
                assumed = getattr(robot.limits, key)[robot.joint_arrays.index[joint.name]]
                found.append(
                    f"joint {joint.name!r}: {key} limit {value:g} locks the joint; assumed {assumed:g}; "
                    "set the real limit"
                )
    return found


def _postures(robot: Robot) -> list[str]:
    """Return a finding for each posture entry outside the limits of its joint."""
    found = []
    for key, posture in file_postures(robot.definition, robot.description, robot.joint_names).items():
        for name, value, (low, high) in zip(robot.joint_names, posture, robot.joint_limits, strict=True):
            if not low - TOLERANCE <= value <= high + TOLERANCE:
                found.append(f"{key}: {name} = {value:g} is outside {low:g} to {high:g}")
    return found
