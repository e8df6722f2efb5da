"""Links, joints, and the tree that they form."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.audit.findings import ERROR, INFO, WARNING
from roboyard.audit.registry import Fault, Faults, check
from roboyard.description.urdf.elements import JOINT_TYPES, JointElement, LinkElement, plain_type
from roboyard.description.urdf.numbers import Location
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.xml import line_of
from roboyard.errors import unknown_name


def _listed(names: Sequence[str], most: int = 6) -> str:
    shown = ", ".join(f'"{name}"' for name in names[:most])
    return shown + (f", ... ({len(names)} in all)" if len(names) > most else "")


@check("no-links", ERROR, remedy="a robot needs at least one <link>", example='<robot name="arm"/>')
def no_links(urdf: UrdfElements) -> Faults:
    """There is no `<link>`."""
    if not urdf.links:
        yield Fault(at=Location(who="robot", line=line_of(urdf.root)), message="there is no <link>")


@check("link-name-missing", ERROR, remedy="give it a unique name", example="<link>...</link>")
def link_name_missing(urdf: UrdfElements) -> Faults:
    """A link has no name."""
    for link in urdf.links:
        if not link.name:
            yield Fault(at=Location(who="link", line=link.line), message="a <link> has no name")


@check("joint-name-missing", ERROR, remedy="give it a unique name", example='<joint type="fixed">...</joint>')
def joint_name_missing(urdf: UrdfElements) -> Faults:
    """A joint has no name."""
    for joint in urdf.joints:
        if not joint.name:
            yield Fault(at=Location(who="joint", line=joint.line), message="a <joint> has no name")


def _duplicates(elements: Sequence[LinkElement] | Sequence[JointElement]) -> Faults:
    first: dict[str, int | None] = {}
    for element in elements:
        if not element.name:
            continue
        if element.name in first:
            yield Fault(at=element, message=f"the name is used twice (first in line {first[element.name]})")
        else:
            first[element.name] = element.line


@check(
    "link-name-duplicate",
    ERROR,
    remedy="rename one of them, and its references in joints",
    example='<link name="arm"/><link name="arm"/>',
)
def link_name_duplicate(urdf: UrdfElements) -> Faults:
    """Two links have one name."""
    yield from _duplicates(urdf.links)


@check(
    "joint-name-duplicate",
    ERROR,
    remedy="rename one of them",
    example='<joint name="j" .../><joint name="j" .../>',
)
def joint_name_duplicate(urdf: UrdfElements) -> Faults:
    """Two joints have one name."""
    yield from _duplicates(urdf.joints)


@check(
    "joint-type-unknown",
    ERROR,
    remedy=f"give one of {', '.join(JOINT_TYPES)}",
    example='<joint name="j" type="hinge">',
)
def joint_type_unknown(urdf: UrdfElements) -> Faults:
    """A joint has no type, or an unknown one."""
    for joint in urdf.joints:
        if not joint.type:
            yield Fault(at=joint, message="it has no type")
        elif joint.type not in JOINT_TYPES:
            yield Fault(at=joint, message=f"unknown joint type {joint.type!r}")


@check(
    "joint-type-spelling",
    INFO,
    remedy="write the type in lower case without blanks",
    fixable=True,
    example='<joint name="j" type="Revolute">',
)
def joint_type_spelling(urdf: UrdfElements) -> Faults:
    """A joint's type differs from a known one in case or blanks alone."""
    for joint in urdf.joints:
        written = joint.element.get("type") or ""
        if plain_type(written) != written:
            yield Fault(at=joint, message=f"type {written!r} is read as {joint.type!r}")


@check(
    "joint-end-missing",
    ERROR,
    remedy='add <parent link="..."/> and <child link="..."/>',
    example='<joint name="j" type="fixed"><parent link="a"/></joint>',
)
def joint_end_missing(urdf: UrdfElements) -> Faults:
    """A joint has no parent or no child link."""
    for joint in urdf.joints:
        for tag, name in (("parent", joint.parent), ("child", joint.child)):
            if not name:
                yield Fault(at=joint, message=f"it has no {tag} link", remedy=f'add <{tag} link="..."/>')


@check(
    "joint-link-unknown",
    ERROR,
    remedy="correct the name or add the link",
    example='<child link="ghost"/>',
)
def joint_link_unknown(urdf: UrdfElements) -> Faults:
    """A joint's parent or child is no link of the robot."""
    for joint in urdf.joints:
        for tag, name in (("parent", joint.parent), ("child", joint.child)):
            if name and name not in urdf.link_by_name:
                yield Fault(at=joint, message=f"{tag}: {unknown_name('link', name, urdf.link_by_name)}")


@check(
    "link-two-parents",
    ERROR,
    remedy="give it one parent; close a loop with a constraint in the simulator",
    example="(two joints with the same child)",
)
def link_two_parents(urdf: UrdfElements) -> Faults:
    """Two joints have one link as their child."""
    first: dict[str, JointElement] = {}
    for joint in urdf.joints:
        if not joint.child:
            continue
        if joint.child in first:
            other = first[joint.child].name
            yield Fault(at=joint, message=f'link "{joint.child}" is already the child of joint "{other}"')
        else:
            first[joint.child] = joint


@check(
    "links-loop",
    ERROR,
    remedy="remove one joint of the loop",
    example="(a is b's parent and b is a's)",
)
def links_loop(urdf: UrdfElements) -> Faults:
    """Links form a loop that no root reaches."""
    for ring in urdf.tree.loops:
        named = " -> ".join(f'"{name}"' for name in ring[:6]) + (" -> ..." if len(ring) > 6 else "")
        first, *_, last = (*ring, *ring)
        closing = next((j for j in urdf.joints if j.child == first and j.parent == last), None)
        yield Fault(
            at=closing, links=ring[:20], message=f"it closes a loop of links ({named}) without a root"
        )


@check(
    "several-roots",
    ERROR,
    remedy="join them with fixed joints, or remove the orphans",
    example="(a link that no joint names)",
)
def several_roots(urdf: UrdfElements) -> Faults:
    """More than one link is no joint's child, so that the robot falls into parts."""
    roots = urdf.tree.roots
    if len(roots) < 2:
        return
    orphans = [name for name in roots if not urdf.tree.children[name]]
    message = f"{len(roots)} root links: {_listed(roots)}"
    if orphans:
        message += f"; orphans, which no joint names: {_listed(orphans)}"
    yield Fault(at=urdf.link_by_name[roots[1]], message=message, links=roots[1:20])


@check(
    "joint-floating",
    WARNING,
    remedy="use the joint type that is meant, or split the robot in two",
    example='(type="floating" between two links of an arm)',
)
def joint_floating(urdf: UrdfElements) -> Faults:
    """A floating joint inside the tree: the links below it fall off, and most importers refuse it."""
    for joint in urdf.joints:
        if joint.type != "floating":
            continue
        parent = urdf.link_by_name.get(joint.parent)
        is_world = (
            parent is not None
            and not urdf.tree.parents[joint.parent]
            and not parent.shapes
            and parent.inertial is None
        )
        if not is_world:
            yield Fault(at=joint, message="a floating joint inside the tree does not connect its links")


@check(
    "joint-type-rare",
    INFO,
    remedy="use several revolute or prismatic joints where another program must read the file",
    example='<joint name="j" type="spherical">',
)
def joint_type_rare(urdf: UrdfElements) -> Faults:
    """A planar or spherical joint, which few other programs read."""
    for joint in urdf.joints:
        if joint.type in ("planar", "spherical"):
            yield Fault(at=joint, message=f"few programs support {joint.type} joints")
