"""Test that links which the robot can hold apart are apart in the rest posture.

An import disables the collision of links that overlap at rest, so that the robot does not burst; a posture
that folds an arm into the body would pass unseen. Pairs that also overlap in most other postures are the
file's own (a cover around a joint) and do not count.
"""

from __future__ import annotations

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.robots import Robot
from roboyard.sim.world import World
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld, own_contacts

OVERLAP = 2e-3
"""Depth from which a pair overlaps (m)."""
SAMPLES = 24
"""Number of random postures."""
USUAL = 0.5
"""Share of the postures in which a pair of the file's own overlaps."""
MAX_TURN = np.pi
"""Range of random positions of joints without limits (rad or m)."""


def rest_contact_gates(test_world: TestWorld) -> tuple[Gate, ...]:
    """Count the pairs of links that touch in the rest posture and seldom elsewhere."""
    robot = test_world.robot()
    world = World(visual_geoms=False)
    body = world.add_description(test_world.description, fixed_base=True, self_collision=True, drives=False)
    _pose(robot, body, robot.reset_joint_pos)
    resting = {(a, b): depth for a, b, depth in own_contacts(world, body) if depth > OVERLAP}
    counts = dict.fromkeys(resting, 0)
    if resting:
        rng = np.random.default_rng(test_world.seed)
        low = np.maximum(robot.limits.lower, robot.reset_joint_pos - MAX_TURN)
        high = np.minimum(robot.limits.upper, robot.reset_joint_pos + MAX_TURN)
        for _ in range(SAMPLES):
            _pose(robot, body, rng.uniform(low, np.maximum(high, low)))
            for a, b, depth in own_contacts(world, body):
                if depth > OVERLAP and (a, b) in counts:
                    counts[a, b] += 1
    bad = {
        pair: depth
        for pair, depth in resting.items()
        if counts[pair] < USUAL * SAMPLES and _can_part(test_world.description, *pair)
    }
    return (
        Gate(
            name="rest_contact",
            title="The rest posture touches nothing",
            figure=float(len(bad)),
            threshold=0.0,
            unit="pairs",
            detail=f"links that overlap by more than {OVERLAP * 1e3:g} mm at rest and in less than half of "
            f"{SAMPLES} other postures, disabled pairs included",
            findings=[
                f"{a} and {b} overlap by {depth * 1e3:.1f} mm at rest, and in {counts[a, b]} of {SAMPLES} "
                "other postures"
                for (a, b), depth in sorted(bad.items(), key=lambda item: -item[1])
            ],
            advice="another rest posture (curobo.default_qpos, default_joint_pos), or smaller collision "
            "shapes",
        ),
    )


def _can_part(description: RobotDescription, a: str, b: str) -> bool:
    """Return whether a joint with limits is on the way between two links: a wheel that overlaps its fender
    turns, but no posture holds the two apart.
    """
    ways = []
    for link in (a, b):
        way: set[str] = set()
        while (joint := description.parent_joint.get(link)) is not None:
            way.add(joint.name)
            link = joint.parent
        ways.append(way)
    between = (description.joint_by_name[name] for name in ways[0] ^ ways[1])
    return any(joint.is_moving and joint.position_limits() is not None for joint in between)


def _pose(robot: Robot, body: object, posture: object) -> None:
    """Move a second body of the same description into a posture of the robot; followers follow."""
    values = dict(zip(robot.joint_names, np.asarray(posture, dtype=float), strict=True))
    for _ in range(3):
        for name in values:
            mimic = robot.description.joint_by_name[name].mimic
            if mimic is not None and mimic.joint in values:
                values[name] = mimic.multiplier * values[mimic.joint] + mimic.offset
    for joint in body.joints:  # type: ignore[attr-defined]
        if joint.is_scalar and joint.name in values:
            joint.position = values[joint.name]
