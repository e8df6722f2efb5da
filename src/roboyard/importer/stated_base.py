"""The base, the wheels and the head as a configuration states them, with all that follows from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from roboyard.description.model import RobotDescription
from roboyard.description.semantic import BaseKind, DriveKind, SemanticDescription, Wheel

WHEELED: tuple[BaseKind, ...] = ("wheeled", "differential", "holonomic", "ackermann")
"""Bases that wheels move."""
_DRIVES: dict[BaseKind, tuple[DriveKind, ...]] = {
    "differential": ("plain", "skid"),
    "holonomic": ("omni", "mecanum", "swerve"),
    "ackermann": ("ackermann",),
}


def with_stated_base(semantic: SemanticDescription, base: BaseKind) -> SemanticDescription:
    """Return the semantics with a base; one without wheels drives none, others by those that are driven."""
    if base not in WHEELED:
        wheels = tuple(replace(wheel, is_driven=False) for wheel in semantic.wheels)
        return replace(
            semantic, base=base, drive=None, wheels=wheels, wheel_links=(), wheel_pair=None, base_joints=()
        )
    return _with_drive(replace(semantic, base=base))


def with_stated_swivels(
    semantic: SemanticDescription,
    *,
    steer: Sequence[str] | None = None,
    casters: Sequence[str] | None = None,
) -> SemanticDescription:
    """Return the semantics with steering or caster joints, and wheels that steer or trail accordingly.

    Args:
        semantic: as inferred.
        steer: joints that turn wheels about upright axes by motors; None: those that are not `casters`.
        casters: joints that casters swivel or roll about; None: those that are not in `steer`.
    """
    steer = [n for n in semantic.steer_joints if n not in (casters or ())] if steer is None else steer
    if casters is None:
        rolling = {w.joint for w in semantic.wheels if w.caster_joint in steer}
        casters = [n for n in semantic.caster_joints if n not in steer and n not in rolling]
    wheels = tuple(_wheel(wheel, steer, casters) for wheel in semantic.wheels)
    changed = replace(
        semantic,
        wheels=wheels,
        steer_joints=tuple(steer),
        caster_joints=tuple(casters),
        caster_links=tuple(wheel.link for wheel in wheels if wheel.is_caster),
    )
    return _with_drive(changed) if semantic.base in WHEELED else changed


def with_stated_head(
    semantic: SemanticDescription, joints: Sequence[str], description: RobotDescription
) -> SemanticDescription:
    """Return the semantics with a head's joints; its link is the one that the last of them moves."""
    link = description.joint_by_name[joints[-1]].child if joints else None
    return replace(semantic, head_joints=tuple(joints), head_link=link)


def _wheel(wheel: Wheel, steer: Sequence[str], casters: Sequence[str]) -> Wheel:
    swivel = wheel.steer_joint or wheel.caster_joint
    if wheel.joint in casters or swivel in casters:
        return replace(wheel, is_caster=True, is_driven=False, steer_joint=None, caster_joint=swivel)
    is_driven = wheel.is_driven or wheel.is_caster
    return replace(
        wheel,
        is_caster=False,
        is_driven=is_driven,
        caster_joint=None,
        steer_joint=swivel if swivel in steer else None,
    )


def _with_drive(semantic: SemanticDescription) -> SemanticDescription:
    """Return the semantics with the drive, joints and links that fit its base and its driven wheels."""
    driven = semantic.driven_wheels
    drives = _DRIVES.get(semantic.base, ())
    drive = semantic.drive if semantic.drive in drives else None
    if semantic.base == "differential":
        drive = "plain" if len(driven) == 2 else "skid" if driven else None
    elif semantic.base == "ackermann":
        drive = "ackermann"
    elif drive is None and drives and driven and all(wheel.steer_joint for wheel in driven):
        drive = "swerve"
    pair = semantic.wheel_pair
    joints = tuple(wheel.joint for wheel in driven)
    if pair is not None and (semantic.base != "differential" or set(joints) != {pair.left, pair.right}):
        pair = None
    moved = semantic.base_joints if semantic.virtual_joints else joints
    return replace(
        semantic,
        drive=drive,
        wheel_pair=pair,
        base_joints=(pair.left, pair.right) if pair is not None and moved == joints else moved,
        wheel_links=tuple(wheel.link for wheel in driven),
    )
