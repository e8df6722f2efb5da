"""Contacts of the last step that are kept through edits, read pair by pair."""

from itertools import product

import pytest

import roboyard.pybullet as p


@pytest.fixture
def boxes(client: int) -> list[int]:
    p.setGravity(0, 0, -9.8)
    plane = p.createCollisionShape(p.GEOM_PLANE)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    places = ([0, 0, 0.1], [0, 0, 0.3], [1, 0, 0.1])
    made = [p.createMultiBody(0, plane)] + [p.createMultiBody(1, box, -1, place) for place in places]
    for _ in range(20):
        p.stepSimulation()
    return made


def rows(boxes: list[int]) -> dict[tuple[int, ...], list[tuple[object, ...]]]:
    """Return the links and signs of normals of the contacts of all pairs of bodies and links."""
    found = {}
    for wanted in product((-1, *boxes), (-1, *boxes), (-2, -1, 0), (-2, -1)):
        points = p.getContactPoints(*wanted)
        found[wanted] = [(*point[:5], *(round(x, 9) for x in (*point[5], *point[7]))) for point in points]
    return found


def test_all_pairs_are_those_before_the_edit(boxes: list[int]) -> None:
    before = rows(boxes)
    assert sum(map(len, before.values())) > 100
    p.createMultiBody(1, basePosition=[9, 9, 9])
    assert rows(boxes) == before
    assert rows(boxes) == before, "from what the first reading has kept"


def test_contacts_of_a_removed_body_are_gone(boxes: list[int]) -> None:
    p.createMultiBody(1, basePosition=[9, 9, 9])
    before = rows(boxes)
    removed = boxes[2]
    p.removeBody(removed)
    after = rows(boxes)
    for wanted, points in before.items():
        assert after[wanted] == [point for point in points if removed not in point[1:3]]
    p.stepSimulation()
    assert {point[1:3] for point in p.getContactPoints()} == {(boxes[1], 0), (boxes[3], 0)}


def test_filtered_links_have_no_contacts(boxes: list[int]) -> None:
    p.createMultiBody(1, basePosition=[9, 9, 9])
    assert p.getContactPoints(boxes[3])
    p.setCollisionFilterGroupMask(boxes[3], -1, 0, 0)
    assert p.getContactPoints(boxes[3]) == ()
    assert p.getContactPoints(boxes[1])
