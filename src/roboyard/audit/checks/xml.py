"""Elements, attributes and numbers, independent of their meaning."""

from __future__ import annotations

import difflib
import xml.etree.ElementTree as ET
from collections.abc import Iterator

from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.model import CONTACT_TAGS, INERTIA_KEYS
from roboyard.description.urdf.numbers import BEYOND, LARGEST, FaultKind, Location
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import is_xacro, line_of, xacro_colours

_POSE = ("xyz", "rpy", "quat_xyzw")
ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "robot": ("name", "version"),
    "link": ("name",),
    "joint": ("name", "type"),
    "inertial": (),
    "visual": ("name",),
    "collision": ("name", "concave"),
    "geometry": (),
    "origin": _POSE,
    "mass": ("value",),
    "inertia": INERTIA_KEYS,
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "plane": ("normal",),
    "mesh": ("filename", "scale"),
    "material": ("name",),
    "color": ("rgba",),
    "texture": ("filename",),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
    "dynamics": ("damping", "friction"),
    "mimic": ("joint", "multiplier", "offset"),
    "loop": ("name", "type"),
    "predecessor": ("link",),
    "successor": ("link",),
    **dict.fromkeys(CONTACT_TAGS, ("value",)),
}
"""Attributes that Roboyard reads, by element."""

NUMBERS: dict[tuple[str, str], int] = {
    **{("origin", key): 4 if key == "quat_xyzw" else 3 for key in _POSE},
    **{("inertia", key): 1 for key in INERTIA_KEYS},
    ("mass", "value"): 1,
    ("box", "size"): 3,
    **{(tag, key): 1 for tag in ("sphere", "cylinder", "capsule") for key in ("radius", "length")},
    ("plane", "normal"): 3,
    ("mesh", "scale"): 3,
    ("color", "rgba"): 4,
    ("axis", "xyz"): 3,
    **{("limit", key): 1 for key in ("lower", "upper", "effort", "velocity")},
    **{("dynamics", key): 1 for key in ("damping", "friction")},
    **{("mimic", key): 1 for key in ("multiplier", "offset")},
    **{(tag, "value"): 1 for tag in CONTACT_TAGS},
}
"""How many numbers an attribute holds, by element and attribute."""

CHILDREN: dict[str, tuple[str, ...]] = {
    "robot": ("link", "joint", "loop", "material"),
    "link": ("inertial", "visual", "collision", "contact"),
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "contact": CONTACT_TAGS,
    "geometry": ("box", "sphere", "cylinder", "capsule", "plane", "mesh"),
    "material": ("color", "texture"),
    "loop": ("predecessor", "successor", "axis"),
    "predecessor": ("origin",),
    "successor": ("origin",),
}
"""Children that Roboyard reads, by element."""

_SINGLE = {tag for tags in CHILDREN.values() for tag in tags}
_SINGLE -= {"link", "joint", "loop", "visual", "collision", *CHILDREN["geometry"]}


def read_elements(urdf: UrdfElements) -> Iterator[tuple[ET.Element, Location]]:
    """Every element that Roboyard reads, with the link, joint or robot it belongs to."""
    robot = Location(who="robot", line=line_of(urdf.root))
    stack: list[tuple[ET.Element, Location]] = [(urdf.root, robot)]
    while stack:
        element, owner = stack.pop()
        yield element, owner
        known = CHILDREN.get(element.tag, ())
        for child in reversed(element):
            if child.tag in known:
                at = owner
                if element is urdf.root:
                    name = child.get("name") or ""
                    links = (name,) if child.tag == "link" else ()
                    at = Location(who=f'{child.tag} "{name}"', line=line_of(child), link_names=links)
                stack.append((child, at))


def _number_faults(urdf: UrdfElements, kind: FaultKind) -> Faults:
    """The numbers with one kind of fault."""
    for fault in urdf.number_faults:
        if fault.kind == kind:
            yield Fault(at=fault.at, message=fault.message)


@check(
    "number-not-finite",
    ERROR,
    remedy="give a finite number",
    example='<origin xyz="0 nan 0"/>',
)
def number_not_finite(urdf: UrdfElements) -> Faults:
    """A number is NaN or infinite, or too large for one."""
    yield from _number_faults(urdf, "not finite")


@check(
    "xacro-left",
    ERROR,
    remedy="expand it first: xacro FILE.xacro > FILE.urdf",
    example='<origin xyz="0 0 ${height}"/>',
)
def xacro_left(urdf: UrdfElements) -> Faults:
    """The file is an unexpanded xacro, or part of it is."""
    yield from _number_faults(urdf, "xacro")
    colours = {id(element) for element in xacro_colours(urdf.root)}
    for element in urdf.root.iter():
        if is_xacro(element) and id(element) not in colours:
            message = f"<{str(element.tag)[:60]}> is xacro"
            yield Fault(at=Location(who="robot", line=line_of(element)), message=message)
            return


@check(
    "xacro-color",
    WARNING,
    remedy="expand it first: xacro FILE.xacro > FILE.urdf",
    example="<visual><geometry>...</geometry><xacro:grey/></visual>",
)
def xacro_colour(urdf: UrdfElements) -> Faults:
    """The colour of a visual shape is an unexpanded macro."""
    if colours := xacro_colours(urdf.root):
        tag = str(colours[0].tag)[:60]
        message = f"<{tag}> is xacro; {len(colours)} visual shapes have no colour"
        yield Fault(at=Location(who="robot", line=line_of(colours[0])), message=message)


@check(
    "number-wrong",
    ERROR,
    remedy="give as many numbers as the attribute takes",
    example='<origin xyz="0 0.1"/>',
)
def number_wrong(urdf: UrdfElements) -> Faults:
    """A number cannot be read as one, or some of a vector's are missing."""
    for fault in urdf.number_faults:
        if fault.kind == "wrong":
            yield Fault(at=fault.at, message=fault.message, remedy=fault.remedy)


@check(
    "number-huge",
    ERROR,
    remedy="give it in metres, kilograms, seconds and radians",
    example='<origin xyz="0 0 1e30"/>',
)
def number_huge(urdf: UrdfElements) -> Faults:
    """A number is beyond any robot: over 1e9, other than as a joint's limit."""
    yield from _number_faults(urdf, "huge")
    for link in urdf.links:
        if link.inertial is not None:
            largest = max((link.inertial.mass or 0.0, *(link.inertial.tensor or ())), key=abs)
            if abs(largest) > LARGEST:
                message = f"<inertial> holds {largest:g}, {BEYOND}"
                yield Fault(at=link, line=line_of(link.inertial.element), message=message)


@check(
    "number-sloppy",
    INFO,
    remedy="write plain numbers with blanks between them",
    fixable=True,
    example='<origin xyz="0.1, 0, 0.2"/>',
)
def number_sloppy(urdf: UrdfElements) -> Faults:
    """Only lenient readers take a number as written: commas, a stray dot, one too many, a long quaternion."""
    yield from _number_faults(urdf, "sloppy")


@check(
    "robot-name-missing",
    INFO,
    remedy='add name="..." to <robot>',
    fixable=True,
    example="<robot>",
)
def robot_name_missing(urdf: UrdfElements) -> Faults:
    """`<robot>` has no name."""
    if not urdf.name:
        yield Fault(at=Location(who="robot", line=line_of(urdf.root)), message="<robot> has no name")


@check(
    "element-repeated",
    WARNING,
    remedy="keep one of them",
    example='<joint ...><origin xyz="0 0 1"/><origin xyz="0 0 2"/>',
)
def element_repeated(urdf: UrdfElements) -> Faults:
    """An element that may occur once is repeated; only the first one is read."""
    for element, owner in read_elements(urdf):
        if element.tag == "geometry":
            shapes = [child.tag for child in element if child.tag in CHILDREN["geometry"]]
            if len(shapes) > 1:
                yield Fault(
                    at=owner,
                    line=line_of(element),
                    message=f"<geometry> holds {len(shapes)} shapes; only the first, <{shapes[0]}>, is read",
                )
        if element is urdf.root:
            continue
        single = _SINGLE.intersection(CHILDREN.get(element.tag, ()))
        for tag in dict.fromkeys(child.tag for child in element if child.tag in single):
            same = [child for child in element if child.tag == tag]
            if len(same) > 1:
                count = "a second" if len(same) == 2 else f"{len(same)}"
                message = f"<{element.tag}> holds {count} <{tag}>; only the first is read"
                severity = INFO if tag == "material" else None  # colours move nothing
                yield Fault(at=owner, line=line_of(same[1]), message=message, severity=severity)


@check(
    "element-unread",
    INFO,
    remedy="nothing to do where another program reads it",
    example="<transmission>...</transmission>",
)
def element_unread(urdf: UrdfElements) -> Faults:
    """An element that Roboyard does not read; it is kept and written back as it was."""
    counts: dict[tuple[str, str], list[Location]] = {}
    for element, owner in read_elements(urdf):
        if element.tag not in CHILDREN:
            continue
        for child in element:
            if isinstance(child.tag, str) and child.tag not in CHILDREN[element.tag]:
                place = Location(who=owner.who, line=line_of(child), link_names=owner.link_names)
                counts.setdefault((element.tag, child.tag), []).append(place)
    for (parent, tag), places in counts.items():
        many = f" ({len(places)} of them)" if len(places) > 1 else ""
        message = f"<{tag[:60]}> in <{parent}> is kept but not used{many}"
        yield Fault(at=places[0], message=message)


@check(
    "attribute-unread",
    INFO,
    remedy="check the spelling; nothing to do where another program reads it",
    example='<limit lowr="-1" upper="1"/>',
)
def attribute_unread(urdf: UrdfElements) -> Faults:
    """An attribute that Roboyard does not read, misspelt perhaps; it is kept."""
    idle = {  # parameters of motion of a fixed joint
        id(part) for joint in urdf.joints if joint.type == "fixed" for part in joint.element
    }
    counts: dict[tuple[str, str, str | None], list[Location]] = {}
    for element, owner in read_elements(urdf):
        for key in element.attrib:
            known = ATTRIBUTES.get(element.tag)
            if known is not None and key not in known and not key.startswith("xmlns") and ":" not in key:
                place = Location(who=owner.who, line=line_of(element), link_names=owner.link_names)
                meant = None if id(element) in idle else misspelt(element, key)
                counts.setdefault((element.tag, key, meant), []).append(place)
    for (tag, key, meant), places in counts.items():
        many = f" ({len(places)} of them)" if len(places) > 1 else ""
        message = f"<{tag} {key[:60]}> is kept but not used{many}"
        if meant is None:
            yield Fault(at=places[0], message=message)
        else:
            remedy = f"write {meant}, if that is what it means"
            message += f"; {meant} is missing"
            yield Fault(at=places[0], message=message, remedy=remedy, severity=WARNING)


def misspelt(element: ET.Element, key: str) -> str | None:
    """The attribute that an element lacks and that `key` looks like, or None."""
    absent = [name for name in ATTRIBUTES.get(element.tag, ()) if name not in element.attrib]
    return next(iter(difflib.get_close_matches(key.lower(), absent, n=1)), None)
