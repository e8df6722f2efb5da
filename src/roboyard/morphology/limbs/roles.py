"""Roles of limbs: legs, arms and heads; and the trunk between base and arms."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from roboyard.morphology.limbs.chains import Anatomy, Limb
from roboyard.morphology.limbs.directions import find_directions
from roboyard.morphology.limbs.pairs import Pair, find_pairs, similar_group
from roboyard.morphology.skeleton import BASE, Skeleton, is_endless
from roboyard.morphology.words import meanings, share, side, stands_for_the_world
from roboyard.transforms import Array

LEG_NAMES = 3.0
"""Evidence of names from which chains with grippers at their ends are legs: robots that climb."""
CLUSTER = 0.7
"""Two chains are one leg where their beginnings are nearer than this share of the distance to others."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """A limb with its meaning."""

    name: str
    """left, right, front_left, ...; a number where nothing shows a side."""
    limb: Limb
    joints: tuple[str, ...]
    confidence: float
    evidence: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class Roles:
    """Parts of a robot by their meaning."""

    legs: tuple[Part, ...] = ()
    arms: tuple[Part, ...] = ()
    heads: tuple[Part, ...] = ()
    trunk: tuple[str, ...] = ()
    other: tuple[Limb, ...] = ()
    up: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    """(3,) unit vector in the base link's frame."""
    left: Array = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    """(3,) unit vector in the base link's frame."""
    trunk_evidence: tuple[str, ...] = ()


def find_roles(
    skeleton: Skeleton,
    anatomy: Anatomy,
    *,
    wheeled: bool = False,
    flying: bool = False,
    wheel_legs: Sequence[str] = (),
    wheels: Collection[str] = (),
) -> Roles:
    """Return what each limb is.

    Args:
        skeleton: the robot.
        anatomy: its limbs.
        wheeled: whether wheels carry it.
        flying: whether it has rotors.
        wheel_legs: joints above wheels that can lift them as legs do.
        wheels: joints of wheels.
    """
    limbs = [limb for limb in anatomy.limbs if not limb.is_head]
    pairs = find_pairs(skeleton, limbs)
    up, left = find_directions(skeleton, limbs, pairs)
    legs, leg_evidence, leg_confidence = _legs(
        skeleton, limbs, pairs, up, wheeled=wheeled or flying, wheel_legs=wheel_legs
    )
    rest = [limb for limb in limbs if not any(limb in group for group in legs)]
    heads = [limb for limb in anatomy.limbs if limb.is_head]
    arms: list[tuple[Limb, float, tuple[str, ...]]] = []
    other: list[Limb] = []
    for limb in rest:
        score, evidence = _arm_score(skeleton, limb, pairs)
        if score >= 2.0:
            arms.append((limb, min(0.97, 0.4 + 0.12 * score), evidence))
        else:
            other.append(limb)
    if not arms and not legs and not heads and len(other) == 1 and not (wheeled or flying):
        arms = _standing_arm(skeleton, other[0], up)
        other = [] if arms else other
    trunk, arms, why = _trunk(skeleton, anatomy, arms, other, wheeled=wheeled, wheels=wheels)
    return Roles(
        legs=_named_legs(skeleton, legs, left, up, leg_confidence, leg_evidence),
        arms=_named_arms(skeleton, arms, trunk, left),
        heads=tuple(_head(skeleton, limb) for limb in heads),
        trunk=trunk,
        trunk_evidence=why,
        other=tuple(other),
        up=up,
        left=left,
    )


def _names(skeleton: Skeleton, joints: Sequence[str]) -> list[str]:
    return [text for name in joints for text in (name, skeleton.joint[name].child)]


# --------------------------------------------------------------------------------------------------- legs


def _legs(
    skeleton: Skeleton,
    limbs: Sequence[Limb],
    pairs: Sequence[Pair],
    up: Array,
    *,
    wheeled: bool,
    wheel_legs: Sequence[str],
) -> tuple[list[list[Limb]], tuple[str, ...], float]:
    """Return legs, each of one chain or of several that meet, with evidence and confidence."""
    on_wheels = [limb for limb in limbs if set(limb.joints) & set(wheel_legs)]
    if len(on_wheels) >= 2:
        return [[limb] for limb in on_wheels], (f"{len(on_wheels)} chains of joints end in wheels",), 0.9
    if wheeled:
        return [], (), 0.0
    for hub in dict.fromkeys(limb.hub for limb in limbs):
        group = similar_group(skeleton, [limb for limb in limbs if limb.hub == hub and limb.palm is None])
        names = _names(skeleton, [name for limb in group for name in limb.joints])
        if (
            len(group) >= 4
            and share("arm", names) <= share("leg", names)
            and _has_corners(skeleton, group, up)
        ):
            legs = _clustered(skeleton, group)
            if len(legs) >= 3:
                text = (
                    f"{len(group)} chains of {len(group[0].joints)} joints, alike, on all corners of the body"
                )
                return legs, (text,), 0.95
    scored = [(_leg_score(skeleton, pair, pairs, up), pair) for pair in pairs]
    scored = [(score, pair) for score, pair in scored if score[0] > 0]
    if not scored:
        return [], (), 0.0
    (score, evidence), pair = max(scored, key=lambda item: item[0][0])
    return [[pair.first], [pair.second]], evidence, min(0.97, 0.5 + 0.1 * score)


def _has_corners(skeleton: Skeleton, limbs: Sequence[Limb], up: Array) -> bool:
    """Return whether limbs begin on all sides of their middle, seen from above."""
    level = [axis for axis in range(3) if abs(up[axis]) < 0.5]
    spots = np.array([skeleton.origin(limb.joints[0])[level] for limb in limbs])
    away = spots - spots.mean(axis=0)
    quarters = {(bool(x > 0), bool(y > 0)) for x, y in away}
    return len(quarters) >= 4 or len(limbs) >= 6


def _clustered(skeleton: Skeleton, limbs: Sequence[Limb]) -> list[list[Limb]]:
    """Return limbs by leg: two that begin side by side, far from the others, are one parallel leg."""
    spots = [skeleton.origin(limb.joints[0]) for limb in limbs]
    if len(limbs) < 8 or len(limbs) % 2:
        return [[limb] for limb in limbs]
    apart = np.linalg.norm(np.array(spots)[:, None] - np.array(spots)[None], axis=-1)
    np.fill_diagonal(apart, np.inf)
    nearest = apart.argmin(axis=1)
    ordered = np.sort(apart, axis=1)
    mutual = all(nearest[nearest[k]] == k for k in range(len(limbs)))
    if not mutual or not all(ordered[:, 0] < CLUSTER * ordered[:, 1]):
        return [[limb] for limb in limbs]
    return [[limbs[k], limbs[nearest[k]]] for k in range(len(limbs)) if k < nearest[k]]


def _leg_score(
    skeleton: Skeleton, pair: Pair, pairs: Sequence[Pair], up: Array
) -> tuple[float, tuple[str, ...]]:
    """Return the sum of the evidence that two limbs are legs, with its texts."""
    joints = (*pair.first.joints, *pair.second.joints)
    names = _names(skeleton, joints)
    by_name = 4.0 * (share("leg", names) - share("arm", names))
    has_palm = pair.first.palm or pair.second.palm
    if len(pair.first.joints) < 2 or (has_palm and by_name < LEG_NAMES):
        return -9.0, ()
    root = skeleton.description.root
    if stands_for_the_world(root):
        return -9.0, ()
    heights = skeleton.spots @ up
    if not len(heights):
        return -9.0, ()
    tall, floor = float(np.ptp(heights)), float(heights.min())
    tips = np.concatenate([skeleton.points_below(limb.joints[0]) for limb in (pair.first, pair.second)])
    if not len(tips):
        tips = np.array([skeleton.origin(limb.joints[-1]) for limb in (pair.first, pair.second)])
    evidence, score = [], 0.0
    if len(tips) and float((tips @ up).min()) - floor < 0.1 * tall:
        score += 1.5
        evidence.append("two mirrored chains reach the lowest point")
    else:
        score -= 1.5
    base = skeleton.points(BASE) @ up
    if (float(base.min()) if len(base) else 0.0) - floor < 0.1 * tall:  # a base without shape: its origin
        score -= 2.0
    score += by_name
    if by_name > 1:
        evidence.append("their names say leg")
    hip = float(skeleton.origin(pair.first.joints[0]) @ up)
    others = [float(skeleton.origin(p.first.joints[0]) @ up) for p in pairs if p is not pair]
    if any(height > hip + 0.1 * tall for height in others):
        score += 1.5
        evidence.append("another pair of limbs begins above them")
    if any(height < hip - 0.1 * tall for height in others):
        score -= 2.0
    if pair.first.hub != BASE and not by_name:
        score -= 1.0
    score += 0.5 * (len(pair.first.joints) >= 3)
    return score, tuple(evidence)


def _named_legs(
    skeleton: Skeleton,
    legs: Sequence[Sequence[Limb]],
    left: Array,
    up: Array,
    confidence: float,
    evidence: tuple[str, ...],
) -> tuple[Part, ...]:
    ahead = np.cross(left, up)
    spots = [skeleton.origin(group[0].joints[0]) for group in legs]
    names: list[str] = []
    middle = np.mean(spots, axis=0) if spots else np.zeros(3)
    spread = max((abs(float((spot - middle) @ ahead)) for spot in spots), default=0.0)
    for spot in spots:
        across = "left" if float((spot - middle) @ left) > 0 else "right"
        along = float((spot - middle) @ ahead)
        row = "" if len(legs) <= 2 else "front" if along > 0.4 * spread else "rear"
        if len(legs) > 4 and abs(along) <= 0.4 * spread:
            row = "middle"
        names.append(f"{row}_{across}".lstrip("_"))
    parts = []
    for name, group in zip(_unique(names), legs, strict=True):
        joints = tuple(joint for limb in group for joint in limb.joints if skeleton.is_driven(joint))
        parts.append(Part(name=name, limb=group[0], joints=joints, confidence=confidence, evidence=evidence))
    return tuple(parts)


# --------------------------------------------------------------------------------------------------- arms


def _arm_score(skeleton: Skeleton, limb: Limb, pairs: Sequence[Pair]) -> tuple[float, tuple[str, ...]]:
    """Return the sum of the evidence that a limb is an arm, with its texts."""
    joints = [name for name in limb.joints if skeleton.is_driven(name)]
    if not joints or (len(joints) < 2 and limb.palm is None):
        return -1.0, ()
    names = _names(skeleton, limb.joints)
    evidence = [f"a chain of {len(joints)} joints"]
    if len(joints) <= 2 and limb.palm is None and share("pan_tilt", joints) == 1:
        return -1.0, ()
    score = 0.5 * min(len(joints), 5)
    if limb.palm is not None:
        score += 2.0
        evidence.append("it ends in a gripper or hand")
    if any(limb in (pair.first, pair.second) for pair in pairs):
        score += 0.7
        evidence.append("another chain mirrors it")
    by_name = 2.0 * share("arm", names) - 2.0 * share("leg", names) - 2.0 * share("head", names)
    score += by_name
    if by_name > 0.5:
        evidence.append("names say arm")
    if len(joints) < 3 and limb.palm is None:
        loose = [name for name in joints if is_endless(skeleton.joint[name])]
        spherical = any(skeleton.joint[name].type == "spherical" for name in joints)
        if loose and not spherical:
            return -1.0, ()
        score += 1.0 * (skeleton.reach(limb.joints[0]) > 0.4 * skeleton.size)
    if all(skeleton.joint[name].type == "prismatic" for name in joints) and limb.palm is None:
        score -= 2.0
    reach = skeleton.reach(limb.joints[0])
    if reach < 0.12 * skeleton.size:
        score -= 2.0
    return score, tuple(evidence)


def _standing_arm(skeleton: Skeleton, limb: Limb, up: Array) -> list[tuple[Limb, float, tuple[str, ...]]]:
    """Return the only limb of a robot as an arm where its base stands under an upright first axis."""
    joints = [name for name in limb.joints if skeleton.is_driven(name)]
    base = skeleton.points(BASE) @ up
    turns = all(skeleton.joint[name].type == "revolute" for name in joints)
    on_root = skeleton.base_link == skeleton.description.root.name
    if (
        len(joints) < 3
        or not (turns and on_root and len(base))
        or abs(float(skeleton.axis(joints[0]) @ up)) < 0.95
    ):
        return []
    heights = skeleton.spots @ up
    if float(base.min()) > float(heights.min()) + 0.02 * float(np.ptp(heights)):
        return []
    text = f"a chain of {len(joints)} joints on a base on the floor, the first about an upright axis"
    return [(limb, 0.6, (text,))]


def _named_arms(
    skeleton: Skeleton,
    arms: Sequence[tuple[Limb, float, tuple[str, ...]]],
    trunk: Sequence[str],
    left: Array,
) -> tuple[Part, ...]:
    names = [_arm_name(skeleton, limb, [a[0] for a in arms], left) for limb, _, _ in arms]
    parts = []
    for name, (limb, confidence, evidence) in zip(_unique(names), arms, strict=True):
        joints = tuple(j for j in limb.joints if skeleton.is_driven(j) and j not in trunk)
        parts.append(Part(name=name, limb=limb, joints=joints, confidence=confidence, evidence=evidence))
    return tuple(parts)


def _arm_name(skeleton: Skeleton, limb: Limb, arms: Sequence[Limb], left: Array) -> str:
    if len(arms) == 1:
        return "0"
    named = side(_names(skeleton, limb.joints))
    if named is not None:
        return named
    spots = [_middle(skeleton, other) @ left for other in arms]
    own = float(_middle(skeleton, limb) @ left)
    spread = float(np.ptp(spots))
    if spread > 0 and len(arms) == 2:
        return "left" if own > float(np.mean(spots)) else "right"
    return str(list(arms).index(limb))


def _middle(skeleton: Skeleton, limb: Limb) -> Array:
    return np.mean([skeleton.origin(name) for name in limb.joints], axis=0)


def _unique(names: Sequence[str]) -> list[str]:
    found: list[str] = []
    for name in names:
        number, new = 2, name
        while new in found:
            new, number = f"{name}_{number}", number + 1
        found.append(new)
    return found


# ------------------------------------------------------------------------------------------- head and trunk


def _head(skeleton: Skeleton, limb: Limb) -> Part:
    joints = tuple(n for n in limb.joints if skeleton.is_driven(n) and "lidar" not in meanings(n))
    names = _names(skeleton, limb.joints)
    evidence = ["a short chain that carries neither hand nor foot"]
    if share("head", names) > 0:
        evidence.append("names say head")
    links = [link for name in limb.joints for link in skeleton.links[name]]
    if any("camera" in meanings(link) for link in links):
        evidence.append("it carries a camera")
    return Part(
        name="head", limb=limb, joints=joints, confidence=0.6 + 0.1 * len(evidence), evidence=tuple(evidence)
    )


def best_head(skeleton: Skeleton, roles: Roles) -> tuple[Part, ...]:
    """Return the head that a robot is said to have, or none: of those with as much evidence the one that
    carries most links. A gear or a lidar beside the neck turns alone.
    """
    if not roles.heads:
        return ()

    def carried(part: Part) -> int:
        below = skeleton.below(part.limb.joints[0])
        return sum(len(skeleton.links[name]) for name in below)

    return (max(roles.heads, key=lambda part: (part.confidence, carried(part))),)


def _begins_an_arm(skeleton: Skeleton, joints: Sequence[str], limb: Limb) -> bool:
    """Return whether the joints below the only arm of a robot that stands still are that arm's first ones."""
    leads = skeleton.path(limb.joints[0])[: len(joints)] == list(joints)
    turn = all(skeleton.joint[name].type != "prismatic" for name in joints)
    return leads and turn and share("trunk", _names(skeleton, joints)) == 0


def _trunk(
    skeleton: Skeleton,
    anatomy: Anatomy,
    arms: list[tuple[Limb, float, tuple[str, ...]]],
    other: Sequence[Limb],
    *,
    wheeled: bool,
    wheels: Collection[str] = (),
) -> tuple[tuple[str, ...], list[tuple[Limb, float, tuple[str, ...]]], tuple[str, ...]]:
    """Return the joints between the hubs of a robot, or the lift that carries its only arm."""
    hubs = {limb.hub for limb, _, _ in arms} | {limb.hub for limb in anatomy.limbs}
    joints = dict.fromkeys(name for hub in hubs for name in skeleton.path(hub) if skeleton.is_driven(name))
    for limb in other:
        stands = set(skeleton.children[limb.tip]) & set(wheels)
        if stands or share("trunk", _names(skeleton, limb.joints)) >= 0.5:
            joints |= dict.fromkeys(limb.joints)
    for name in anatomy.accessories:
        hub = skeleton.parent[name]
        heavy = skeleton.moved_mass(name) > 0.05 * skeleton.mass(hub)
        if hub in anatomy.hubs and heavy and share("trunk", _names(skeleton, [name])) >= 0.5:
            joints[name] = None
    ordered = [name for name in skeleton.joint if name in joints]
    if ordered and not wheeled and len(arms) == 1 and _begins_an_arm(skeleton, ordered, arms[0][0]):
        limb, confidence, evidence = arms[0]
        arms = [(replace(limb, joints=(*ordered, *limb.joints)), confidence, evidence)]
        return (), arms, ()
    if ordered:
        return tuple(ordered), arms, (f"{len(ordered)} joints move all that branches off behind them",)
    if len(arms) == 1:
        limb = arms[0][0]
        driven = [name for name in limb.joints if skeleton.is_driven(name)]
        first = skeleton.joint[driven[0]]
        lifts = first.type == "prismatic" and abs(skeleton.axis(driven[0])[2]) > 0.95
        enough = len(driven) >= 5 or (len(driven) >= 3 and limb.palm is not None)
        if lifts and enough and (wheeled or "trunk" in meanings(first.name) | meanings(first.child)):
            return (driven[0],), arms, (f'"{driven[0]}" is an upright slide that carries the whole arm',)
    return (), arms, ()
