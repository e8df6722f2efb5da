"""The graph of links and joints of files that may be broken: nothing here recurses or assumes one root."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Protocol

import numpy as np

from roboyard._records import dataclass
from roboyard.transforms import Array


class Edge(Protocol):
    """A joint between two links."""

    @property
    def parent(self) -> str:
        """Name of the parent link."""
        ...

    @property
    def child(self) -> str:
        """Name of the child link."""
        ...

    @property
    def rest(self) -> Array:
        """(4, 4) pose of the child frame in the parent frame."""
        ...

    @property
    def is_fixed(self) -> bool:
        """True where the child does not move against the parent."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class LinkTree:
    """Links and the joints between them; joints to unknown links are skipped."""

    names: tuple[str, ...]
    """Links, in file order, each once."""
    edges: tuple[Edge, ...]

    @classmethod
    def of(cls, names: Iterable[str], edges: Iterable[Edge]) -> LinkTree:
        """Return the tree of link names and edges in file order."""
        known = dict.fromkeys(names)
        return cls(
            names=tuple(known), edges=tuple(e for e in edges if e.parent in known and e.child in known)
        )

    @cached_property
    def children(self) -> dict[str, list[int]]:
        """Link to the indices of the edges that leave it."""
        found: dict[str, list[int]] = {name: [] for name in self.names}
        for index, edge in enumerate(self.edges):
            found[edge.parent].append(index)
        return found

    @cached_property
    def parents(self) -> dict[str, list[int]]:
        """Link to the indices of the edges that arrive at it."""
        found: dict[str, list[int]] = {name: [] for name in self.names}
        for index, edge in enumerate(self.edges):
            found[edge.child].append(index)
        return found

    @cached_property
    def roots(self) -> tuple[str, ...]:
        """Links that are no joint's child."""
        return tuple(name for name in self.names if not self.parents[name])

    @cached_property
    def is_valid(self) -> bool:
        """True for one root that reaches every link along exactly one path."""
        one_parent = all(len(arriving) <= 1 for arriving in self.parents.values())
        return len(self.roots) == 1 and one_parent and len(self.frames) == len(self.names)

    @cached_property
    def frames(self) -> dict[str, Array]:
        """(4, 4) pose of every link that a root reaches, in that root's frame, all joints at rest."""
        found: dict[str, Array] = {}
        for root in self.roots:
            found[root] = np.eye(4)
            stack = [root]
            while stack:
                parent = stack.pop()
                for index in self.children[parent]:
                    edge = self.edges[index]
                    if edge.child not in found:
                        found[edge.child] = found[parent] @ edge.rest
                        stack.append(edge.child)
        return found

    @cached_property
    def loops(self) -> tuple[tuple[str, ...], ...]:
        """Loops of links, at most ten: each link is the child of the one before, the first of the last."""
        state: dict[str, int] = {}
        found: list[tuple[str, ...]] = []
        for start in self.names:
            if start in state:
                continue
            state[start] = 1
            path = [start]
            pending = [iter(self.children[start])]
            while pending and len(found) < 10:
                index = next(pending[-1], None)
                if index is None:
                    pending.pop()
                    state[path.pop()] = 2
                    continue
                child = self.edges[index].child
                if state.get(child) == 1:
                    found.append(tuple(path[path.index(child) :]))
                elif child not in state:
                    state[child] = 1
                    path.append(child)
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

        for edge in self.edges:
            if edge.is_fixed:
                leader[find(edge.child)] = find(edge.parent)
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
        for edge in self.edges:
            a, b = self.body_of[edge.parent], self.body_of[edge.child]
            if not edge.is_fixed and a != b:
                pairs.add((min(a, b), max(a, b)))
        return frozenset(pairs)
