"""Test joint limits: ranges that are possible, effort and velocity limits above zero, postures inside."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from roboyard.description.mass_properties import GRAVITY
from roboyard.robots import Robot
from roboyard.robots.definition.postures import file_postures
from roboyard.robots.limits import LIMITLESS
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld, own_contacts

TOLERANCE = 1e-4
"""Distance by which a posture may exceed a limit (rad or m)."""
TURNS = 2.0
"""Turns of a hinge's range from which its links are expected to go round."""
POSITIONS = 36
"""Positions of a turn that are tried."""
DEPTH = 3e-3
"""Least depth of an overlap that stops a turn (m)."""
TOO_STRONG = 50.0
"""Effort limit / the torque of the robot's weight at its full length, above which it is no motor's."""


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
            warnings=[*_too_strong(robot)],
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


def _too_strong(robot: Robot) -> Iterator[str]:
    """Yield a warning for effort limits of hinges that are far above what the robot's weight could need."""
    mass = sum(link.inertial.mass for link in robot.description.links if link.inertial is not None)
    length = float(np.linalg.norm(np.ptp(robot.body.bounds, axis=0)))
    needed = mass * GRAVITY * length
    strong: dict[float, list[str]] = {}
    for joint in robot.joint_arrays.joints:
        effort = joint.limit.effort if joint.limit is not None else None
        if joint.type not in ("revolute", "continuous") or joint._built.actuator is None:
            continue
        if effort is not None and math.isfinite(effort) and effort > TOO_STRONG * needed > 0.0:
            strong.setdefault(effort, []).append(joint.name)
    for effort, names in strong.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        yield (
            f"joint {names[0]!r}{more}: effort limit {effort:g} N m is {effort / needed:.0f} times what "
            f"holds the whole robot ({mass:.3g} kg) at its full length of {length:.2g} m: no motor's, and "
            f"commands can throw it about faster than a simulation follows{_stopped(robot, names)}; set the "
            "real limits"
        )


def _stopped(robot: Robot, names: list[str]) -> str:
    """Return what a range of several turns drives one of these hinges into; empty where there is none."""
    before = {(a, b) for a, b, _ in own_contacts(robot.world, robot.body)}
    for joint in robot.joint_arrays.joints:
        bounds = joint.limits
        if joint.name not in names or bounds is None or bounds[1] - bounds[0] < TURNS * math.tau:
            continue
        start = joint.position
        for turned in np.linspace(0.0, math.tau, POSITIONS, endpoint=False)[1:]:
            joint.position = start + (turned if start + turned <= bounds[1] else turned - math.tau)
            for a, b, depth in own_contacts(robot.world, robot.body):
                if depth > DEPTH and (a, b) not in before:
                    position = joint.position
                    joint.position = start
                    return (
                        f"; the range of {joint.name!r}, {bounds[0]:g} to {bounds[1]:g}, is of more than "
                        f"{TURNS:g} turns, but at {position:.2f} {a} meets {b}"
                    )
        joint.position = start
    return ""


def _postures(robot: Robot) -> list[str]:
    """Return a finding for each posture entry outside the limits of its joint."""
    found = []
    for key, posture in file_postures(robot.definition, robot.description, robot.joint_names).items():
        for name, value, (low, high) in zip(robot.joint_names, posture, robot.joint_limits, strict=True):
            if not low - TOLERANCE <= value <= high + TOLERANCE:
                found.append(f"{key}: {name} = {value:g} is outside {low:g} to {high:g}")
    return found
