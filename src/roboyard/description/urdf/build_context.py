"""What the readers of links and joints share."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast

from roboyard.description.files.resolver import Resolver
from roboyard.description.model import Attributes, Pose, Quaternion, Vector3
from roboyard.description.urdf.numbers import read_vector
from roboyard.description.urdf.problems import Problems
from roboyard.transforms import quaternion_from_rpy

UNIT_TOLERANCE = 1e-3
"""How far the length of an axis or a quaternion may be from 1 before anything is said."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Context:
    """What a reader needs besides the element."""

    problems: Problems
    resolver: Resolver
    missing_meshes: Literal["error", "note"]


def unread_attributes(element: ET.Element, *known: str) -> Attributes:
    """The attributes that Roboyard does not read."""
    return tuple((key, value) for key, value in element.attrib.items() if key not in known)


def unread_part(
    element: ET.Element | None, known: Sequence[str], children: Sequence[str] = ()
) -> tuple[ET.Element, ...]:
    """The unread attributes and children of an element, as an element of the same tag; () for none."""
    if element is None:
        return ()
    attributes = dict(unread_attributes(element, *known))
    rest = [child for child in element if child.tag not in children]
    if not attributes and not rest:
        return ()
    part = ET.Element(element.tag, attributes)
    part.extend(rest)
    return (part,)


def children_of(element: ET.Element, known: Sequence[str]) -> tuple[dict[str, ET.Element], list[ET.Element]]:
    """The first child of each known tag, and all other children in file order."""
    first: dict[str, ET.Element] = {}
    rest: list[ET.Element] = []
    for child in element:
        if child.tag in known and child.tag not in first:
            first[child.tag] = child
        elif isinstance(child.tag, str):
            rest.append(child)
    return first, rest


def read_pose(element: ET.Element | None, who: str, problems: Problems) -> Pose:
    """An `<origin>`; the identity where there is none."""
    if element is None:
        return Pose()
    xyz = read_vector(element, "xyz", 3, who, problems)
    position = cast(Vector3, xyz) if xyz is not None else (0.0, 0.0, 0.0)
    quaternion = read_vector(element, "quat_xyzw", 4, who, problems)
    if quaternion is not None:
        unit = unit_quaternion(quaternion)
        if unit is None:
            problems.error(
                element, who, '<origin quat_xyzw="0 0 0 0"> is no rotation; give a unit quaternion'
            )
            return Pose(position=position)
        length = math.hypot(*quaternion)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            problems.note(element, who, f"<origin quat_xyzw> has length {length:.6g}; scaled to unit length")
        return Pose(position=position, quaternion=unit)
    rpy = cast(Vector3 | None, read_vector(element, "rpy", 3, who, problems))
    if rpy is None:
        return Pose(position=position)
    turned = cast(Quaternion, tuple(quaternion_from_rpy(rpy).tolist()))
    return Pose(position=position, quaternion=turned, rpy=rpy)


def unit_quaternion(quaternion: Sequence[float]) -> Quaternion | None:
    """Scaled to length 1, however large its numbers are; None for one of no length (under 1e-12)."""
    largest = max(map(abs, quaternion))
    if largest < 1e-12:
        return None
    scaled = [number / largest for number in quaternion]
    length = math.hypot(*scaled)
    return cast(Quaternion, tuple(number / length for number in scaled))
