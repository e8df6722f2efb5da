"""Read an SRDF, and find the one that belongs to a robot file."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from roboyard.description.evidence.model import Srdf, SrdfEndEffector, SrdfGroup
from roboyard.description.files.resolver import Resolver
from roboyard.description.model import RobotDescription
from roboyard.description.urdf.xml import read_xml
from roboyard.errors import DescriptionError

MOST_BYTES = 8 * 1024 * 1024
MOST_FILES = 32
MOST_PAIRS = 20_000
MIN_KNOWN = 0.8
"""Smallest share of the joints and links that an SRDF names which the robot must have."""


def load_srdf(path: Path | str, description: RobotDescription) -> Srdf:
    """Load an SRDF; the joints of its chains are those of the robot. Unknown names are dropped.

    Raises:
        DescriptionError: the file cannot be read, or is no SRDF.
    """
    file = Path(path)
    root, _ = read_xml(file)
    if root.tag != "robot":
        raise DescriptionError(f"the root element is <{root.tag}>, not <robot>; give an SRDF", file=file)
    return _srdf(root, description, file)


def find_srdf(
    description: RobotDescription,
    file: Path | None = None,
    *,
    packages: Mapping[str, Path] | None = None,
    search_paths: Sequence[Path] = (),
) -> Srdf | None:
    """Return the SRDF that stands with a robot file: in its folder, in `srdf/` or `config/` of its package,
    or in a MoveIt configuration beside its package. None without one that names this robot's parts.

    An SRDF belongs to the robot if the robot has at least four fifths of the joints and links it names. Of
    several, the one that names most of them is taken; then one that is called like the file or the robot.

    Args:
        description: the robot.
        file: its file, as it was loaded from; the description's own by default.
        packages: as for `load_description`.
        search_paths: as for `load_description`.
    """
    file = description.source.file if file is None else file
    if file is None:
        return None
    resolver = Resolver.of_file(file, packages=packages, search_paths=search_paths)
    best: tuple[tuple[int, bool, bool, int], Srdf] | None = None
    for place, candidate in enumerate(resolver.files_beside("*.srdf")[:MOST_FILES]):
        try:
            if candidate.stat().st_size > MOST_BYTES:
                continue
            root, _ = read_xml(candidate)
        except (DescriptionError, OSError):  # a broken neighbour file is no evidence
            continue
        named = _named(root)
        known = named & (description.joint_by_name.keys() | description.link_by_name.keys())
        if root.tag != "robot" or not known or len(known) < MIN_KNOWN * len(named):
            continue
        alike = candidate.stem == file.stem, root.get("name") == description.name
        rank = (len(known), *alike, -place)
        if best is None or rank > best[0]:
            best = rank, _srdf(root, description, candidate)
    return None if best is None else best[1]


def _named(root: ET.Element) -> set[str]:
    """Return the joints and links that groups, end effectors and passive joints name."""
    names: set[str] = set()
    for group in root.findall("group"):
        for part in group:
            if part.tag in ("joint", "link"):
                names.add(part.get("name") or "")
            elif part.tag == "chain":
                names |= {part.get("base_link") or "", part.get("tip_link") or ""}
    names |= {element.get("parent_link") or "" for element in root.findall("end_effector")}
    names |= {element.get("name") or "" for element in root.findall("passive_joint")}
    return names - {""}


def _srdf(root: ET.Element, description: RobotDescription, file: Path | None) -> Srdf:
    elements = {element.get("name") or "": element for element in root.findall("group")}
    groups = tuple(_group(name, elements, description, ()) for name in elements if name)
    joints, links = description.joint_by_name, description.link_by_name
    states: dict[str, dict[str, float]] = {}
    for element in root.findall("group_state"):
        values = states.setdefault(element.get("name") or "", {})
        for part in element.findall("joint"):
            name, value = part.get("name") or "", _number(part.get("value"))
            if name in joints and value is not None:
                values[name] = value
    pairs: dict[tuple[str, str], None] = {}
    for element in root.findall("disable_collisions")[:MOST_PAIRS]:
        first, second = sorted((element.get("link1") or "", element.get("link2") or ""))
        if first in links and second in links and first != second:
            pairs[first, second] = None
    passive = [element.get("name") or "" for element in root.findall("passive_joint")]
    virtual = root.find("virtual_joint")
    return Srdf(
        file=file,
        robot=root.get("name") or "",
        groups=groups,
        end_effectors=tuple(
            SrdfEndEffector(
                name=element.get("name") or "",
                parent_link=element.get("parent_link") or "",
                group=element.get("group") or "",
                parent_group=element.get("parent_group") or "",
            )
            for element in root.findall("end_effector")
        ),
        passive_joints=tuple(name for name in dict.fromkeys(passive) if name in joints),
        states={name: values for name, values in states.items() if name and values},
        disabled_pairs=tuple(pairs),
        virtual_joint_type=None if virtual is None else virtual.get("type"),
    )


def _group(
    name: str, elements: Mapping[str, ET.Element], description: RobotDescription, outer: Collection[str]
) -> SrdfGroup:
    """Return a group with its inner groups resolved; `outer` are the groups it is inside of."""
    joints: dict[str, None] = {}
    links: dict[str, None] = {}
    tips: dict[str, None] = {}
    for part in elements[name]:
        text = part.get("name") or ""
        if part.tag == "joint" and text in description.joint_by_name:
            joints[text] = None
        elif part.tag == "link" and text in description.link_by_name:
            links[text] = None
        elif part.tag == "chain":
            tip = part.get("tip_link") or ""
            found = _chain(description, part.get("base_link") or "", tip)
            joints |= dict.fromkeys(found)
            tips |= {tip: None} if found else {}
        elif part.tag == "group" and text in elements and text != name and text not in outer:
            inner = _group(text, elements, description, (*outer, name))
            joints |= dict.fromkeys(inner.joints)
            links |= dict.fromkeys(inner.links)
            tips |= dict.fromkeys(inner.tips)
    return SrdfGroup(name=name, joints=tuple(joints), links=tuple(links), tips=tuple(tips))


def _chain(description: RobotDescription, base: str, tip: str) -> list[str]:
    """Return the joints from a link out to another; empty where there is no such way."""
    found: list[str] = []
    link = tip
    while link != base:
        joint = description.parent_joint.get(link)
        if joint is None:
            return []
        found.append(joint.name)
        link = joint.parent
    return found[::-1]


def _number(text: str | None) -> float | None:
    try:
        value = float((text or "").split()[0])
    except (ValueError, IndexError):
        return None
    return value if math.isfinite(value) else None
