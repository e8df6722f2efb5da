"""The compiled search of closest points finds what MuJoCo's function finds pair by pair."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.api import contact_points
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet_data import getDataPath


@pytest.fixture
def bodies() -> Iterator[list[int]]:
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(getDataPath())
    p.setGravity(0, 0, -9.8)
    found = [p.loadURDF("plane.urdf"), p.loadURDF("r2d2.urdf", [0, 0, 0.6])]
    found.append(p.loadURDF("kuka_iiwa/model.urdf", [0.5, 0, 0], [0, 0, 0.6, 0.8], useFixedBase=True))
    for kind, size in ((p.GEOM_BOX, {"halfExtents": [0.1, 0.2, 0.3]}), (p.GEOM_SPHERE, {"radius": 0.2})):
        shape = p.createCollisionShape(kind, **size)
        found.append(p.createMultiBody(1, shape, -1, [0.3 * len(found), 0.2, 0.8], [0.1, 0.5, 0.2, 0.8]))
    yield found
    p.disconnect()


def pair_by_pair(scene: Any, a: int, b: int, link: int, limit: float) -> Any:
    first, second = contact_points._geoms_of(scene, a, link), contact_points._geoms_of(scene, b, -2)
    return contact_points._closest_points(scene, scene.world, first.places, second.places, limit)


@pytest.mark.parametrize("limit", [-0.01, 0.0, 0.05, 0.7, 5.0])
def test_points_are_those_of_mujoco_pair_by_pair(bodies: list[int], limit: float) -> None:
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    some = 0
    for _ in range(4):
        p.stepSimulation()
        for a in bodies:
            for b in bodies:
                for link in (-2, -1):
                    p.resetJointState(bodies[2], 1, 0.3)
                    found = p.getClosestPoints(a, b, limit, link)
                    expected = pair_by_pair(scene, a, b, link, limit)
                    assert [row[:5] for row in found] == [row[:5] for row in expected]
                    for one, other in zip(found, expected, strict=True):
                        assert one[8] == pytest.approx(other[8], abs=1e-6)
                        if a != b and one[8] > -0.005:  # else many points are as near
                            np.testing.assert_allclose(one[7], other[7], rtol=0, atol=1e-4)
                            gap = np.subtract(one[5], one[6]) @ one[7]
                            assert gap == pytest.approx(one[8], abs=1e-9)
                    some += len(found)
    assert some or limit < 0


def test_few_shapes_are_placed_without_all_others(bodies: list[int]) -> None:
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    p.stepSimulation()
    before = p.getLinkState(bodies[2], 6)
    p.resetBasePositionAndOrientation(bodies[4], [0, 0, 3], [0, 0, 0, 1])
    (row,) = p.getClosestPoints(bodies[4], bodies[0], 5.0)
    assert scene.world.is_moved
    assert row[8] == pytest.approx(2.8, abs=1e-9)
    assert row[5] == pytest.approx((0, 0, 2.8), abs=1e-9)
    np.testing.assert_allclose(p.getLinkState(bodies[2], 6)[0], before[0], atol=1e-3)
