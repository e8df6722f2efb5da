"""Infer a robot's semantics from its joints, shapes, masses and names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard.description.evidence.model import FileEvidence
from roboyard.description.evidence.read import read_evidence
from roboyard.description.model import RobotDescription, Vector3
from roboyard.description.semantic import (
    Arm,
    BaseKind,
    Leg,
    SemanticDescription,
    WheelPair,
)
from roboyard.morphology.arms import find_arms, find_trunk
from roboyard.morphology.base.drive import WheeledBase, find_wheeled_base
from roboyard.morphology.base.rolling import find_rolling_parts, leg_joints
from roboyard.morphology.base.rotors import find_rotors
from roboyard.morphology.conclusions import make_conclusions, with_stated
from roboyard.morphology.hands.attach import (
    end_effector,
    gripper_conclusions,
    holds_by_suction,
    sensor_conclusions,
    with_known_gripper,
)
from roboyard.morphology.hands.describe import FoundGripper, describe_gripper
from roboyard.morphology.kind import find_kind
from roboyard.morphology.limbs.chains import find_limbs
from roboyard.morphology.limbs.hands import find_palms, hands_alone
from roboyard.morphology.limbs.roles import Part, Roles, best_head, find_roles
from roboyard.morphology.sensors.find import find_sensors
from roboyard.morphology.skeleton import BASE, Skeleton
from roboyard.morphology.upright import seen_from, sideways_wheels, turned
from roboyard.transforms import Array

SURE = 0.5
"""Least confidence in the base of a robot that is drawn on its side."""


def infer_semantics(
    description: RobotDescription, base_link: str | None = None, *, evidence: FileEvidence | None = None
) -> SemanticDescription:
    """Infer kind, base, wheels, limbs and end effectors of a robot about which nothing is stated.

    A mesh that cannot be read counts as no shape.

    Args:
        description: the robot.
        base_link: the link that counts as the base, below virtual joints; the root by default.
        evidence: what its files state beyond links and joints; read from the description's elements and the
            files beside it by default.
    """
    if evidence is None:
        evidence = read_evidence(description)
    skeleton = Skeleton(description, base_link)
    found = _infer(skeleton, evidence)
    if found.kind not in ("object", "other") or skeleton.base_link != description.root.name:
        return found
    for rotation in sideways_wheels(skeleton):
        aside = _infer(Skeleton(turned(description, rotation), base_link), evidence)
        if len(aside.driven_wheels) > 1 and (aside.confidence("base") or 0.0) >= SURE:
            return seen_from(aside, rotation)
    return found


def _is_still(skeleton: Skeleton) -> bool:
    """Return whether no joint moves a part; what is on or off may be a joint without one."""
    return all(
        skeleton.parent[name] == BASE and not len(skeleton.points_below(name)) for name in skeleton.joint
    )


def _infer(skeleton: Skeleton, evidence: FileEvidence) -> SemanticDescription:
    """Return the semantics of a robot with z up, or with limbs that show what is up."""
    description = skeleton.description
    parts = find_rolling_parts(skeleton)
    base = find_wheeled_base(skeleton, parts, evidence)
    rotors = find_rotors(skeleton, base.joints if base is not None else ())
    used = {*(base.joints if base is not None else ()), *(rotors.joints if rotors is not None else ())}
    palms = find_palms(skeleton, used)
    is_hand = bool(hands_alone(skeleton, used))
    anatomy = find_limbs(skeleton, palms, used)
    wheel_legs = [name for part in parts for name in leg_joints(skeleton, part)]
    roles = Roles() if is_hand else find_roles(
        skeleton, anatomy, wheeled=base is not None and not wheel_legs, flying=rotors is not None,
        wheel_legs=wheel_legs, wheels=base.joints if base is not None else (),
    )  # fmt: skip
    if base is not None and base.is_assumed and not roles.arms:
        base = None
    hands: dict[str, FoundGripper] = {}
    links = skeleton.links[BASE]
    if _is_still(skeleton) and holds_by_suction((*links, description.name), evidence):
        hands[links[0]] = describe_gripper(description, links, (), evidence)
    kind = find_kind(skeleton, base, rotors, roles, is_hand=is_hand, holds=bool(hands))
    arms = tuple(_arm(skeleton, part, evidence, hands) for part in roles.arms)
    taken = {n for hand in hands.values() for n in (*hand.gripper.joints, *hand.gripper.mimic_joints)}
    for body, joints in palms.items():
        if not taken & set(joints):
            hand = describe_gripper(description, skeleton.links[body], joints, evidence)
            hands[hand.gripper.palm] = hand
    sensors = find_sensors(description, evidence)
    wheels = base.wheels if base is not None else ()
    is_legged = kind.base == "legged"
    driven = tuple(wheel for wheel in wheels if wheel.is_driven)
    heads = best_head(skeleton, roles)
    semantic = SemanticDescription(
        base_link=skeleton.base_link,
        kind=kind.kind,
        base=kind.base,
        drive=base.drive if base is not None and not is_legged else None,
        forward=base.forward if base is not None else _level(roles),
        up=_vector(roles.up),
        base_joints=() if is_legged else _base_joints(base),
        wheels=wheels,
        wheel_links=tuple(wheel.link for wheel in driven),
        caster_links=tuple(wheel.link for wheel in wheels if wheel.is_caster),
        caster_joints=tuple(dict.fromkeys(
            name for wheel in wheels if wheel.is_caster
            for name in (wheel.caster_joint, wheel.joint) if name is not None
        )) + (base.balls if base is not None else ()),
        steer_joints=tuple(dict.fromkeys(w.steer_joint for w in wheels if w.steer_joint is not None)),
        wheel_pair=base.pair if base is not None and not is_legged else None,
        trunk_joints=roles.trunk,
        head_joints=tuple(name for part in heads for name in part.joints),
        head_link=skeleton.joint[heads[0].limb.tip].child if heads else None,
        legs=tuple(_leg(skeleton, part, base, roles.up) for part in roles.legs),
        end_effectors=tuple(arm.end_effector for arm in arms),
        arms=tuple(sorted(arms, key=lambda arm: arm.name)),
        grippers=tuple(hand.gripper for hand in hands.values()),
        sensors=tuple(item.sensor for item in sensors),
    )  # fmt: skip
    conclusions = make_conclusions(semantic, kind, base, roles)
    parts_found = (*gripper_conclusions(hands), *sensor_conclusions(sensors))
    return replace(semantic, conclusions=(*conclusions, *parts_found))


def complete_semantics(
    description: RobotDescription, stated: SemanticDescription, found: SemanticDescription | None = None
) -> SemanticDescription:
    """Infer the empty fields of a semantic description; disabled pairs and postures stay as stated.

    Args:
        description: the robot, with its virtual joints where `stated` names some.
        stated: the fields that are known, for example from a source configuration.
        found: what was inferred, where that was done already.
    """
    found = infer_semantics(description, stated.base_link) if found is None else found
    if _ends(stated) == _ends(found):
        stated = replace(stated, end_effectors=())
    elif stated.end_effectors:
        ends = tuple(with_known_gripper(end, found.end_effectors) for end in stated.end_effectors)
        stated = replace(stated, end_effectors=ends)
    if stated.trunk_joints == found.trunk_joints:
        stated = replace(stated, trunk_joints=())
    effectors = stated.end_effectors or found.end_effectors
    trunk = stated.trunk_joints or found.trunk_joints
    arms = stated.arms or found.arms
    if stated.end_effectors:
        trunk = stated.trunk_joints or find_trunk(description, stated.base_link, effectors)
        arms = stated.arms or find_arms(description, stated.base_link, effectors, trunk)
    elif stated.trunk_joints and not stated.arms:
        arms = tuple(
            replace(arm, joints=tuple(name for name in arm.joints if name not in trunk)) for arm in arms
        )
    kind, base_joints, pair = _stated_base(description, stated, found)
    return replace(
        found,
        base_link=stated.base_link,
        base=kind,
        base_joints=base_joints,
        virtual_joints=stated.virtual_joints,
        wheel_links=stated.wheel_links or found.wheel_links,
        caster_links=stated.caster_links or found.caster_links,
        wheel_pair=pair,
        end_effectors=effectors,
        trunk_joints=trunk,
        arms=arms,
        disabled_collision_pairs=stated.disabled_collision_pairs,
        postures=stated.postures,
        conclusions=with_stated(found.conclusions, stated, arms, trunk),
    )


def _ends(semantic: SemanticDescription) -> list[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    """Return link, gripper links and gripper joints of the end effectors."""
    return [(end.link, end.gripper_links, end.gripper_joints) for end in semantic.end_effectors]


def _stated_base(
    description: RobotDescription, stated: SemanticDescription, found: SemanticDescription
) -> tuple[BaseKind, tuple[str, ...], WheelPair | None]:
    """Return kind, joints and wheel pair of the base: as stated, by the stated wheels, or as found."""
    if stated.base_joints or stated.virtual_joints:
        kind = stated.base if stated.base != "none" else found.base
        return kind, stated.base_joints, stated.wheel_pair
    kind = stated.base if stated.base != "none" else found.base
    parents = (description.parent_joint.get(link) for link in stated.wheel_links)
    joints = tuple(joint.name for joint in parents if joint is not None and joint.is_moving)
    if not joints or set(joints) == set(found.base_joints):
        return kind, found.base_joints, found.wheel_pair
    return kind if found.base_joints else "wheeled", joints, None


def _base_joints(base: WheeledBase | None) -> tuple[str, ...]:
    if base is None:
        return ()
    if base.pair is not None:
        return base.pair.left, base.pair.right
    return tuple(wheel.joint for wheel in base.wheels if wheel.is_driven)


def _level(roles: Roles) -> Vector3:
    return _vector(np.cross(roles.left, roles.up))


def _vector(array: Array) -> Vector3:
    x, y, z = (float(value) + 0.0 for value in array)
    return (x, y, z)


def _leg(skeleton: Skeleton, part: Part, base: WheeledBase | None, up: Array) -> Leg:
    tip = part.joints[-1]
    wheels = {wheel.joint: wheel for wheel in base.wheels} if base is not None else {}
    wheel = next((name for name in skeleton.children[tip] if name in wheels), None)
    links = skeleton.links[wheel or tip]
    with_shape = [link for link in links if len(skeleton.link_points(link))]
    lowest = {link: round(float((skeleton.link_points(link) @ up).min()), 4) for link in with_shape}
    foot = min(reversed(with_shape), key=lambda link: lowest[link]) if with_shape else links[-1]
    return Leg(name=part.name, joints=part.joints, foot=foot, wheel_joint=wheel)


def _arm(skeleton: Skeleton, part: Part, evidence: FileEvidence, hands: dict[str, FoundGripper]) -> Arm:
    """Return an arm; its gripper is added to `hands`."""
    limb = part.limb
    links = skeleton.links[limb.tip if limb.palm is None else limb.palm]
    effector, hand = end_effector(skeleton.description, links, limb.fingers if limb.palm else (), evidence)
    if hand is not None:
        hands[part.name] = hand
    return Arm(name=part.name, joints=part.joints, end_effector=effector)
