"""Are limits usable: a range that is one, an effort and a speed that can move something, postures inside."""

from __future__ import annotations

import numpy as np

from roboyard.robots import Robot
from roboyard.robots.definition.postures import tuck_posture
from roboyard.robots.limits import LIMITLESS
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld

SLACK = 1e-4
"""rad or m that a posture may lie outside"""


def limits(bench: TestWorld) -> tuple[Gate, ...]:
    """Count joints and posture entries that cannot be."""
    robot = bench.robot()
    findings = [*_joints(robot), *_postures(robot)]
    return (
        Gate(
            name="limits",
            title="Joint limits can be used, postures lie inside",
            figure=float(len(findings)),
            threshold=0.0,
            unit="faults",
            detail=f"{robot.n_dof} joints",
            findings=findings,
            advice=(
                "mend <limit> of the joints named in the URDF (or in the import), or the posture in "
                "the definition"
            ),
        ),
    )


def _joints(robot: Robot) -> list[str]:
    claimed = {name for group in robot.groups.values() for name in group.joints}
    found = []
    for joint in robot.joints.joints:
        if joint.name not in claimed:
            continue
        limit, bounds = joint.limit, joint.limits
        if bounds is not None and bounds[0] >= bounds[1]:
            found.append(f"joint {joint.name!r}: range {bounds[0]:g} to {bounds[1]:g} is empty")
        if bounds is not None and max(abs(bounds[0]), abs(bounds[1])) > LIMITLESS:
            found.append(f"joint {joint.name!r}: range {bounds[0]:g} to {bounds[1]:g} is no range")
        if joint._built.actuator is None:
            continue
        for key in ("effort", "velocity"):
            value = getattr(limit, key) if limit is not None else None
            if value is not None and value <= 0:
                taken = getattr(robot.limits, key)[robot.joints.index[joint.name]]
                found.append(
                    f"joint {joint.name!r}: {key} limit {value:g} lets nothing move it; {taken:g} is taken"
                )
    return found


def _postures(robot: Robot) -> list[str]:
    definition, names = robot.definition, robot.joint_names
    postures = {
        "default_joint_pos": None
        if not definition.default_joint_pos
        else np.array(definition.default_joint_pos),
        "mobile_manipulation.untucked_default_joint_pos": tuck_posture(definition, names, "untuck"),
        "mobile_manipulation.tucked_default_joint_pos": tuck_posture(definition, names, "tuck"),
    }
    found = []
    for key, posture in postures.items():
        if posture is None:
            continue
        for name, value, low, high in zip(
            names, posture, robot.limits.lower, robot.limits.upper, strict=True
        ):
            if not low - SLACK <= value <= high + SLACK:
                found.append(f"{key}: {name} = {value:g} lies outside {low:g} to {high:g}")
    return found
