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


STAIRS = 6


@pytest.fixture
def stairs(client: int, tmp_path: Path) -> str:
    """Steps of 0.3 m by 2 m, each 0.15 m higher, as boxes in one mesh."""
    lines: list[str] = []
    faces: list[str] = []
    for k in range(STAIRS):
        low, high = (0.3 * k, -1.0, -0.1), (0.3 * k + 0.3, 1.0, 0.15 * k)
        lines += [
            "v {} {} {}".format(*((low, high)[corner >> axis & 1][axis] for axis in range(3)))
            for corner in range(8)
        ]
        for a, b, c, d in (
            (0, 2, 3, 1),
            (4, 5, 7, 6),
            (0, 1, 5, 4),
            (2, 6, 7, 3),
            (0, 4, 6, 2),
            (1, 3, 7, 5),
        ):
            first = 8 * k + 1
            faces += [f"f {first + a} {first + b} {first + c}", f"f {first + a} {first + c} {first + d}"]
    (tmp_path / "stairs.obj").write_text("\n".join([*lines, *faces, ""]))
    p.setGravity(0, 0, -10)
    return str(tmp_path / "stairs.obj")


@pytest.mark.parametrize("way", ["file", "memory"])
def test_bodies_rest_on_stairs_as_in_pybullet(stairs: str, way: str) -> None:
    """Heights of PyBullet 3.2.7: without margin on a file's triangles, 1 mm above those in memory.

    A sphere has no margin on either.
    """
    given: dict[str, object] = {"fileName": stairs}
    if way == "memory":
        lines = [line.split() for line in Path(stairs).read_text().splitlines()]
        given = {
            "vertices": [[float(v) for v in line[1:]] for line in lines if line[0] == "v"],
            "indices": [int(v) - 1 for line in lines if line[0] == "f" for v in line[1:]],
        }
    shape = p.createCollisionShape(p.GEOM_MESH, flags=p.GEOM_FORCE_CONCAVE_TRIMESH, **given)
    p.createMultiBody(0, shape)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.08, 0.05])
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.06)
    boxes = [p.createMultiBody(1, box, -1, [0.3 * k + 0.15, 0.2, 0.15 * k + 0.1]) for k in range(STAIRS)]
    balls = [p.createMultiBody(1, ball, -1, [0.3 * k + 0.15, -0.3, 0.15 * k + 0.1]) for k in range(STAIRS)]
    for _ in range(240):
        p.stepSimulation()
    for k in range(STAIRS):
        above = p.getBasePositionAndOrientation(boxes[k])[0][2] - 0.15 * k
        assert above == pytest.approx(0.051 if way == "memory" else 0.05, abs=2e-4)
        assert p.getBasePositionAndOrientation(balls[k])[0][2] - 0.15 * k == pytest.approx(0.06, abs=2e-4)


def test_the_closest_triangle_of_a_mesh_counts(stairs: str) -> None:
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=stairs, flags=p.GEOM_FORCE_CONCAVE_TRIMESH)
    body = p.createMultiBody(0, shape)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.06), -1, [0.15, 0, 0.2])
    nearest = min(point[8] for point in p.getClosestPoints(ball, body, 0.5))
    assert nearest == pytest.approx(math.hypot(0.15, 0.05) - 0.06, abs=5e-4), "the edge of the next step"
