"""Check that links and joints form one tree, and that mimic joints can follow."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from roboyard.description.model import Joint, Link
from roboyard.description.urdf.problems import Problems
from roboyard.description.urdf.write import mimic_element
from roboyard.errors import unknown_name


def check_tree(links: Sequence[Link], joints: Sequence[Joint], problems: Problems) -> None:
    """Report duplicate and unknown names, second parents, several roots and loops."""
    before = len(problems.errors)
    names = _check_unique("link", links, problems)
    _check_unique("joint", joints, problems)
    parent: dict[str, Joint] = {}
    for joint in joints:
        who, line = f'joint "{joint.name}"', joint.source.line
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in names:
                problems.error(line, who, f"{role}: {unknown_name('link', name, names)}")
        if joint.child in parent:
            first = parent[joint.child].name
            problems.error(
                line, who, f'link "{joint.child}" is already the child of joint "{first}"; give it one parent'
            )
        else:
            parent[joint.child] = joint
    if len(problems.errors) > before:
        return
    roots = [link for link in links if link.name not in parent]
    _check_loops([link.name for link in roots], links, joints, parent, problems)
    if len(roots) > 1:
        named = ", ".join(f'"{link.name}"' for link in roots[:6]) + (", ..." if len(roots) > 6 else "")
        problems.error(
            roots[1].source.line,
            f'link "{roots[1].name}"',
            f"{len(roots)} root links ({named}); a robot has one root, so join them with fixed joints",
        )


def _check_unique(
    kind: str, things: Sequence[Link] | Sequence[Joint], problems: Problems
) -> dict[str, int | None]:
    seen: dict[str, int | None] = {}
    for thing in things:
        if thing.name in seen:
            where = f" (first in line {seen[thing.name]})" if seen[thing.name] else ""
            problems.error(
                thing.source.line,
                f'{kind} "{thing.name}"',
                f"the name is used twice{where}; rename one of them",
            )
        else:
            seen[thing.name] = thing.source.line
    return seen


def _check_loops(
    roots: Sequence[str],
    links: Sequence[Link],
    joints: Sequence[Joint],
    parent: dict[str, Joint],
    problems: Problems,
) -> None:
    children: dict[str, list[str]] = {link.name: [] for link in links}
    for joint in joints:
        children[joint.parent].append(joint.child)
    reached: set[str] = set()
    stack = list(roots)
    while stack:
        name = stack.pop()
        reached.add(name)
        stack.extend(children[name])
    left = {link.name for link in links} - reached
    for link in links:
        if link.name not in left:
            continue
        ring: list[Joint] = []
        name, seen = link.name, set()
        while name not in seen:  # upwards from here there must be a ring, as no root is reached
            seen.add(name)
            ring.append(parent[name])
            name = parent[name].parent
        start = next(i for i, joint in enumerate(ring) if joint.child == name)
        ring = ring[start:]
        named = " <- ".join(f'"{joint.child}"' for joint in ring[:6]) + (" <- ..." if len(ring) > 6 else "")
        closing = ring[0]
        problems.error(
            closing.source.line,
            f'joint "{closing.name}"',
            f"closes a loop of links ({named}) that no root reaches; remove one joint of the loop",
        )
        stack = [joint.child for joint in ring]  # everything below this ring is explained by it
        while stack:
            name = stack.pop()
            if name in left:
                left.discard(name)
                stack.extend(children[name])


def drop_unusable_mimics(joints: Sequence[Joint], problems: Problems) -> list[Joint]:
    """Joints whose mimic names no moving joint, or leads back to itself, made free; `extra` keeps the XML."""
    by_name = {joint.name: joint for joint in joints}
    rings = _ring_entries(by_name)
    out: list[Joint] = []
    for joint in joints:
        reason = _mimic_problem(joint, by_name, rings)
        if reason is None or joint.mimic is None:
            out.append(joint)
            continue
        problems.note(joint.source.line, f'joint "{joint.name}"', f"mimic: {reason}; it moves freely")
        kept: tuple[ET.Element, ...] = (*joint.extra, mimic_element(joint.mimic))
        out.append(dataclasses.replace(joint, mimic=None, extra=kept))
    return out


def _ring_entries(by_name: dict[str, Joint]) -> dict[str, str]:
    """Joint to the first joint it leads to that follows itself, however far away; none for all others."""
    entries: dict[str, str | None] = {}
    for start in by_name:
        way: dict[str, None] = {}
        name = start
        while name not in entries and name not in way:
            mimic = by_name[name].mimic
            if mimic is None or mimic.joint not in by_name:
                entries[name] = None
                break
            way[name] = None
            name = mimic.joint
        if name in way:
            names = list(way)
            ring = names[names.index(name) :]
            entries |= {member: member for member in ring}
        for member in way:
            entries.setdefault(member, entries[name])
    return {name: entry for name, entry in entries.items() if entry is not None}


def _mimic_problem(joint: Joint, by_name: dict[str, Joint], rings: dict[str, str]) -> str | None:
    if joint.mimic is None:
        return None
    leader = by_name.get(joint.mimic.joint)
    if leader is None:
        return unknown_name("joint", joint.mimic.joint, by_name)
    if not leader.is_moving:
        return f'joint "{leader.name}", which it follows, is fixed'
    entry = rings.get(joint.name)
    if entry is None:
        return None
    return "it follows itself" if entry == joint.name else f'it follows "{entry}", which follows itself'
