"""Palms: bodies from which fingers move, by the tree, sizes and names."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from roboyard.morphology.skeleton import BASE, Skeleton, is_endless
from roboyard.morphology.words import meanings, share

LONGEST_FINGER = 0.35
"""Reach of a finger (m)."""
FINGER_SHARE = 0.6
"""Largest reach of a finger as a share of the way from the base to the palm."""
HAND_SIZE = 0.5
"""Largest extent of a hand on its own (m)."""
MIN_JOINTS_BEFORE = 3
"""Joints before a palm where no name says that there is one."""
MOST_JOINTS = 9
"""Of a finger, with those that follow."""
FINGER_NAMES = 0.2
"""Share of names from which a hand with a forearm is one."""
BESIDE = 0.6
"""How far the fixed jaw reaches along the moving one, as a share of its length."""
BESIDE_NAMED = 0.3
"""The same where both the joint and its link have names of a jaw."""


def find_palms(skeleton: Skeleton, used: Collection[str] = ()) -> dict[str, tuple[str, ...]]:
    """Return palm bodies, depth first, with the joints of their fingers.

    Args:
        skeleton: the robot.
        used: joints of wheels and rotors.
    """
    own = hands_alone(skeleton, used)
    if own:
        return {
            palm: tuple(name for kid in skeleton.children[palm] for name in skeleton.below(kid))
            for palm in own
        }
    found: dict[str, tuple[str, ...]] = {}
    open_bodies = [name for name in reversed(skeleton.children[BASE]) if name not in used]
    while open_bodies:
        body = open_bodies.pop()
        branches = [name for name in skeleton.children[body] if name not in used]
        kids = _with_shape(skeleton, branches)
        if _is_palm(skeleton, body, kids):
            found[body] = tuple(joint for kid in kids for joint in skeleton.below(kid))
        elif len(kids) == 1 and _is_jaw(skeleton, body, kids[0]):
            found[body] = tuple(skeleton.below(kids[0]))
        else:
            open_bodies += reversed(branches)
    return found


def _with_shape(skeleton: Skeleton, kids: list[str]) -> list[str]:
    """Return the branches that move a shape, lead or follow, all where none does: what turns an empty
    frame is no finger.
    """
    drawn = [name for name in kids if len(skeleton.points_below(name))]
    leaders = {joint.mimic.joint for joint in skeleton.joint.values() if joint.mimic is not None}
    kept = {*drawn, *leaders, *(name for name in kids if not skeleton.is_driven(name))}
    return [name for name in kids if name in kept] if drawn else kids


def _names(skeleton: Skeleton, joints: Collection[str]) -> list[str]:
    return [text for name in joints for text in (name, skeleton.joint[name].child)]


def _is_palm(skeleton: Skeleton, body: str, kids: list[str]) -> bool:
    if len(kids) < 2:
        return False
    before = skeleton.path(body)
    fingers = [joint for kid in kids for joint in skeleton.below(kid)]
    named = share("finger", _names(skeleton, fingers))
    if share("head", _names(skeleton, [*before[-2:], *fingers])) > 0.3:
        return False
    if share("leg", _names(skeleton, [*before, *fingers])) > 0.3 and named < 0.5:
        return False
    if len(before) < (1 if named > 0.5 else MIN_JOINTS_BEFORE):
        return False
    if max(len(skeleton.below(kid)) for kid in kids) > MOST_JOINTS:
        return False
    way = skeleton.length([*before, kids[0]])
    reach = max(skeleton.reach(kid) for kid in kids)
    longest = LONGEST_FINGER if named < 0.5 else 2 * LONGEST_FINGER
    if reach > longest or reach > (FINGER_SHARE if named < 0.5 else 1.5) * way:
        return False
    depth = max(skeleton.depth(kid) for kid in kids)
    if named < 0.2 and depth >= len(before):
        return False
    return named > 0.2 or _opposed(skeleton, kids) or len(kids) >= 3


def _opposed(skeleton: Skeleton, kids: list[str]) -> bool:
    """Return whether two branches are alike: equal types of joints and about equal reach."""
    first, second = kids[:2]
    kinds = [[skeleton.joint[name].type for name in skeleton.below(kid)] for kid in (first, second)]
    a, b = skeleton.reach(first), skeleton.reach(second)
    return kinds[0] == kinds[1] and min(a, b) >= 0.5 * max(a, b)


def _is_jaw(skeleton: Skeleton, body: str, kid: str) -> bool:
    """Return whether the last joint of an arm moves one jaw against a fixed one."""
    joint = skeleton.joint[kid]
    limits = joint.position_limits()
    if skeleton.children[kid] or limits is None or len(skeleton.path(body)) < MIN_JOINTS_BEFORE:
        return False
    words = meanings(kid) | meanings(joint.child)
    points, fixed = skeleton.points(kid), skeleton.points(body)
    if "leg" in words or "head" in words or not len(points) or not len(fixed):
        return "finger" in words
    here = skeleton.origin(kid)
    far = points[np.linalg.norm(points - here, axis=1).argmax()] - here
    length = float(np.linalg.norm(far))
    if length <= 0:
        return False
    along = far / length
    axis = skeleton.axis(kid)
    across = abs(float(axis @ along)) < 0.6
    overlap = float(((fixed - here) @ along).max()) / length
    beside = overlap > BESIDE
    one_sided = min(abs(limits[0]), abs(limits[1])) < 0.25 * max(abs(limits[0]), abs(limits[1]))
    if "finger" in words:
        twice = "finger" in meanings(kid) and "finger" in meanings(joint.child)
        return across and (beside or one_sided or (twice and overlap > BESIDE_NAMED))
    return across and beside and one_sided


def hands_alone(skeleton: Skeleton, used: Collection[str] = ()) -> list[str]:
    """Return the palms of a robot that is one hand or gripper, or several hands on wrists; none for others.

    Args:
        skeleton: the robot.
        used: joints of wheels and rotors.
    """
    kids = skeleton.children[BASE]
    if not kids or used or skeleton.size <= 0:
        return []
    palms = [palm for kid in kids if (palm := _palm_on_a_wrist(skeleton, kid)) is not None]
    most = 2 * HAND_SIZE if _names_fingers(skeleton) else HAND_SIZE  # a forearm may belong to it
    if len(palms) == len(kids) and (len(kids) > 1 or skeleton.size < most):
        return palms
    return [BASE] if len(kids) > 1 and skeleton.size < HAND_SIZE and _is_hand(skeleton, kids) else []


def _names_fingers(skeleton: Skeleton) -> bool:
    return share("finger", _names(skeleton, skeleton.joint)) > FINGER_NAMES


def _is_hand(skeleton: Skeleton, kids: list[str]) -> bool:
    """Return whether several chains that begin at the base are fingers."""
    joints = [joint for kid in kids for joint in skeleton.below(kid)]
    named = share("finger", _names(skeleton, joints))
    if max(len(skeleton.below(kid)) for kid in kids) > (MOST_JOINTS if named < 0.9 else 3 * MOST_JOINTS):
        return False
    loose = sum(is_endless(skeleton.joint[name]) for name in joints)
    if loose > len(joints) / 2 and named < 0.9:
        return False
    names = [*_names(skeleton, joints), skeleton.description.name, *skeleton.links[BASE]]
    named = share("finger", names)
    if share("leg", names) > named or share("wheel", names) > 0.2:
        return False
    if named > 0.3 and len(kids) >= 2:
        return True
    if len(kids) == 2 and len(joints) == 2 and _face_each_other(skeleton, kids):
        return True
    follow = any(not skeleton.is_driven(name) for name in joints)
    return len(kids) >= 2 and (follow or (len(kids) >= 3 and not _on_corners(skeleton, kids)))


def _palm_on_a_wrist(skeleton: Skeleton, joint: str) -> str | None:
    """Return the last of one or two joints that carry at least three short fingers and nothing else."""
    wrist = [joint]
    while len(skeleton.children[wrist[-1]]) == 1 and len(wrist) < 2:
        wrist += skeleton.children[wrist[-1]]
    fingers = skeleton.children[wrist[-1]]
    if len(fingers) < 3 or any(is_endless(one) for one in skeleton.joint.values()):
        return None
    lengths = [len(skeleton.below(name)) for name in fingers]
    short = max(skeleton.reach(name) for name in fingers) < HAND_SIZE / 2
    least = 1 if _names_fingers(skeleton) else 2
    return wrist[-1] if short and min(lengths) >= least and max(lengths) <= MOST_JOINTS else None


def _face_each_other(skeleton: Skeleton, kids: list[str]) -> bool:
    """Return whether two slides close on each other: opposite axes, or one axis and opposite limits."""
    first, second = (skeleton.joint[kid] for kid in kids)
    if first.type != "prismatic" or second.type != "prismatic":
        return False
    along = float(skeleton.axis(kids[0]) @ skeleton.axis(kids[1]))
    one, two = first.position_limits(), second.position_limits()
    if one is None or two is None or abs(along) < 0.95:
        return False
    mirrored = np.allclose((one[0], one[1]), (-two[1], -two[0]), atol=0.2 * (one[1] - one[0]))
    return along < 0 or mirrored


def _on_corners(skeleton: Skeleton, kids: list[str]) -> bool:
    """Return whether limbs begin left and right, front and rear of their middle, as legs do."""
    spots = np.array([skeleton.origin(name)[:2] for name in kids])
    away = spots - spots.mean(axis=0)
    tolerance = 0.15 * float(np.abs(away).max(initial=0.0))
    mirrored = all(
        min(np.linalg.norm(away - spot * flip, axis=1)) <= tolerance
        for spot in away
        for flip in (np.array([1, -1]), np.array([-1, 1]))
    )
    return len(kids) in (4, 6, 8) and mirrored and tolerance > 0
