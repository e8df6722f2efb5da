"""Triangle meshes that stand still are met where their triangles are, not at their hull."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

import roboyard.pybullet as p
from roboyard.sim.stepping.narrow_phase import field_contacts

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


def test_one_triangle_is_met_by_rays_and_bodies(client: int) -> None:
    p.setGravity(0, 0, -10)
    corners = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
    flags = p.GEOM_FORCE_CONCAVE_TRIMESH
    shape = p.createCollisionShape(p.GEOM_MESH, vertices=corners, indices=[0, 1, 2], flags=flags)
    ground = p.createMultiBody(0, shape)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS), -1, [0, -0.3, 0.3])
    for _ in range(240):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0] == pytest.approx((0, -0.3, RADIUS), abs=1e-4)
    assert p.rayTest([0.1, -0.5, 1], [0.1, -0.5, -1])[0][0] == ground


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
    points = p.getClosestPoints(ball, body, 0.5)
    nearest = min(points, key=lambda point: point[8])
    assert nearest[8] == pytest.approx(math.hypot(0.15, 0.05) - 0.06, abs=5e-4), "the edge of the next step"
    # PyBullet 3.2.7 has those of all triangles within the distance
    assert len(points) == 20
    assert nearest[8] == pytest.approx(0.0981138924327411, abs=1e-9)
    assert nearest[5] == pytest.approx((0.20692099901394928, 0.0, 0.18102633743174543), abs=1e-8)
    assert nearest[6] == pytest.approx((0.30000001192092896, 0.0, 0.15000000596046448), abs=1e-8)


@pytest.mark.parametrize("swapped", [False, True])
def test_closest_points_of_a_height_field_are_those_of_all_its_triangles(client: int, swapped: bool) -> None:
    """The numbers of PyBullet 3.2.7."""
    shape = p.createCollisionShape(
        p.GEOM_HEIGHTFIELD, meshScale=[0.1, 0.1, 1], numHeightfieldRows=8, numHeightfieldColumns=8,
        heightfieldData=[0.1 * ((7 * k) % 5) for k in range(64)],
    )  # fmt: skip
    ground = p.createMultiBody(0, shape)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0, 0.6])
    points = p.getClosestPoints(*((ground, ball) if swapped else (ball, ground)), 1.0)
    assert len(points) == 98
    first = points[0]
    on_ball, on_ground = (first[6], first[5]) if swapped else (first[5], first[6])
    assert on_ball == pytest.approx(
        (-0.03386427307392981, -0.04740998230350174, 0.5187257446225684), abs=1e-9
    )
    assert on_ground == pytest.approx((-0.25, -0.35, 0.0), abs=1e-8)
    normal = [-v for v in first[7]] if swapped else list(first[7])
    assert normal == pytest.approx((0.3386427307392982, 0.4740998230350175, 0.8127425537743156), abs=1e-9)
    assert first[8] == pytest.approx(0.6382411530116701, abs=1e-9)


def test_shapes_of_forms_that_are_not_known_meet_slots(stairs: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(field_contacts, "are_known", lambda model, forms: False)
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=stairs, flags=p.GEOM_FORCE_CONCAVE_TRIMESH)
    body = p.createMultiBody(0, shape)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.06), -1, [0.15, -0.3, 0.1])
    for _ in range(240):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.06, abs=2e-4)
    assert {point[2] for point in p.getContactPoints(ball)} == {body}
    nearest = min(point[8] for point in p.getClosestPoints(ball, body, 0.2))
    assert nearest == pytest.approx(0.0, abs=5e-4)


def test_soft_bodies_rest_on_triangles(stairs: str) -> None:
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=stairs, flags=p.GEOM_FORCE_CONCAVE_TRIMESH)
    p.createMultiBody(0, shape)
    lines = [f"v {x} {y} {z}" for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    for a, b, c, d in ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)):
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    cube = Path(stairs).with_name("cube.obj")
    cube.write_text("\n".join([*lines, ""]))
    soft = p.loadSoftBody(
        str(cube), basePosition=[0.75, 0, 0.6], scale=0.2, mass=1, useMassSpring=1,
        springElasticStiffness=40, springDampingStiffness=0.1, collisionMargin=0.01,
    )  # fmt: skip
    for _ in range(240):
        p.stepSimulation()
    assert p.getAABB(soft)[0][2] == pytest.approx(0.3, abs=0.03), "the third step"


_TROUGH = """
v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1
f 1 2 3\nf 1 3 4\nf 1 6 2\nf 1 5 6\nf 4 3 8\nf 4 8 7
"""
_ON_A_FIXED_JOINT = """<robot name="cell"><link name="base"/>
<link name="trough"><collision concave="yes"><geometry><mesh filename="trough.obj"/></geometry></collision>
</link>
<joint name="fixed" type="fixed"><parent link="base"/><child link="trough"/><origin xyz="0.5 0 0.2"/></joint>
</robot>"""
_IN_SDF = """<sdf version="1.6"><world name="w"><model name="cell"><static>1</static><link name="trough">
<inertial><mass>0</mass><inertia><ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz><izz>1</izz>
</inertia></inertial>
<collision concave="yes" name="c"><geometry><mesh><scale>1 1 1</scale><uri>trough.obj</uri></mesh>
</geometry></collision></link></model></world></sdf>"""


@pytest.mark.parametrize(
    ("name", "text", "link", "floor", "height"),
    [
        ("cell.urdf", _ON_A_FIXED_JOINT, 0, 0.2, 0.29998989564487993),
        ("cell.sdf", _IN_SDF, -1, 0.0, 0.09998580463447805),
    ],
)
def test_bodies_fall_into_a_concave_mesh_of_a_fixed_link(
    client: int, tmp_path: Path, name: str, text: str, link: int, floor: float, height: float
) -> None:
    (tmp_path / "trough.obj").write_text(_TROUGH)
    file = tmp_path / name
    file.write_text(text)
    p.setGravity(0, 0, -10)
    body = p.loadURDF(str(file), useFixedBase=True) if link == 0 else p.loadSDF(str(file))[0]
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0.5, 0.3, 1.0])
    hit = p.rayTest([0.5, 0.5, 5], [0.5, 0.5, -5])[0]
    assert hit[:2] == (body, link)
    assert hit[3][2] == pytest.approx(floor, abs=1e-7)
    for step in range(200):
        p.stepSimulation()
        if step == 60:  # still above the floor, below the edges of the walls; PyBullet 3.2.7's height
            assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.6741637750521994, abs=1e-8)
    assert p.getBasePositionAndOrientation(ball)[0] == pytest.approx((0.5, 0.3, height), abs=2e-6)
    assert {contact[3] for contact in p.getContactPoints(body, ball)} == {link}
