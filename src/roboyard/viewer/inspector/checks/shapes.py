"""Checks that collision shapes fit the visuals, wheels are round and on the floor, the base frame is low."""

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
"""Largest size of a link that needs no collision shape (m)."""
MARGIN, SHARE = 0.01, 0.25
"""Largest distance between the boxes of collision shapes and visuals: in m, or as a fraction of the size."""
ON_FLOOR = 0.003
"""Largest height of a wheel above the floor (m)."""
ROUND = 0.03
"""Largest variation of a wheel's diameter, as a fraction of it."""
AT_BOTTOM = 0.005
"""Largest height of the base frame above the lowest point (m)."""


def collision_fits(context: CheckContext) -> CheckResult:
    """Compare the bounding boxes of each link's collision shapes and visuals."""
    violations, compared = [], 0
    bare = set(_without_collision(context))
    for link in context.description.links:
        seen = points_of(context.body, link.name, collision=False)
        solid = points_of(context.body, link.name, collision=True)
        if not len(seen):
            continue
        size = np.ptp(seen, axis=0)
        if not len(solid):
            if size.max() > SMALL and link.name not in bare:
                text = f"{link.name} is {size.max() * 100:.0f} cm large and has no collision shape"
                violations.append(Violation(text=text, link=link.name))
            continue
        compared += 1
        allowed = np.maximum(MARGIN, SHARE * size)
        out = np.maximum(seen.min(axis=0) - solid.min(axis=0), solid.max(axis=0) - seen.max(axis=0))
        short = np.maximum(solid.min(axis=0) - seen.min(axis=0), seen.max(axis=0) - solid.max(axis=0))
        for gap, how in ((out, "stands out from"), (short, "ends inside")):
            k = int(np.argmax(gap - allowed))
            if gap[k] > allowed[k]:
                text = f"the collision shape of {link.name} {how} its visuals by {gap[k] * 1000:.0f} mm"
                violations.append(Violation(text=f"{text} along {'xyz'[k]}", link=link.name))
    return CheckResult(text=f"{compared} links compared with their visuals.", violations=violations)


def _without_collision(context: CheckContext) -> list[str]:
    """Return the links without collision shapes by the definition or the configuration."""
    named = None if context.definition is None else context.definition.disabled_collision_link_names
    return [*(named or ()), *context.edits.bare_links]


def wheels(context: CheckContext) -> CheckResult:
    """Compare each wheel's lowest point with the robot's, and its diameter in all directions."""
    names = list(context.wheels) or _guessed_wheels(context)
    if not names:
        return CheckResult(text="No wheels are named in the definition or detected.", is_open=True)
    body = context.body
    floor = min(
        float(points[:, 2].min())
        for link in body.links
        if len(points := world_points(body, link.name, collision=True))
    )
    violations = []
    for name in names:
        solid = world_points(body, name, collision=True)
        if not len(solid):
            violations.append(Violation(text=f"{name} has no collision shape", link=name))
            continue
        above = float(solid[:, 2].min()) - floor
        if above > ON_FLOOR:
            violations.append(Violation(text=f"{name} ends {above * 1000:.1f} mm above the floor", link=name))
        off = out_of_round(points_of(body, name, collision=True), _axes(context, name))
        if off > ROUND:
            text = f"{name} is not round: its diameter varies by {off:.0%}"
            violations.append(Violation(text=text, link=name))
    return CheckResult(text=f"{len(names)} wheels: {', '.join(names)}.", violations=violations)


def _axes(context: CheckContext, name: str) -> list[Array]:
    """Return the possible rotation axes of a wheel: its joint's, or all of its frame for a fixed joint."""
    joint = context.body.joint_of(context.body.link(name))
    if joint is not None and joint.type in ("continuous", "revolute"):
        return [np.asarray(joint.axis, dtype=float)]
    return list(np.eye(3))


def out_of_round(points: Array, axes: list[Array]) -> float:
    """Return the variation of the diameter of (n, 3) points about the roundest of some axes, as a fraction.

    The diameter in a direction is that of the convex hull, so that points inside do not count.
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
        width = reach + np.roll(reach, len(angles) // 2)  # independent of the centre
        best = min(best, float(np.ptp(width) / max(width.max(), 1e-9)))
    return best


def _guessed_wheels(context: CheckContext) -> list[str]:
    """Return links on continuous, horizontal joints that reach the robot's lowest point."""
    body, found = context.body, []
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


def base_frame(context: CheckContext) -> CheckResult:
    """Measure the height of the base frame above the robot's lowest point."""
    body, definition = context.body, context.definition
    name = None if definition is None else definition.base_footprint_link_name
    base = body.link(name) if name is not None and name in {k.name for k in body.links} else body.links[0]
    above = float(base.pose[0][2] - body.bounds[0, 2])
    text = f"The frame of {base.name} is {above * 1000:.1f} mm above the robot's lowest point."
    if abs(above) <= AT_BOTTOM:
        return CheckResult(text=text)
    advice = "import with canonical_frame to move it to the bottom"
    return CheckResult(text=text, violations=[Violation(text=f"{text[:-1]}; {advice}", link=base.name)])
