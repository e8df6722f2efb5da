"""Build the joints that close loops of links from `<loop>` elements, an extension of URDF.

<loop name="rod" type="revolute">
<predecessor link="crank"><origin xyz="0 0 0.2"/></predecessor>
<successor link="piston"/>
<axis xyz="0 1 0"/>
</loop>
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection

import numpy as np

from roboyard.description.model import LoopJoint, Vector3
from roboyard.description.urdf.numbers import NumberParser
from roboyard.description.urdf.parse_elements import origin_of
from roboyard.description.urdf.problems import Problems

_TYPES = ("revolute", "spherical", "fixed")


def build_loop(element: ET.Element, links: Collection[str], problems: Problems) -> LoopJoint | None:
    """Build a loop joint; None, with a note, where the element does not say what one is.

    Args:
        element: `<loop>`.
        links: names of the robot's links.
        problems: gets the note.
    """
    name, kind = element.get("name") or "", element.get("type")
    who = f'loop "{name[:60]}"'
    ends = [element.find(tag) for tag in ("predecessor", "successor")]
    named = [end.get("link", "") for end in ends if end is not None]
    unknown = [link for link in named if link not in links]
    numbers = NumberParser()
    numbers.enter(who)
    poses = [origin_of(end, numbers) for end in ends if end is not None]
    axis = numbers.vector(element.find("axis"), "xyz", 3) or (0.0, 0.0, 1.0)
    length = float(np.linalg.norm(axis))
    wrong = next((fault.message for fault in numbers.faults if fault.is_error), None)
    if not name:
        wrong = "it has no name"
    elif kind not in _TYPES:
        wrong = f"type {kind!r} is none of {', '.join(_TYPES)}"
    elif len(named) != 2 or named[0] == named[1]:
        wrong = "it does not name two links, as <predecessor> and <successor>"
    elif unknown:
        wrong = f"there is no link {unknown[0][:60]!r}"
    elif length < 1e-12:
        wrong = "its axis has no length"
    if wrong is not None:
        problems.note(element, who, f"{wrong}; the loop stays open")
        return None
    x, y, z = (value / length for value in axis)
    unit: Vector3 = (x, y, z)
    return LoopJoint(
        name=name,
        type=_TYPES[_TYPES.index(kind or "")],
        first=named[0],
        second=named[1],
        first_origin=poses[0],
        second_origin=poses[1],
        axis=unit,
        source=problems.source(element),
    )
