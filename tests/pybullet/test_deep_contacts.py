"""Where shapes touch that begin deep in one another; numbers are of PyBullet 3.2.7.

The way out of an overlap ends at a face or an edge, all of whose points are as near as each other: which one
becomes the contact follows from the steps of the search.
"""

from __future__ import annotations

import numpy as np
import pytest

from roboyard import pybullet as p

PLATE, CYLINDER, ROD, HULL = (
    ("box", 15.0, 15.0, 5.0),
    ("cylinder", 0.2, 0.3),
    ("cylinder", 0.065, 0.43),
    ("hull",),
)
CORNERS = [
    [-0.1, -0.1, -0.1], [0.12, -0.1, -0.08], [0.1, 0.11, -0.1], [-0.1, 0.1, -0.09], [0.02, 0, 0.15],
    [-0.05, 0.03, 0.12],
]  # fmt: skip
TURNED = (0.3, 0.1, 0.2, 0.927361850)
DOWN = [0.0, 0.0, -1.0]
CASES = {
    "a cylinder that stands in a plate": (
        (PLATE, (0, 0, -5)), (ROD, (0.02, 0.01, 0.05), (0, 0, 0, 1)),
        [0.0457995, 0.0232273, 0.0], DOWN, -0.165,
    ),
    "a cylinder that leans in a plate": (
        (PLATE, (0, 0, -5)), (ROD, (0.02, 0.01, 0.05), (0.1, 0.3, 0, 0.948683298)),
        [-0.0532384, 0.0344128, 0.0], DOWN, -0.1606,
    ),
    "a hull in a plate": (
        (PLATE, (0, 0, -5)), (HULL, (0.02, 0.01, -0.02), TURNED),
        [-0.0694528, -0.0554528, 0.0], DOWN, -0.15409447,
    ),
    "a hull in a cylinder": (
        (CYLINDER, (0, 0, 0)), (HULL, (0.05, 0.02, 0.11), TURNED),
        [-0.0394528, -0.0454528, 0.15], DOWN, -0.17409447,
    ),
    "a cylinder across a box": (
        (("box", 0.2, 0.1, 0.1), (0, 0, 0)),
        (("cylinder", 0.05, 0.4), (0.03, 0.05, 0.08), (0.5, 0.5, 0.5, 0.5)),
        [0.015, 0.05, 0.1], DOWN, -0.07,
    ),
    "cylinders": (
        (CYLINDER, (0, 0, 0)), (("cylinder", 0.1, 0.3), (0.05, 0.12, 0.1), (0.5, 0.1, 0.2, 0.836660027)),
        [0.0483988, 0.193617, 0.1498185], [-0.1393684, -0.5573986, -0.818464], -0.1815855,
    ),
}  # fmt: skip
"""The fixed shape and its place, the moving one with its pose; point on the first, normal, distance."""


def _shape(kind: str, *sizes: float) -> int:
    if kind == "box":
        return p.createCollisionShape(p.GEOM_BOX, halfExtents=sizes)
    if kind == "cylinder":
        return p.createCollisionShape(p.GEOM_CYLINDER, radius=sizes[0], height=sizes[1])
    return p.createCollisionShape(p.GEOM_MESH, vertices=CORNERS)


@pytest.mark.parametrize("name", CASES)
def test_the_way_out_is_that_of_pybullet(client: int, name: str) -> None:
    (fixed, place), (moving, position, turn), point, normal, distance = CASES[name]
    p.createMultiBody(0, _shape(*fixed), basePosition=place)
    p.createMultiBody(1, _shape(*moving), -1, position, turn)
    p.stepSimulation()
    (contact,) = p.getContactPoints()
    np.testing.assert_allclose(contact[5], point, atol=2e-7)
    np.testing.assert_allclose(contact[7], normal, atol=2e-7)
    assert contact[8] == pytest.approx(distance, abs=2e-8)
