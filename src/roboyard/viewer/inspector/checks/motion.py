"""Does the robot settle? Does its gripper open and close? Tried in a world of its own."""

from __future__ import annotations

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.viewer.inspector.checks.status import CheckContext, CheckResult, Violation

SECONDS = 2.0
STILL = 0.01
"""rad/s or m/s at the end"""
ABRUPT = 1.0
"""rad/s or m/s: a robot held by its drives should never be as fast"""
GRIP_SECONDS = 1.5
REACHED = 0.15
"""Of a finger's range: nearer than this to a limit is there"""
MOVED = 0.3
"""Of a finger's range: where two fingers meet they need not reach the limit, but must have come this far"""


def _copy(subject: CheckContext) -> Body:
    """The robot alone, bolted, in the posture of the page, with everything colliding that shall."""
    world, before = World(), subject.body
    body = world.add_description(subject.description, fixed_base=True, self_collision=True, name="copy")
    body.set_pose(before.position, before.orientation)
    names = {link.name for link in body.links}
    for a, b in subject.notes.physics_pairs:
        if a in names and b in names:
            world.filters.set(body.link(a), body.link(b), collide=False)
    for joint in before.joints:
        if joint.is_scalar:
            body.joint(joint.name).position = joint.position
    return body


def _hold(body: Body, followers: set[str]) -> None:
    for joint in body.joints:
        if joint.is_scalar and joint.name not in followers:
            joint.drive_position(float(joint.position))


def _followers(subject: CheckContext) -> set[str]:
    """Joints that follow another one and have no drive of their own."""
    return {joint.name for joint in subject.description.joints if joint.mimic is not None}


def settles(subject: CheckContext) -> CheckResult:
    """Bolt the base, let drives hold the posture, and watch the joints for two seconds."""
    body = _copy(subject)
    world = World.of(body)
    _hold(body, _followers(subject))
    fastest = np.zeros(len(body.joint_names))
    try:
        for _ in range(round(SECONDS / world.timestep)):
            world.step()
            fastest = np.maximum(fastest, np.abs(body.joint_velocities))
    except RoboyardError as error:
        return CheckResult(told="The simulation did not survive.", offences=[Violation(told=str(error))])
    last = np.abs(body.joint_velocities)
    offences = []
    for k in np.argsort(-fastest, kind="stable"):
        joint = body.joint(body.joint_names[k])
        if last[k] > STILL:
            told = f"{joint.name} still moves at {last[k]:.3g} {_unit(joint.type)}"
        elif fastest[k] > ABRUPT:
            told = f"{joint.name} jumped, at up to {fastest[k]:.3g} {_unit(joint.type)}"
        else:
            continue
        offences.append(Violation(told=told, link=joint.child.name))
    peak = float(fastest.max(initial=0.0))
    told = f"Fastest joint after {SECONDS:g} s: {last.max(initial=0.0):.2g}; at any time: {peak:.2g}."
    return CheckResult(told=told, offences=offences)


def gripper(subject: CheckContext) -> CheckResult:
    """Drive the fingers to both their limits."""
    wanted = set(subject.fingers)
    names = [n for n in subject.body.joint_names if n in wanted and subject.body.joint(n).limits is not None]
    if not names:
        return CheckResult(
            told="No gripper is named: a definition or an import configuration does.", is_open=True
        )
    body = _copy(subject)
    _hold(body, _followers(subject))
    joints, followers = [body.joint(name) for name in names], _followers(subject)
    limits = np.array([joint.limits for joint in joints], dtype=float)
    span = np.maximum(np.ptp(limits, axis=1), 1e-9)
    reached = []
    for side in (1, 0):
        for joint, target in zip(joints, limits[:, side], strict=True):
            if joint.name not in followers:
                joint.drive_position(float(target))
        World.of(body).step(round(GRIP_SECONDS / body.world.timestep))
        reached.append(np.array([float(joint.position) for joint in joints]))
    offences = []
    for k, joint in enumerate(joints):
        way = float(abs(reached[0][k] - reached[1][k]) / span[k])
        left = [
            float(abs(at[k] - limits[k, side]) / span[k]) for at, side in zip(reached, (1, 0), strict=True)
        ]
        meets = _touches(body, joint.child.name)
        if way < MOVED or (max(left) > REACHED and not meets):
            told = f"{joint.name} moves over {way:.0%} of its range"
            offences.append(Violation(told=told, link=joint.child.name))
    return CheckResult(told=f"{len(names)} fingers driven to both limits.", offences=offences)


def _touches(body: Body, link: str) -> bool:
    return any(link in (c.link_a.name, c.link_b.name) for c in World.of(body).contacts(body, body))


def _unit(kind: str) -> str:
    return "m/s" if kind == "prismatic" else "rad/s"
