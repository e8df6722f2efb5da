"""Names that other formats do not allow."""

from __future__ import annotations

from collections.abc import Mapping

from roboyard.audit.findings import INFO
from roboyard.audit.registry import Fault, Faults, check
from roboyard.audit.renames import planned_renames
from roboyard.description.urdf.elements import JointElement, LinkElement
from roboyard.description.urdf.parse import UrdfElements


def _odd(elements: tuple[LinkElement, ...] | tuple[JointElement, ...], renames: Mapping[str, str]) -> Faults:
    for element in elements:
        if element.name in renames:
            new = renames[element.name]
            message = f"the name {element.name!r} is no USD or identifier name; it becomes {new!r}"
            yield Fault(at=element, message=message)


@check(
    "link-name-odd",
    INFO,
    remedy="use the new name downstream; repair writes renames.json",
    fixable=True,
    example='<link name="left (arm) link">',
)
def link_name_odd(urdf: UrdfElements) -> Faults:
    """A link's name holds blanks, parentheses or other characters USD forbids, or starts with a digit."""
    yield from _odd(urdf.links, planned_renames(urdf).links)


@check(
    "joint-name-odd",
    INFO,
    remedy="use the new name downstream; repair writes renames.json",
    fixable=True,
    example='<joint name="joint-1" ...>',
)
def joint_name_odd(urdf: UrdfElements) -> Faults:
    """A joint's name holds blanks, parentheses or other characters USD forbids, or starts with a digit."""
    yield from _odd(urdf.joints, planned_renames(urdf).joints)


@check(
    "link-name-reserved",
    INFO,
    remedy="nothing to do in Roboyard; rename it where stock MuJoCo must read the file",
    example='<link name="world"/>',
)
def link_name_reserved(urdf: UrdfElements) -> Faults:
    """A link is called `world`, which is what MuJoCo calls the ground frame."""
    for link in urdf.links:
        if link.name == "world":
            yield Fault(at=link, message='"world" is MuJoCo\'s name for the ground frame')


@check(
    "name-too-long",
    INFO,
    remedy="shorten it",
    example="(a link name of 300 characters)",
)
def name_too_long(urdf: UrdfElements) -> Faults:
    """A name is over 200 characters long."""
    for element in (*urdf.links, *urdf.joints):
        if len(element.name) > 200:
            short = element.name[:40] + "..."
            kind = "link" if isinstance(element, LinkElement) else "joint"
            yield Fault(
                line=element.line, message=f"{kind} {short!r} has a name of {len(element.name)} characters"
            )
