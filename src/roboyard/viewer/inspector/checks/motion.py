"""Checks of the drives and of the gripper, simulated in a world of their own."""

from __future__ import annotations

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation

SECONDS = 2.0
"""Duration of the posture check (s)."""
STILL = 0.01
"""Largest speed at the end (rad/s or m/s)."""
ABRUPT = 1.0
"""Speed that a joint held by its drive must never reach (rad/s or m/s)."""
GRIP_SECONDS = 1.5
"""Time for the fingers to reach a limit (s)."""
REACHED = 0.15
"""Distance to a limit that counts as reached, as a fraction of the finger's range."""
MOVED = 0.3
"""Least motion of a finger that meets another one before its limit, as a fraction of its range."""


def _copy(context: CheckContext) -> Body:
    """Return a copy of the robot alone, fixed base, in the current posture, with self-collision."""
    world, before = World(), context.body
    body = world.add_description(context.description, fixed_base=True, self_collision=True, name="copy")
    body.set_pose(before.position, before.orientation)
    names = {link.name for link in body.links}
    for a, b in context.edits.physics_pairs:
        if a in names and b in names:
            world.filters.set(body.link(a), body.link(b), collide=False)
    for joint in before.joints:
        if joint.is_scalar:
            body.joint(joint.name).position = joint.position
    return body


def _hold(body: Body, followers: set[str]) -> None:
    """Drive all joints but the followers to their current positions."""
    for joint in body.joints:
        if joint.is_scalar and joint.name not in followers:
            joint.drive_position(float(joint.position))


def _followers(context: CheckContext) -> set[str]:
    """Return the names of mimic joints, which have no drive of their own."""
    return {joint.name for joint in context.description.joints if joint.mimic is not None}


def holds_posture(context: CheckContext) -> CheckResult:
    """Fix the base, let the drives hold the posture, and measure the joint speeds for two seconds."""
    body = _copy(context)
    world = World.of(body)
    _hold(body, _followers(context))
    fastest = np.zeros(len(body.joint_names))
    try:
        for _ in range(round(SECONDS / world.timestep)):
            world.step()
            fastest = np.maximum(fastest, np.abs(body.joint_velocities))
    except RoboyardError as error:
        return CheckResult(text="The simulation diverged.", violations=[Violation(text=str(error))])
    last = np.abs(body.joint_velocities)
    violations = []
    for k in np.argsort(-fastest, kind="stable"):
        joint = body.joint(body.joint_names[k])
        if last[k] > STILL:
            text = f"{joint.name} still moves at {last[k]:.3g} {_unit(joint.type)}"
        elif fastest[k] > ABRUPT:
            text = f"{joint.name} moved abruptly, at up to {fastest[k]:.3g} {_unit(joint.type)}"
        else:
            continue
        violations.append(Violation(text=text, link=joint.child.name))
    peak = float(fastest.max(initial=0.0))
    text = f"Largest joint speed after {SECONDS:g} s: {last.max(initial=0.0):.2g}; at any time: {peak:.2g}."
    return CheckResult(text=text, violations=violations)


def gripper(context: CheckContext) -> CheckResult:
    """Drive the fingers to both limits and measure how far they move."""
    fingers = set(context.fingers)
    names = [n for n in context.body.joint_names if n in fingers and context.body.joint(n).limits is not None]
    if not names:
        return CheckResult(
            text="No gripper is known; name its fingers in the definition.",
            is_open=True,
        )
    body = _copy(context)
    _hold(body, _followers(context))
    joints, followers = [body.joint(name) for name in names], _followers(context)
    limits = np.array([joint.limits for joint in joints], dtype=float)
    span = np.maximum(np.ptp(limits, axis=1), 1e-9)
    reached = []
    for side in (1, 0):
        for joint, target in zip(joints, limits[:, side], strict=True):
            if joint.name not in followers:
                joint.drive_position(float(target))
        World.of(body).step(round(GRIP_SECONDS / body.world.timestep))
        reached.append(np.array([float(joint.position) for joint in joints]))
    violations = []
    for k, joint in enumerate(joints):
        travel = float(abs(reached[0][k] - reached[1][k]) / span[k])
        missing = [
            float(abs(at[k] - limits[k, side]) / span[k]) for at, side in zip(reached, (1, 0), strict=True)
        ]
        meets = _touches(body, joint.child.name)
        if travel < MOVED or (max(missing) > REACHED and not meets):
            text = f"{joint.name} moves over {travel:.0%} of its range"
            violations.append(Violation(text=text, link=joint.child.name))
    return CheckResult(text=f"{len(names)} fingers driven to both limits.", violations=violations)


def _touches(body: Body, link: str) -> bool:
    """Return whether a link touches another link of the robot."""
    return any(link in (c.link_a.name, c.link_b.name) for c in World.of(body).contacts(body, body))


def _unit(kind: str) -> str:
    """Return the unit of the speed of a type of joint."""
    return "m/s" if kind == "prismatic" else "rad/s"
