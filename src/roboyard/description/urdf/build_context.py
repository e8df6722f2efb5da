"""Shared parts of the builders of links and joints: the context, and the XML that Roboyard does not read."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import Literal

from roboyard._records import dataclass
from roboyard.description.model import Attributes
from roboyard.description.urdf.elements import MaterialElement
from roboyard.description.urdf.problems import Problems

MissingMeshes = Literal["error", "note"]
ORIGIN = ("xyz", "rpy", "quat_xyzw")
"""Attributes of `<origin>` that are read."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BuildContext:
    """Parameters of building one description."""

    problems: Problems
    materials: Mapping[ET.Element, MaterialElement]
    """By their XML element."""
    missing_meshes: MissingMeshes
    as_bullet: bool = False
    """Whether a mesh of scale 0 is flat, and `concave` counts with any text, as for Bullet."""


def unread_attributes(element: ET.Element, *known: str) -> Attributes:
    """Return the attributes that Roboyard does not read."""
    return tuple((key, value) for key, value in element.attrib.items() if key not in known)


def unread_part(
    element: ET.Element | None, known: Sequence[str], children: Sequence[str] = ()
) -> tuple[ET.Element, ...]:
    """Return the unread attributes and children of an element, as an element of the same tag; () for none."""
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
    """Return the first child of each known tag, and all other children in file order."""
    first: dict[str, ET.Element] = {}
    rest: list[ET.Element] = []
    for child in element:
        if child.tag in known and child.tag not in first:
            first[child.tag] = child
        elif isinstance(child.tag, str):
            rest.append(child)
    return first, rest
