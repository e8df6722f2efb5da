"""Check that links and joints form one tree."""

from __future__ import annotations

from collections.abc import Sequence

from roboyard.description.urdf.elements import JointElement, LinkElement
from roboyard.description.urdf.parse import UrdfElements
from roboyard.description.urdf.problems import Problems
from roboyard.errors import unknown_name


def report_tree_problems(elements: UrdfElements, problems: Problems) -> None:
    """Report duplicate and unknown names, second parents, several roots and loops."""
    before = len(problems.errors)
    names = dict.fromkeys(link.name for link in elements.links)
    _check_unique("link", elements.links, problems)
    _check_unique("joint", elements.joints, problems)
    parent: dict[str, JointElement] = {}
    for joint in elements.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in names:
                problems.error(joint.line, joint.who, f"{role}: {unknown_name('link', name, names)}")
        first = parent.setdefault(joint.child, joint)
        if first is not joint:
            problems.error(
                joint.line,
                joint.who,
                f'link "{joint.child}" is already the child of joint "{first.name}"; give it one parent',
            )
    if len(problems.errors) > before:
        return
    for loop in elements.tree.loops:
        upwards = [loop[0], *reversed(loop[1:])]
        named = " <- ".join(f'"{name}"' for name in upwards[:6]) + (" <- ..." if len(upwards) > 6 else "")
        closing = parent[loop[0]]
        problems.error(
            closing.line,
            closing.who,
            f"closes a loop of links ({named}) that no root reaches; remove one joint of the loop",
        )
    roots = elements.tree.roots
    if len(roots) > 1:
        named = ", ".join(f'"{name}"' for name in roots[:6]) + (", ..." if len(roots) > 6 else "")
        second = elements.link_by_name[roots[1]]
        message = f"{len(roots)} root links ({named}); a robot has one root, so join them with fixed joints"
        problems.error(second.line, second.who, message)


def _check_unique(
    kind: str, elements: Sequence[LinkElement] | Sequence[JointElement], problems: Problems
) -> None:
    first: dict[str, int | None] = {}
    for element in elements:
        if element.name in first:
            line = first[element.name]
            where = f" (first in line {line})" if line else ""
            message = f"the name is used twice{where}; rename one of them"
            problems.error(element.line, f'{kind} "{element.name}"', message)
        else:
            first[element.name] = element.line
