"""A rest posture in which no two links overlap that the robot can hold apart.

At zero an arm is often in the body, or a thumb in the palm. Links that overlap in most other postures as
well (a cover around a joint) are the file's own. For each other pair the joints between its two links are
turned, one at a time, until the pair is free and no new one touches; the smallest turn is chosen. Where no
single joint frees a pair, random turns of all of them are tried.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

import numpy as np

from roboyard.description.model import Joint, RobotDescription
from roboyard.importer.planning.contact_checker import ContactChecker, Pair, Posture
from roboyard.importer.planning.self_collision import sample_range

OVERLAP = 1e-3
"""Depth from which a pair overlaps (m)."""
TOUCH = 1e-4
"""Depth from which a turn counts as the cause of a new contact (m)."""
USUAL, SAMPLES = 0.6, 24
"""Share of random postures in which a pair of the file's own overlaps, and their number."""
STEPS = 40
"""Positions tried of each joint."""
SLIDE_COST = 3.0
"""Cost of a slide by one metre, in radians."""
MOST_TURN = np.pi / 2
"""Largest turn of a joint alone (rad)."""
TRIES = 400
"""Random turns of several joints."""
DIGITS = 2
"""Of the positions (rad or m)."""
MOST_PAIRS = 40
"""Pairs that are tried at most."""


def contact_free_posture(
    checker: ContactChecker,
    rest: Posture,
    still: Collection[str] = (),
    allows: Callable[[Posture], bool] = lambda posture: True,
) -> dict[str, float]:
    """Return new positions of the joints to move (rad or m); empty where nothing overlaps at rest.

    Args:
        checker: of the robot.
        rest: its rest posture: every joint of one degree of freedom (rad or m).
        still: joints that stay, such as those of wheels and legs.
        allows: whether a posture may be taken; all may by default.
    """
    deep = _deep(checker.overlaps(rest))
    if not deep:
        return {}
    description = checker.description
    usual = _usual(checker, rest, deep)
    posture, moved = dict(rest), set[str]()
    for pair in sorted(deep - usual, key=lambda pair: (-checker.overlaps(rest).get(pair, 0.0), pair))[
        :MOST_PAIRS
    ]:
        if checker.overlaps(posture).get(pair, 0.0) <= OVERLAP:
            continue
        joints = [joint for joint in joints_between(description, *pair) if joint.name not in still]
        joints = [joint for joint in joints if joint.mimic is None and joint.name in rest]
        change = _freed(checker, posture, pair, joints, allows)
        posture |= change
        moved |= change.keys()
    return {name: posture[name] for name in rest if name in moved and posture[name] != rest[name]}


def joints_between(description: RobotDescription, a: str, b: str) -> list[Joint]:
    """Return the moving joints of one degree of freedom on the way from one link to another."""
    ways = [list(_above(description, link)) for link in (a, b)]
    names = [{joint.name for joint in way} for way in ways]
    shared = names[0] & names[1]
    found = [joint for way in ways for joint in way if joint.name not in shared]
    leaders = {joint.name: joint for joint in found}
    for joint in list(found):
        while joint.mimic is not None and joint.mimic.joint in description.joint_by_name:
            joint = description.joint_by_name[joint.mimic.joint]
            leaders.setdefault(joint.name, joint)
    return [joint for joint in leaders.values() if joint.type in ("revolute", "continuous", "prismatic")]


def _above(description: RobotDescription, link: str) -> Iterator[Joint]:
    while (joint := description.parent_joint.get(link)) is not None:
        yield joint
        link = joint.parent


def _deep(overlaps: Mapping[Pair, float]) -> set[Pair]:
    return {pair for pair, depth in overlaps.items() if depth > OVERLAP}


def _usual(checker: ContactChecker, rest: Posture, pairs: Collection[Pair]) -> set[Pair]:
    """Return the pairs that overlap in most random postures."""
    rng = np.random.default_rng(0)
    joints = [checker.description.joint_by_name[name] for name in rest]
    ranges = np.array([sample_range(joint) for joint in joints])
    counts = dict.fromkeys(pairs, 0)
    for _ in range(SAMPLES):
        drawn = rng.uniform(ranges[:, 0], ranges[:, 1]).tolist()
        for pair in _deep(checker.overlaps(dict(zip(rest, drawn, strict=True)))) & counts.keys():
            counts[pair] += 1
    return {pair for pair, count in counts.items() if count >= USUAL * SAMPLES}


def _freed(
    checker: ContactChecker,
    posture: Posture,
    pair: Pair,
    joints: Sequence[Joint],
    allows: Callable[[Posture], bool],
) -> dict[str, float]:
    """Return the smallest change of the joints that frees a pair; empty where none is found."""
    before = checker.overlaps(posture)

    def is_free(change: Mapping[str, float]) -> bool:
        now = checker.overlaps({**posture, **change})
        if now.get(pair, 0.0) > 0.0 or not allows({**posture, **change}):
            return False
        return all(depth <= TOUCH or depth <= before.get(other, 0.0) + TOUCH for other, depth in now.items())

    turns = [
        (abs(value - posture[joint.name]) * (SLIDE_COST if joint.type == "prismatic" else 1.0), index, value)
        for index, joint in enumerate(joints)
        for value in _positions(joint, posture[joint.name])
    ]
    for _, index, value in sorted(turns):
        change = {joints[index].name: value}
        if is_free(change):
            return change
    if len(joints) < 2:
        return {}
    rng = np.random.default_rng(0)
    ranges = np.array([sample_range(joint) for joint in joints])
    start = np.array([posture[joint.name] for joint in joints])
    width = ranges[:, 1] - ranges[:, 0]
    drawn = rng.normal(start, np.linspace(0.02, 0.4, TRIES)[:, None] * width, (TRIES, len(joints)))
    for row in np.round(np.clip(drawn, ranges[:, 0], ranges[:, 1]), DIGITS):
        values = np.clip(row, ranges[:, 0], ranges[:, 1])
        change = dict(zip((joint.name for joint in joints), values.tolist(), strict=True))
        if is_free(change):
            return change
    return {}


def _positions(joint: Joint, now: float) -> list[float]:
    """Return positions within a joint's range, without the present one (rad or m)."""
    low, high = sample_range(joint)
    if joint.type != "prismatic":
        low, high = max(low, now - MOST_TURN), min(high, now + MOST_TURN)
    step = max((high - low) / STEPS, 10.0**-DIGITS)
    count = round((high - low) / step)
    values = {round(now + k * step, DIGITS) for k in range(-count, count + 1)}
    return sorted(value for value in values if low <= value <= high and value != now)
