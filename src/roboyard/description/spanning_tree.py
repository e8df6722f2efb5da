"""A tree of links from the graph that joints of SDF or USD make: some are turned round, loops stay open.

There any two links may be joined: a link may have two parents, and a robot may be fixed to the world
anywhere.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from roboyard._records import dataclass

Edge = tuple[str, str]
"""Parent and child."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SpanningTree:
    """The links that hang from one root."""

    root: str
    links: tuple[str, ...]
    """The root first, then in the order in which they were reached."""
    arriving: dict[str, tuple[int, bool]]
    """Link to the index of its edge, and whether it is used from child to parent."""
    loops: tuple[int, ...]
    """Indices of edges between these links that the tree does not need."""
    others: tuple[str, ...]
    """Links that do not hang from the root."""


def spanning_tree(
    links: Sequence[str], edges: Sequence[Edge], *, world: str, wanted: str = ""
) -> SpanningTree:
    """Return the tree of the part with most links; edges keep their direction where they can.

    Args:
        links: at least one name, each once.
        edges: between these links.
        world: name of the link that is the root where it is part of the tree.
        wanted: the root to take where no link is without a parent.
    """
    leaving: dict[str, list[int]] = {name: [] for name in links}
    arriving: dict[str, list[int]] = {name: [] for name in links}
    for index, (parent, child) in enumerate(edges):
        leaving[parent].append(index)
        arriving[child].append(index)
    part = _largest(_parts(links, edges, leaving, arriving))
    root = _root(part, edges, leaving, arriving, world, wanted)
    order, taken = [root], {root: (-1, False)}
    forwards, backwards = list(leaving[root]), list(arriving[root])
    heapq.heapify(forwards)
    heapq.heapify(backwards)
    while forwards or backwards:
        turned = not forwards
        index = heapq.heappop(backwards if turned else forwards)
        link = edges[index][0 if turned else 1]
        if link in taken:
            continue
        taken[link] = (index, turned)
        order.append(link)
        for each in leaving[link]:
            heapq.heappush(forwards, each)
        for each in arriving[link]:
            heapq.heappush(backwards, each)
    used = {index for index, _ in taken.values()}
    return SpanningTree(
        root=root,
        links=tuple(order),
        arriving={link: edge for link, edge in taken.items() if link != root},
        loops=tuple(k for k, (parent, _) in enumerate(edges) if parent in taken and k not in used),
        others=tuple(name for name in links if name not in taken),
    )


def _parts(
    links: Sequence[str], edges: Sequence[Edge], leaving: dict[str, list[int]], arriving: dict[str, list[int]]
) -> list[list[str]]:
    """Return the connected parts, each in the order of the links."""
    part_of: dict[str, int] = {}
    count = 0
    for start in links:
        if start in part_of:
            continue
        part_of[start] = count
        todo = [start]
        while todo:
            link = todo.pop()
            near = [edges[k][1] for k in leaving[link]] + [edges[k][0] for k in arriving[link]]
            for other in near:
                if other not in part_of:
                    part_of[other] = count
                    todo.append(other)
        count += 1
    parts: list[list[str]] = [[] for _ in range(count)]
    for link in links:
        parts[part_of[link]].append(link)
    return parts


def _largest(parts: list[list[str]]) -> list[str]:
    return max(parts, key=len)


def _root(
    part: Sequence[str],
    edges: Sequence[Edge],
    leaving: dict[str, list[int]],
    arriving: dict[str, list[int]],
    world: str,
    wanted: str,
) -> str:
    if world in part:
        return world
    free = [link for link in part if not arriving[link]]
    if not free:
        return wanted if wanted in part else part[0]
    if len(free) == 1:
        return free[0]
    return max(free[:100], key=lambda link: _reach(link, edges, leaving))


def _reach(link: str, edges: Sequence[Edge], leaving: dict[str, list[int]]) -> int:
    seen, todo = {link}, [link]
    while todo:
        for index in leaving[todo.pop()]:
            child = edges[index][1]
            if child not in seen:
                seen.add(child)
                todo.append(child)
    return len(seen)
