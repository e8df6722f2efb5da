"""Trees that are broken in every way are still walked to the end."""

from dataclasses import dataclass, field

import numpy as np

from roboyard.audit.renames import identifier
from roboyard.description.urdf.link_tree import LinkTree


@dataclass(frozen=True)
class Edge:
    parent: str
    child: str
    is_fixed: bool = False
    rest: np.ndarray = field(default_factory=lambda: np.eye(4))


def tree(*edges: str, fixed: str = "") -> LinkTree:
    """From words such as "ab": a carries b."""
    names = dict.fromkeys("".join(edges))
    return LinkTree.of(list(names), [Edge(e[0], e[1], e in fixed.split()) for e in edges])


def test_a_sound_tree() -> None:
    found = tree("ab", "bc", "ad")
    assert found.roots == ("a",)
    assert found.is_valid
    assert found.loops == ()


def test_rings_are_found_whole_and_once() -> None:
    assert [set(ring) for ring in tree("ab", "bc", "ca").loops] == [{"a", "b", "c"}]
    assert tree("aa").loops == (("a",),)
    assert [set(ring) for ring in tree("ab", "cd", "dc").loops] == [{"c", "d"}]
    assert not tree("ab", "cd", "dc").is_valid


def test_two_ways_to_one_link_are_no_ring() -> None:
    found = tree("ab", "ac", "bd", "cd")
    assert found.loops == ()
    assert not found.is_valid


def test_many_rings_end() -> None:
    count = 3000
    edges = [Edge(f"l{k}", f"l{k + 1}") for k in range(count)]
    edges += [Edge(f"l{k + 1}", f"l{k}") for k in range(count)]
    found = LinkTree.of([f"l{k}" for k in range(count + 1)], edges)
    assert len(found.loops) == 10
    assert found.roots == ()
    assert found.frames == {}


def test_fixed_joints_make_one_body() -> None:
    found = tree("ab", "bc", "cd", fixed="bc")
    assert [set(body) for body in found.bodies] == [{"a"}, {"b", "c"}, {"d"}]
    assert {frozenset(pair) for pair in found.body_pairs} == {frozenset({0, 1}), frozenset({1, 2})}


def test_edges_to_unknown_links_are_left_out() -> None:
    found = LinkTree.of(["a"], [Edge("a", "ghost", is_fixed=True)])
    assert found.edges == ()
    assert found.bodies == (("a",),)


def test_identifiers() -> None:
    assert identifier("left (arm) link") == "left__arm__link"
    assert identifier("gélenk-1") == "gelenk_1"
    assert identifier("0") == "_0"
    assert identifier("基座") == "u57fa_u5ea7"
    assert identifier("  ") == "unnamed"
    assert identifier("(") == "unnamed"
