"""How links hang together, for trees that may be broken: nothing here recurses or assumes one root."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roboyard.transforms import Array

Edge = tuple[str, str, Array, bool]
"""(parent, child, (4, 4) pose of the child frame in the parent frame, is fixed)."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tree:
    """Links and the joints between them; joints to unknown links are left out."""

    names: tuple[str, ...]
    """Links, in file order, each once."""
    edges: tuple[Edge, ...]

    @classmethod
    def of(cls, names: Sequence[str], edges: Sequence[Edge]) -> Tree:
        """Build it from link names and edges in file order."""
        known = dict.fromkeys(names)
        return cls(names=tuple(known), edges=tuple(e for e in edges if e[0] in known and e[1] in known))

    @cached_property
    def children(self) -> dict[str, list[int]]:
        """Link to the indices of the edges that leave it."""
        found: dict[str, list[int]] = {name: [] for name in self.names}
        for index, (parent, *_) in enumerate(self.edges):
            found[parent].append(index)
        return found

    @cached_property
    def parents(self) -> dict[str, list[int]]:
        """Link to the indices of the edges that arrive at it."""
        found: dict[str, list[int]] = {name: [] for name in self.names}
        for index, (_, child, *_) in enumerate(self.edges):
            found[child].append(index)
        return found

    @cached_property
    def roots(self) -> tuple[str, ...]:
        """Links that are no joint's child."""
        return tuple(name for name in self.names if not self.parents[name])

    @cached_property
    def is_sound(self) -> bool:
        """One root that reaches every link along exactly one way."""
        one_parent = all(len(arriving) <= 1 for arriving in self.parents.values())
        return len(self.roots) == 1 and one_parent and len(self.frames) == len(self.names)

    @cached_property
    def frames(self) -> dict[str, Array]:
        """(4, 4) pose of every link that a root reaches, in that root's frame, all joints at zero."""
        found: dict[str, Array] = {}
        for root in self.roots:
            found[root] = np.eye(4)
            stack = [root]
            while stack:
                parent = stack.pop()
                for index in self.children[parent]:
                    _, child, pose, _ = self.edges[index]
                    if child not in found:
                        found[child] = found[parent] @ pose
                        stack.append(child)
        return found

    @cached_property
    def loops(self) -> tuple[tuple[str, ...], ...]:
        """Rings of links, at most ten: each link is the child of the one before, the first of the last."""
        state: dict[str, int] = {}
        found: list[tuple[str, ...]] = []
        for start in self.names:
            if start in state:
                continue
            state[start] = 1
            way = [start]
            pending = [iter(self.children[start])]
            while pending and len(found) < 10:
                index = next(pending[-1], None)
                if index is None:
                    pending.pop()
                    state[way.pop()] = 2
                    continue
                child = self.edges[index][1]
                if state.get(child) == 1:
                    found.append(tuple(way[way.index(child) :]))
                elif child not in state:
                    state[child] = 1
                    way.append(child)
                    pending.append(iter(self.children[child]))
        return tuple(found)

    @cached_property
    def bodies(self) -> tuple[tuple[str, ...], ...]:
        """Links joined by fixed joints, each such body once, in file order of its first link."""
        leader = {name: name for name in self.names}

        def find(name: str) -> str:
            while leader[name] != name:
                leader[name] = leader[leader[name]]
                name = leader[name]
            return name

        for parent, child, _, fixed in self.edges:
            if fixed:
                leader[find(child)] = find(parent)
        members: dict[str, list[str]] = {}
        for name in self.names:
            members.setdefault(find(name), []).append(name)
        return tuple(tuple(links) for links in members.values())

    @cached_property
    def body_of(self) -> dict[str, int]:
        """Link to the index of its body."""
        return {name: k for k, links in enumerate(self.bodies) for name in links}

    @cached_property
    def body_pairs(self) -> frozenset[tuple[int, int]]:
        """Pairs of bodies (smaller index first) that a joint connects."""
        pairs = set()
        for parent, child, _, fixed in self.edges:
            a, b = self.body_of[parent], self.body_of[child]
            if not fixed and a != b:
                pairs.add((min(a, b), max(a, b)))
        return frozenset(pairs)
