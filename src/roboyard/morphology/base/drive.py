"""How wheels move a base: which are driven, steered, casters or suspended, and which way is forwards."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from roboyard.description.evidence.model import FileEvidence, Plugin
from roboyard.description.model import Mesh, RobotDescription, Vector3
from roboyard.description.semantic import BaseKind, DriveKind, Wheel, WheelPair
from roboyard.morphology.base.ball_casters import find_ball_casters
from roboyard.morphology.base.fixed_wheels import find_fixed_wheels
from roboyard.morphology.base.rolling import RollingPart, leg_joints
from roboyard.morphology.skeleton import Skeleton, is_endless
from roboyard.morphology.words import meanings
from roboyard.transforms import Array

PARALLEL = 0.97
"""Smallest |cosine| between axles that count as parallel (14 degrees)."""
SMALL = 0.75
"""Wheels below this share of the largest radius are not driven where larger ones are."""
TRAIL = 0.12
"""Smallest trail of a caster behind its swivel axis, as a share of its radius."""
PAIR_TOLERANCE = 0.05
"""Largest difference of the two radii of a pair, and offset of their axles, as a share of the radius."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WheeledBase:
    """Wheels with their roles, and the base they make."""

    kind: BaseKind
    drive: DriveKind | None
    wheels: tuple[Wheel, ...]
    forward: Vector3
    pair: WheelPair | None
    confidence: float
    evidence: tuple[str, ...]
    joints: frozenset[str]
    """All joints of wheels, steering, casters and suspensions; those of legs that carry wheels are not."""
    balls: tuple[str, ...] = ()
    """Joints of casters that are balls."""
    is_assumed: bool = False
    """Whether nothing but wheels without joints shows it."""


def find_wheeled_base(
    skeleton: Skeleton, parts: Sequence[RollingPart], evidence: FileEvidence | None = None
) -> WheeledBase | None:
    """Return the base that wheels make; None without a driven wheel.

    Args:
        skeleton: the robot.
        parts: its wheels.
        evidence: what its files state beyond links and joints.
    """
    actuated = _motors(evidence, {name for part in parts for name in (part.joint, *part.swivels)})
    plugins = evidence.plugins if evidence is not None else ()
    free = [part for part in parts if not leg_joints(skeleton, part)]
    wheels = [_wheel(skeleton, part, free, actuated) for part in parts]
    wheels = _with_drives(wheels, actuated)
    driven = [wheel for wheel in wheels if wheel.is_driven]
    if not driven:
        return _with_fixed_wheels(skeleton, parts, wheels, evidence)
    omni = _omni_evidence(skeleton.description, wheels, plugins)
    if omni:
        wheels = [replace(w, is_omni=w.is_driven or w.is_omni) for w in wheels]
        driven = [wheel for wheel in wheels if wheel.is_driven]
    steering = [skeleton.joint[wheel.steer_joint] for wheel in driven if wheel.steer_joint is not None]
    endless = all(is_endless(joint) for joint in steering)
    straight = any(not wheel.is_caster and wheel.steer_joint is None for wheel in wheels)
    kind, drive, confidence, reasons = _kind(driven, omni, endless_steering=endless, some_straight=straight)
    if drive == "ackermann":
        wheels = [replace(w, is_driven=w.is_driven and (w.steer_joint is None or w.joint in actuated))
                  for w in wheels]  # fmt: skip
        driven = [wheel for wheel in wheels if wheel.is_driven] or driven
    forward = _forward(skeleton, wheels, driven)
    wheels = [replace(wheel, forward_sign=_sign(wheel, forward)) for wheel in wheels]
    on_legs = {name for part in parts for name in leg_joints(skeleton, part)}
    joints = {name for part in parts for name in (part.joint, *part.swivels, *part.others)} - on_legs
    below = {child for part in parts for child in skeleton.below(part.joint)}
    floor = min(part.bottom for part in parts)
    balls = find_ball_casters(skeleton, joints | below, floor, driven[0].radius)
    return WheeledBase(
        kind=kind,
        drive=drive,
        wheels=tuple(wheels),
        forward=forward,
        pair=_pair([wheel for wheel in wheels if wheel.is_driven], forward, kind),
        confidence=confidence,
        evidence=reasons,
        joints=frozenset(joints | below | {*balls}),
        balls=balls,
    )


def _with_fixed_wheels(
    skeleton: Skeleton,
    parts: Sequence[RollingPart],
    wheels: Sequence[Wheel],
    evidence: FileEvidence | None,
) -> WheeledBase | None:
    """Return the base of wheels that are drawn without joints, and of the casters beside them."""
    fixed = find_fixed_wheels(skeleton, evidence)
    if fixed is None:
        return None
    casters = tuple(wheel for wheel in wheels if wheel.is_caster)
    joints = {name for part in parts for name in (part.joint, *part.swivels, *part.others)}
    return WheeledBase(
        kind=fixed.kind,
        drive=fixed.drive,
        wheels=casters,
        forward=(1.0, 0.0, 0.0),
        pair=None,
        confidence=fixed.confidence,
        evidence=fixed.evidence,
        joints=frozenset(joints if casters else ()),
        is_assumed=not fixed.is_stated and not casters,
    )


def _motors(evidence: FileEvidence | None, joints: Collection[str]) -> frozenset[str]:
    """Return the joints of wheels that files name as driven; empty where they name none of them."""
    if evidence is None:
        return frozenset()
    named = {*evidence.actuated}
    for plugin in evidence.plugins:
        if plugin.kind in ("differential", "skid", "ackermann"):
            named |= {text for texts in plugin.words.values() for text in texts}
    return frozenset(named & set(joints))


def _wheel(
    skeleton: Skeleton, part: RollingPart, free: Sequence[RollingPart], actuated: Collection[str]
) -> Wheel:
    swivel = part.swivels[-1] if part.swivels and part in free else None
    plain = [other for other in free if not other.swivels]
    alone = len(free) >= 2 and all(swivel in other.swivels for other in free)
    caster = swivel is not None and _is_caster(skeleton, part, swivel, plain, actuated, alone=alone)
    words = meanings(part.joint) | meanings(part.link)
    x, y, z = (float(v) for v in part.centre)
    ax, ay, az = (float(v) for v in part.axis)
    return Wheel(
        joint=part.joint,
        link=part.link,
        radius=part.radius,
        centre=(x, y, z),
        axis=(ax, ay, az),
        is_driven=not caster and skeleton.is_driven(part.joint) and not ("caster" in words and plain),
        is_caster=caster,
        is_omni=part.has_rollers,
        steer_joint=None if caster else swivel,
        caster_joint=swivel if caster else None,
        suspension_joints=tuple(n for n in (*part.swivels, *part.others) if n != swivel)
        if part in free
        else (),
    )


def _is_caster(
    skeleton: Skeleton,
    part: RollingPart,
    swivel: str,
    plain: Sequence[RollingPart],
    actuated: Collection[str],
    *,
    alone: bool,
) -> bool:
    """Return whether a wheel swivels freely, by trail, limits, names, motors and the other wheels; `alone`:
    all wheels are below this swivel.
    """
    joint = skeleton.joint[swivel]
    offset = part.centre - skeleton.origin(swivel)
    trail = abs(float(offset @ part.roll)) / part.radius
    words = meanings(swivel) | meanings(joint.child) | meanings(part.joint)
    score = 1.0 if trail > TRAIL else -1.0
    score += 0.7 * ("caster" in words) - 0.8 * ("steer" in words)
    score -= 1.5 * (not is_endless(joint))
    score -= 1.2 * (len(plain) == 1 and "caster" not in words)
    score += 0.6 * (len(plain) >= 2) * (1.0 if "caster" in words else 0.3)
    score -= 1.5 * alone
    if actuated:
        score += -2.0 if swivel in actuated else 0.5
    return score > 0


def _with_drives(wheels: list[Wheel], actuated: Collection[str]) -> list[Wheel]:
    """Return the wheels, driven where the file says so, else where they are as large as the largest."""
    named = [wheel for wheel in wheels if wheel.joint in actuated]
    if named and len(named) < len(wheels):
        return [replace(wheel, is_driven=wheel.joint in actuated) for wheel in wheels]
    largest = max((wheel.radius for wheel in wheels if wheel.is_driven), default=0.0)
    return [replace(w, is_driven=w.is_driven and w.radius >= SMALL * largest) for w in wheels]


def _kind(
    driven: Sequence[Wheel], omni: str, *, endless_steering: bool = False, some_straight: bool = False
) -> tuple[BaseKind, DriveKind | None, float, tuple[str, ...]]:
    """Return kind and drive of the base that driven wheels make, with confidence and evidence."""
    steered = [wheel for wheel in driven if wheel.steer_joint is not None]
    level = [np.array([*wheel.axis[:2], 0.0]) for wheel in driven]
    level = [axis / np.linalg.norm(axis) for axis in level]
    parallel = all(abs(float(axis @ level[0])) > PARALLEL for axis in level)
    count = len(driven)
    if (
        steered
        and len({wheel.steer_joint for wheel in steered}) >= 2
        and len(steered) == count
        and count >= 2
        and not some_straight
    ):
        return "holonomic", "swerve", 0.9, (f"all {count} driven wheels are steered about upright axes",)
    if steered and len(steered) == count >= 2 and endless_steering and not some_straight:
        return "holonomic", "swerve", 0.8, (
            f"all {count} driven wheels are on one carriage that steers without limits",
        )  # fmt: skip
    if steered:
        return "ackermann", "ackermann", 0.9, (
            f"{len(steered)} wheels are steered, {count - len(steered)} are not",
        )  # fmt: skip
    if not parallel and count >= 3:
        return (
            "holonomic",
            "omni",
            0.9,
            (f"{count} driven wheels whose axles are not parallel",),
        )
    if omni and count >= 3:
        return "holonomic", "mecanum", 0.85, (f"{count} driven wheels with parallel axles", omni)
    if count >= 2 and parallel:
        spread = np.ptp([float(np.array(wheel.centre) @ level[0]) for wheel in driven])
        if spread > driven[0].radius / 2:
            drive: DriveKind = "plain" if count == 2 else "skid"
            return "differential", drive, 0.95 if count == 2 else 0.8, (
                f"{count} driven wheels on two sides, axles parallel",
            )  # fmt: skip
    return "wheeled", None, 0.5, (f"{count} driven wheels, but no way to turn is seen",)


def _omni_evidence(description: RobotDescription, wheels: Sequence[Wheel], plugins: Sequence[Plugin]) -> str:
    """Return what says that the wheels have rollers, as text; empty where nothing does."""
    driven = [wheel for wheel in wheels if wheel.is_driven]
    if any(wheel.is_omni for wheel in driven):
        return "the wheels have rollers on their rims"
    for wheel in driven:
        for name in (wheel.joint, wheel.link):
            if "mecanum" in meanings(name):
                return f'the name "{name}"'
        link = description.link_by_name[wheel.link]
        for shape in (*link.visuals, *link.collisions):
            if isinstance(shape.geometry, Mesh) and "mecanum" in meanings(shape.geometry.uri):
                return f'the mesh file "{shape.geometry.uri.rpartition("/")[2]}"'
    if "mecanum" in meanings(description.name):
        return f'the robot\'s name "{description.name}"'
    for plugin in plugins:
        if plugin.kind == "holonomic":
            return f'the plugin "{plugin.filename}"'
    joints = {wheel.joint for wheel in driven}
    for element in description.extra:
        texts = [text for item in element.iter() for text in (*item.attrib.values(), item.text or "")]
        if joints & {word for text in texts for word in text.split()}:
            said = next((text for text in texts if "mecanum" in meanings(text)), "")
            if said:
                return f'the element <{element.tag}>, which says "{said}"'
    return ""


def _forward(skeleton: Skeleton, wheels: Sequence[Wheel], driven: Sequence[Wheel]) -> Vector3:
    """Return the level unit vector that is forwards: along the wheels' rolling direction nearest to x, or
    towards steered wheels, the head and cameras where it is not along x.
    """
    fixed = [wheel for wheel in driven if wheel.steer_joint is None] or list(driven)
    rolls = [_roll(wheel) for wheel in fixed]
    if not all(abs(float(roll @ rolls[0])) > PARALLEL for roll in rolls):
        return (1.0, 0.0, 0.0)
    roll = rolls[0]
    steered = [wheel for wheel in wheels if wheel.steer_joint is not None]
    if steered and len(steered) < len(wheels):
        ahead = np.mean([w.centre for w in steered], axis=0) - np.mean([w.centre for w in fixed], axis=0)
        vote = float(ahead @ roll)
    elif abs(roll[0]) > 0.7:
        vote = float(roll[0])
    else:
        vote = _ahead(skeleton, roll, [wheel.joint for wheel in wheels]) or float(roll[1])
    x, y, z = (float(round(v, 6)) + 0.0 for v in roll * np.sign(vote or 1.0))
    return (x, y, z)


def _ahead(skeleton: Skeleton, roll: Array, wheels: Sequence[str]) -> float:
    """Return on which side of the base its limbs and cameras are, along a direction (m)."""
    middle = skeleton.all_points.mean(axis=0) if len(skeleton.all_points) else np.zeros(3)
    spots = [skeleton.frames[n][:3, 3] for n in skeleton.description.link_by_name
             if n in skeleton.frames and "camera" in meanings(n)]  # fmt: skip
    spots += [skeleton.points(name).mean(axis=0) for name in skeleton.joint
              if name not in wheels and len(skeleton.points(name))]  # fmt: skip
    votes = [float((spot - middle) @ roll) for spot in spots]
    return float(np.sum(votes)) if votes else 0.0


def _roll(wheel: Wheel) -> Array:
    direction = np.cross(wheel.axis, [0.0, 0.0, 1.0])
    return direction / np.linalg.norm(direction)


def _sign(wheel: Wheel, forward: Vector3) -> int:
    along = float(_roll(wheel) @ np.array(forward))
    return 0 if abs(along) < 0.3 else 1 if along > 0 else -1


def _pair(driven: Sequence[Wheel], forward: Vector3, kind: BaseKind) -> WheelPair | None:
    """Return the two wheels of a differential drive along x whose joints both turn forwards; else None."""
    if kind != "differential" or len(driven) != 2 or forward[0] < 0.995:
        return None
    right, left = sorted(driven, key=lambda wheel: wheel.centre[1])
    between = np.array(left.centre) - np.array(right.centre)
    tolerance = PAIR_TOLERANCE * left.radius
    if right.forward_sign != 1 or left.forward_sign != 1 or abs(left.radius - right.radius) > tolerance:
        return None
    if np.hypot(between[0], between[2]) > tolerance:
        return None
    return WheelPair(left=left.joint, right=right.joint, radius=left.radius, length=float(between[1]))
