"""Triangle meshes that stand still are met where their triangles are, not at their hull."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import roboyard.pybullet as p

VALLEY = "v -1 -1 1\nv 0 -1 0\nv 1 -1 1\nv -1 1 1\nv 0 1 0\nv 1 1 1\nf 1 2 5\nf 1 5 4\nf 2 3 6\nf 2 6 5\n"
RADIUS = 0.1


@pytest.fixture
def valley(client: int, tmp_path: Path) -> int:
    """Two slopes of 45 degrees that meet along the y axis."""
    p.setGravity(0, 0, -10)
    (tmp_path / "valley.obj").write_text(VALLEY)
    flags = p.GEOM_FORCE_CONCAVE_TRIMESH
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=str(tmp_path / "valley.obj"), flags=flags)
    return p.createMultiBody(0, shape)


def test_a_ball_rests_between_the_slopes(valley: int) -> None:
    ball = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS), basePosition=[0.3, 0, 0.9]
    )
    p.changeDynamics(ball, -1, linearDamping=0.5, angularDamping=0.5)
    for _ in range(1500):
        p.stepSimulation()
    x, _, z = p.getBasePositionAndOrientation(ball)[0]
    assert (x, z) == pytest.approx((0, RADIUS * math.sqrt(2)), abs=2e-3)
    assert {point[1:5] for point in p.getContactPoints(ball)} == {(ball, valley, -1, -1)}


def test_rays_meet_the_triangles(valley: int) -> None:
    for x in (-0.75, -0.25, 0.0, 0.4):
        (hit,) = p.rayTest([x, 0, 5], [x, 0, -5])
        assert hit[0] == valley
        assert hit[3][2] == pytest.approx(abs(x), abs=1e-3)


def test_such_a_body_looks_and_measures_as_before(valley: int) -> None:
    assert p.getAABB(valley) == (pytest.approx((-1, -1, 0), abs=5e-3), pytest.approx((1, 1, 1), abs=5e-3))
    assert len(p.getCollisionShapeData(valley, -1)) == len(p.getVisualShapeData(valley)) == 1
