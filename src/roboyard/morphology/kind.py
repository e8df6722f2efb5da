"""Kind of a robot as a whole, from its base and its limbs."""

from __future__ import annotations

from dataclasses import dataclass

from roboyard.description.semantic import BaseKind, RobotKind
from roboyard.morphology.base.drive import WheeledBase
from roboyard.morphology.base.rotors import Rotors
from roboyard.morphology.base.virtual import find_virtual_base
from roboyard.morphology.limbs.roles import Roles
from roboyard.morphology.sensors.names import named_kinds
from roboyard.morphology.skeleton import BASE, Skeleton
from roboyard.morphology.words import stands_for_the_world

MOST_FINGERS_OF_A_GRIPPER = 2
"""With more fingers it is a hand."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Kind:
    """Kind and base of a robot, with the evidence."""

    kind: RobotKind
    base: BaseKind
    confidence: float
    evidence: tuple[str, ...]
    base_confidence: float
    base_evidence: tuple[str, ...]


def find_kind(
    skeleton: Skeleton,
    base: WheeledBase | None,
    rotors: Rotors | None,
    roles: Roles,
    *,
    is_hand: bool,
    holds: bool = False,
) -> Kind:
    """Return what the robot is as a whole.

    Args:
        skeleton: the robot.
        base: its wheels.
        rotors: its rotors.
        roles: its limbs.
        is_hand: whether all joints are fingers.
        holds: whether it is a suction gripper, of which no joint moves a part.
    """
    if rotors is not None:
        return _kind("drone", "floating", rotors.confidence, rotors.evidence)
    if is_hand:
        fingers = sum(not skeleton.children[name] for name in skeleton.joint)
        driven = sum(skeleton.is_driven(name) for name in skeleton.joint)
        hand = fingers > MOST_FINGERS_OF_A_GRIPPER and driven > MOST_FINGERS_OF_A_GRIPPER
        text = f"nothing but {fingers} fingers"
        return _kind("hand" if hand else "gripper", "none", 0.85, (text,))
    if holds:
        return _kind(
            "gripper",
            "none",
            0.6,
            ("no joint moves a part of it, and its names say that it holds by suction",),
        )
    arms, legs = len(roles.arms), len(roles.legs)
    if legs:
        return _legged(roles, base)
    if base is not None:
        if base.kind == "ackermann" and not arms:
            return _kind("vehicle", base.kind, base.confidence, base.evidence)
        text = f"wheels carry {arms} arms" if arms else "wheels carry no arm"
        return Kind(
            kind="mobile_manipulator" if arms else "mobile_base",
            base=base.kind,
            confidence=min(base.confidence, 0.95),
            evidence=(text,),
            base_confidence=base.confidence,
            base_evidence=base.evidence,
        )
    return _still(skeleton, roles)


def _legged(roles: Roles, base: WheeledBase | None) -> Kind:
    arms, legs = len(roles.arms), len(roles.legs)
    leg = roles.legs[0]
    kind: RobotKind = "other"
    if legs == 2:
        kind = "humanoid" if arms else "biped"
    elif legs == 4:
        kind = "quadruped"
    text = f"{legs} legs and {arms} arms" if arms else f"{legs} legs"
    if base is not None:
        text += " with wheels"
    return Kind(
        kind=kind,
        base="legged",
        confidence=leg.confidence,
        evidence=(text,),
        base_confidence=leg.confidence,
        base_evidence=leg.evidence,
    )


def _said_to_be_a_robot(skeleton: Skeleton) -> str:
    """Return the sensor or the name by which a body that slides is a robot; empty without."""
    for link in skeleton.links[BASE]:
        if named_kinds(link):
            return f'it carries the sensor "{link}"'
    name = skeleton.description.name
    is_robot = "robot" in name.lower() or name.lower().endswith("bot")
    return f'the robot\'s name "{name}"' if is_robot else ""


def _still(skeleton: Skeleton, roles: Roles) -> Kind:
    """Return the kind of what has neither wheels nor legs nor rotors."""
    arms = len(roles.arms)
    virtual = find_virtual_base(skeleton.description, skeleton.base_link)
    if virtual is not None and arms:
        return _kind("mobile_manipulator", virtual.kind, 0.8, virtual.evidence)
    if virtual is not None and (said := _said_to_be_a_robot(skeleton)):
        return _kind("mobile_base", virtual.kind, 0.5, (*virtual.evidence, said))
    if arms == 1 and _may_be_a_pendulum(roles):
        text = "two joints in a row without a hand: an arm, or a pendulum"
        return _kind("fixed_arm", "fixed", 0.45, (text,))
    if arms:
        kind: RobotKind = "fixed_arm" if arms == 1 else "dual_arm" if arms == 2 else "other"
        return _kind(kind, "fixed", 0.9, (f"{arms} arms, and neither wheels nor legs",) if arms > 1 else
                     ("one arm, and neither wheels nor legs",))  # fmt: skip
    deepest = max((skeleton.depth(name) for name in skeleton.children[BASE]), default=0)
    if deepest == 0:
        return _kind("object", "none", 0.9, ("it has no moving joint",))
    root = skeleton.description.root
    is_world = stands_for_the_world(root)
    if deepest == 1:
        return _kind("object", "none", 0.5 if is_world else 0.6, ("its parts move by one joint each",))
    return _kind("other", "fixed", 0.4, ("its joints make neither an arm, nor legs, nor a wheeled base",))


def _may_be_a_pendulum(roles: Roles) -> bool:
    """Return whether the only arm is two joints without a hand which no name calls an arm."""
    arm = roles.arms[0]
    named = any("names say" in text for text in arm.evidence)
    return len(arm.joints) <= 2 and arm.limb.palm is None and not named


def _kind(kind: RobotKind, base: BaseKind, confidence: float, evidence: tuple[str, ...]) -> Kind:
    return Kind(
        kind=kind,
        base=base,
        confidence=confidence,
        evidence=evidence,
        base_confidence=confidence,
        base_evidence=evidence,
    )
