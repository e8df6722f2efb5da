"""Build joints from their elements."""

from __future__ import annotations

import dataclasses
import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import cast

from roboyard.description.axes import unit_axis
from roboyard.description.model import TYPES_WITH_AXIS, Joint, JointType, Limit, Mimic, Vector3
from roboyard.description.urdf.build_context import ORIGIN, children_of, unread_attributes, unread_part
from roboyard.description.urdf.elements import JOINT_TYPES, JointElement
from roboyard.description.urdf.numbers import UNIT_TOLERANCE
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.problems import Problems
from roboyard.description.urdf.write import mimic_element
from roboyard.errors import unknown_name

_READ = ("origin", "parent", "child", "limit", "dynamics", "mimic")
_LIMIT = ("lower", "upper", "effort", "velocity")
_DEFAULT_AXIS: Vector3 = (1.0, 0.0, 0.0)


def build_joint(joint: JointElement, problems: Problems) -> Joint | None:
    """Build a joint; None where its name, type, parent or child is missing, which is reported."""
    element = joint.element
    if not joint.name:
        problems.error(element, "joint", "a <joint> has no name; give it a unique name")
        return None
    kind = _type(joint, problems)
    with_axis = ("axis",) if kind in TYPES_WITH_AXIS else ()  # other types keep it unread
    found, rest = children_of(element, (*_READ, *with_axis))
    for tag, link in (("parent", joint.parent), ("child", joint.child)):
        if not link:
            message = f'it has no {tag} link; add <{tag} link="..."/>'
            problems.error(found.get(tag, element), joint.who, message)
    problems.use(found.get("origin"))
    axis, length = _axis(joint, found["axis"], problems) if "axis" in found else (_DEFAULT_AXIS, 1.0)
    problems.use(joint.limit)
    mimic = _mimic(joint, problems)
    problems.use(found.get("dynamics"))
    if kind is None or not joint.parent or not joint.child:
        return None
    limit = joint.limit
    return Joint(
        name=joint.name,
        type=kind,
        parent=joint.parent,
        child=joint.child,
        origin=joint.pose,
        axis=axis,
        axis_length=length,
        limit=None if limit is None else Limit(**{key: getattr(joint, key) for key in _LIMIT}),
        damping=joint.damping or 0.0,
        friction=joint.friction or 0.0,
        mimic=mimic,
        extra=(
            *rest,
            *unread_part(found.get("origin"), ORIGIN),
            *unread_part(found.get("parent"), ("link",)),
            *unread_part(found.get("child"), ("link",)),
            *unread_part(found.get("axis"), ("xyz",)),
            *unread_part(limit, _LIMIT),
            *unread_part(found.get("dynamics"), ("damping", "friction")),
            *unread_part(joint.mimic, ("joint", "multiplier", "offset")),
        ),
        attributes=unread_attributes(element, "name", "type"),
        source=problems.source(element),
    )


def _type(joint: JointElement, problems: Problems) -> JointType | None:
    written = joint.element.get("type")
    if joint.type in JOINT_TYPES:
        if written != joint.type:
            problems.note(joint.element, joint.who, f"type {written!r} read as {joint.type!r}")
        return cast(JointType, joint.type)
    if written is None:
        problems.error(joint.element, joint.who, f"it has no type; give one of {', '.join(JOINT_TYPES)}")
        return None
    from difflib import get_close_matches

    near = get_close_matches(written.strip().lower(), JOINT_TYPES, n=1)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    message = f"unknown joint type {written!r}{hint} (give one of {', '.join(JOINT_TYPES)})"
    problems.error(joint.element, joint.who, message)
    return None


def _axis(joint: JointElement, element: ET.Element, problems: Problems) -> tuple[Vector3, float]:
    """The axis, scaled to unit length, and its length."""
    problems.use(element)
    axis = joint.axis
    if axis is None:
        return _DEFAULT_AXIS, 1.0
    length = math.hypot(*axis)
    if length < 1e-12:
        shown = ", ".join(f"{value:g}" for value in axis)
        problems.error(element, joint.who, f"<axis> is ({shown}); give a non-zero axis")
        return _DEFAULT_AXIS, 1.0
    if not math.isfinite(length):
        problems.error(element, joint.who, "<axis> is too large; give a unit axis")
        return _DEFAULT_AXIS, 1.0
    if abs(length - 1.0) > UNIT_TOLERANCE:
        problems.note(element, joint.who, f"<axis> has length {length:.6g}; scaled to unit length")
    return unit_axis(axis)


def _mimic(joint: JointElement, problems: Problems) -> Mimic | None:
    if joint.mimic is None:
        return None
    if not joint.mimic_of:
        problems.error(joint.mimic, joint.who, '<mimic> names no joint; add joint="..."')
        return None
    problems.use(joint.mimic)
    return Mimic(joint=joint.mimic_of, multiplier=joint.multiplier, offset=joint.offset)


def drop_unusable_mimics(joints: Sequence[Joint], elements: UrdfElements, problems: Problems) -> list[Joint]:
    """Free the joints that follow no moving joint, or lead back to themselves; `extra` keeps the XML."""
    out: list[Joint] = []
    for joint in joints:
        reason = _mimic_problem(joint, elements)
        if reason is None or joint.mimic is None:
            out.append(joint)
            continue
        problems.note(joint.source.line, f'joint "{joint.name}"', f"mimic: {reason}; it moves freely")
        kept: tuple[ET.Element, ...] = (*joint.extra, mimic_element(joint.mimic))
        out.append(dataclasses.replace(joint, mimic=None, extra=kept))
    return out


def _mimic_problem(joint: Joint, elements: UrdfElements) -> str | None:
    if joint.mimic is None:
        return None
    leader = elements.joint_by_name.get(joint.mimic.joint)
    if leader is None:
        return unknown_name("joint", joint.mimic.joint, [each.name for each in elements.joints])
    if leader.is_fixed:
        return f'joint "{leader.name}", which it follows, is fixed'
    entry = elements.mimic_ring_entries.get(joint.name)
    if entry is None:
        return None
    return "it follows itself" if entry == joint.name else f'it follows "{entry}", which follows itself'
