"""Do collision shapes fit what is seen? Do wheels touch the floor, and are they round? Is the base below?"""

from __future__ import annotations

import numpy as np

from roboyard.transforms import Array
from roboyard.viewer.inspector.checks.status import (
    CheckContext,
    CheckResult,
    Violation,
    points_of,
    world_points,
)

SMALL = 0.03
"""m: links smaller than this may go without a collision shape"""
MARGIN, SHARE = 0.01, 0.25
"""m, and of a link's size: how far a collision shape may stand out or fall short"""
ON_FLOOR = 0.003
"""m"""
ROUND = 0.03
"""Of the radius"""
AT_BOTTOM = 0.005
"""m"""


def collision_fits(subject: CheckContext) -> CheckResult:
    """Compare the box around each link's collision shapes with the box around what is seen of it."""
    offences, compared = [], 0
    bare = set(_without_collision(subject))
    for link in subject.description.links:
        seen = points_of(subject.body, link.name, collision=False)
        felt = points_of(subject.body, link.name, collision=True)
        if not len(seen):
            continue
        size = np.ptp(seen, axis=0)
        if not len(felt):
            if size.max() > SMALL and link.name not in bare:
                told = f"{link.name} is {size.max() * 100:.0f} cm large and has no collision shape"
                offences.append(Violation(told=told, link=link.name))
            continue
        compared += 1
        allowed = np.maximum(MARGIN, SHARE * size)
        out = np.maximum(seen.min(axis=0) - felt.min(axis=0), felt.max(axis=0) - seen.max(axis=0))
        short = np.maximum(felt.min(axis=0) - seen.min(axis=0), seen.max(axis=0) - felt.max(axis=0))
        for gap, how in ((out, "stands out from"), (short, "falls short of")):
            k = int(np.argmax(gap - allowed))
            if gap[k] > allowed[k]:
                told = f"the collision shape of {link.name} {how} what is seen by {gap[k] * 1000:.0f} mm"
                offences.append(Violation(told=f"{told} along {'xyz'[k]}", link=link.name))
    return CheckResult(told=f"{compared} links compared with what is seen of them.", offences=offences)


def _without_collision(subject: CheckContext) -> list[str]:
    """Links that somebody said go without."""
    named = None if subject.definition is None else subject.definition.disabled_collision_link_names
    return [*(named or ()), *subject.notes.bare_links]


def wheels(subject: CheckContext) -> CheckResult:
    """Lowest point of each wheel against the robot's lowest, and its radius all around."""
    names = list(subject.wheels) or _guessed_wheels(subject)
    if not names:
        return CheckResult(
            told="This robot has no wheels that anyone named or that look like some.", is_open=True
        )
    body = subject.body
    floor = min(
        float(points[:, 2].min())
        for link in body.links
        if len(points := world_points(body, link.name, collision=True))
    )
    offences = []
    for name in names:
        felt = world_points(body, name, collision=True)
        if not len(felt):
            offences.append(Violation(told=f"{name} has no collision shape to stand on", link=name))
            continue
        above = float(felt[:, 2].min()) - floor
        if above > ON_FLOOR:
            offences.append(Violation(told=f"{name} ends {above * 1000:.1f} mm above the floor", link=name))
        off = out_of_round(points_of(body, name, collision=True), _axes(subject, name))
        if off > ROUND:
            told = f"{name} is no wheel to roll on: its radius varies by {off:.0%}"
            offences.append(Violation(told=told, link=name))
    return CheckResult(told=f"{len(names)} wheels: {', '.join(names)}.", offences=offences)


def _axes(subject: CheckContext, name: str) -> list[Array]:
    """Directions that a wheel may turn about: its joint's, or where that is fixed any of its frame's."""
    joint = subject.body.joint_of(subject.body.link(name))
    if joint is not None and joint.type in ("continuous", "revolute"):
        return [np.asarray(joint.axis, dtype=float)]
    return list(np.eye(3))


def out_of_round(points: Array, axes: list[Array]) -> float:
    """How much the radius of (n, 3) points about the roundest of some axes varies, as a share of it.

    The radius in a direction is the reach of the convex hull, so that what lies inside counts for nothing.
    """
    angles = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    best = np.inf
    for axis in axes:
        along = axis / np.linalg.norm(axis)
        first = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
        first /= np.linalg.norm(first)
        second = np.cross(along, first)
        around = np.outer(np.cos(angles), first) + np.outer(np.sin(angles), second)
        reach = (points @ around.T).max(axis=0)
        width = reach + np.roll(reach, len(angles) // 2)  # wherever the centre is
        best = min(best, float(np.ptp(width) / max(width.max(), 1e-9)))
    return best


def _guessed_wheels(subject: CheckContext) -> list[str]:
    """Links on endless, level axes that reach down to the robot's lowest point."""
    body, found = subject.body, []
    lowest = float(body.bounds[0, 2])
    for joint in body.joints:
        if joint.type != "continuous":
            continue
        from roboyard.transforms import rotate

        axis = rotate(joint.child.pose[1], joint.axis / np.linalg.norm(joint.axis))
        points = world_points(body, joint.child.name, collision=True)
        if abs(axis[2]) < 0.3 and len(points) and points[:, 2].min() < lowest + 5 * ON_FLOOR:
            found.append(joint.child.name)
    return found


def base_frame(subject: CheckContext) -> CheckResult:
    """Height of the base frame over the robot's lowest point."""
    body, definition = subject.body, subject.definition
    name = None if definition is None else definition.base_footprint_link_name
    base = body.link(name) if name is not None and name in {k.name for k in body.links} else body.links[0]
    above = float(base.pose[0][2] - body.bounds[0, 2])
    told = f"The frame of {base.name} is {above * 1000:.1f} mm above the robot's lowest point."
    if abs(above) <= AT_BOTTOM:
        return CheckResult(told=told)
    advice = "an import with canonical_frame puts it at the bottom"
    return CheckResult(told=told, offences=[Violation(told=f"{told[:-1]}; {advice}", link=base.name)])
