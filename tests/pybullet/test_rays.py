"""Rays and overlaps as PyBullet 3.2.7 answers them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

OFFSET = """<robot name="offset"><link name="base"><inertial><origin xyz="0 0 0.5"/><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><cylinder radius="0.2" length="2"/></geometry></collision></link></robot>"""


def _boxes(*places: float) -> list[int]:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    return [p.createMultiBody(1, shape, basePosition=[x, 0, 0]) for x in places]


def test_numbered_hits_count_from_the_shape_made_last(client: int) -> None:
    _boxes(1, 2, 3)
    for start, end in (([0, 0, 0], [9, 0, 0]), ([9, 0, 0], [0, 0, 0])):
        found = [p.rayTest(start, end, reportHitNumber=k)[0] for k in range(4)]
        assert [hit[0] for hit in found] == [2, 1, 0, -1]
    assert p.rayTestBatch([[0, 0, 0]], [[9, 0, 0]], reportHitNumber=1)[0][2] == pytest.approx(1.9 / 9)
    assert p.rayTest([0, 0, 0], [9, 0, 0])[0][0] == 0
    p.setCollisionFilterGroupMask(1, -1, 8, 255)
    assert p.rayTest([0, 0, 0], [9, 0, 0], reportHitNumber=0, collisionFilterMask=8)[0][0] == 1


def test_rays_move_with_the_inertial_frame_of_their_parent(client: int, tmp_path: Path) -> None:
    file = tmp_path / "offset.urdf"
    file.write_text(OFFSET)
    body = p.loadURDF(str(file), [0, 0, 1])
    _boxes(2)
    p.resetBasePositionAndOrientation(1, [2, 0, 1.5], [0, 0, 0, 1])
    hit = p.rayTestBatch([[1, 0, 0]], [[3, 0, 0]], parentObjectUniqueId=body)[0]
    assert hit[0] == 1
    assert hit[3] == pytest.approx([1.9, 0, 1.5], abs=1e-9)


def test_rays_move_with_a_link_however_often_they_are_cast(client: int) -> None:
    """Rays along a turned link, in a closed form, at positions that change from call to call."""
    box, ball = (
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1]),
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.5),
    )
    body = p.createMultiBody(
        1, box, -1, [0, 0, 5], linkMasses=[1], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0.5]],
        linkInertialFrameOrientations=[[0, 0, 1, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    target = p.createMultiBody(0, ball, -1, [0, 0, 0])
    for turn in range(130):
        angle, height = 0.02 * turn, 0.001 * turn
        p.resetJointState(body, 0, angle)
        p.resetBasePositionAndOrientation(body, [0, 0, height], [0, 0, 0, 1])
        # the link's inertial frame has its x axis along y of the link
        x, y = -3 * math.sin(angle), 3 * math.cos(angle)
        p.resetBasePositionAndOrientation(target, [x, y, height + 1.5], [0, 0, 0, 1])
        hits = p.rayTestBatch(
            [[0, 0, 0], [0, 0, 0]], [[5, 0, 0], [-5, 0, 0]], parentObjectUniqueId=body, parentLinkIndex=0
        )
        assert [hit[0] for hit in hits] == [target, -1]
        np.testing.assert_allclose(hits[0][3], [x * 2.5 / 3, y * 2.5 / 3, height + 1.5], atol=1e-9)
        (hit,) = p.rayTestBatch([[3, 0, 0]], [[0, 0, 0]], parentObjectUniqueId=body)
        assert (hit[0], hit[2]) == (body, pytest.approx(2.9 / 3, abs=1e-9))
        (hit,) = p.rayTestBatch([[x, y, 9]], [[x, y, 0]], parentObjectUniqueId=body, parentLinkIndex=7)
        assert hit[0] == target, "with a link that is not there, rays stay where they are"
        (hit,) = p.rayTestBatch([[3, 0, 0]], [[0, 0, 0]], 1, body, -1, 0, -1)
        assert hit[0] == body
        (hit,) = p.rayTestBatch([[x, y, 9]], [[x, y, 0]], parentObjectUniqueId=99)
        assert hit[0] == target


def test_hulls_are_met_at_their_margin(client: int, tmp_path: Path) -> None:
    file = tmp_path / "offset.urdf"
    file.write_text(OFFSET)
    p.loadURDF(str(file))
    straight, slanted = p.rayTestBatch([[1, 0, 0], [0.5, -1, 0]], [[-1, 0, 0], [0.5, 1, 0]])
    assert straight[3][0] == pytest.approx(0.201, abs=1e-5)  # at an edge of the prism
    x, y = math.cos(math.pi / 32), math.sin(math.pi / 32)
    (side,) = p.rayTest([x, y, 0], [-x, -y, 0])  # in the middle of a side: PyBullet's 0.200019
    assert math.hypot(*side[3][:2]) == pytest.approx(0.200019, abs=2e-5)
    assert slanted[0] == -1
    (above,) = p.rayTest([0, 0, 3], [0, 0, -3])
    assert above[3][2] == pytest.approx(1.001, abs=1e-9)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.3), basePosition=[5, 0, 0])
    hit = p.rayTest([5, -1, 0], [5, 1, 0])[0]
    assert (hit[0], hit[3][1]) == (ball, pytest.approx(-0.3))


def test_flat_lists_are_no_rays(client: int) -> None:
    with pytest.raises(p.error, match="list of 3 floats"):
        p.rayTestBatch([1, 0, 0], [2, 0, 0])
    assert p.rayTestBatch([], []) == ()


def test_overlaps_reach_two_centimetres_and_start_with_the_youngest(client: int) -> None:
    _boxes(0, 1)
    assert p.getOverlappingObjects([-1, -1, -1], [2, 1, 1]) == ((1, -1), (0, -1))
    assert p.getOverlappingObjects([-1, -1, -1], [0.5, 1, 1]) == ((0, -1),)
    assert p.getOverlappingObjects([0.099, -1, -1], [0.5, 1, 1]) == ((0, -1),)  # of new bodies without more
    assert p.getOverlappingObjects([0.101, -1, -1], [0.5, 1, 1]) is None
    p.performCollisionDetection()
    assert p.getOverlappingObjects([0.119, -1, -1], [0.5, 1, 1]) == ((0, -1),)
    assert p.getOverlappingObjects([0.121, -1, -1], [0.5, 1, 1]) is None
    turned = p.getQuaternionFromEuler([0, 0, math.pi / 4])
    p.resetBasePositionAndOrientation(0, [0, 0, 0], turned)
    assert p.getOverlappingObjects([0.14, -1, -1], [0.5, 1, 1]) == ((0, -1),)


def test_overlaps_of_new_and_moving_bodies_are_those_of_the_last_step(client: int) -> None:
    """Against PyBullet, whose boxes are placed before a step moves bodies, or when a body is placed."""
    p.setGravity(0, 0, -9.81)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    moving, other = (p.createMultiBody(1, box, -1, [x, 0, 1]) for x in (0, 5))

    def reaches(height: float) -> bool:
        found = p.getOverlappingObjects([-0.01, -0.01, height], [0.01, 0.01, height])
        return found == ((moving, -1),)

    assert reaches(1.099) and not reaches(1.101)
    p.resetBaseVelocity(moving, [0, 0, 12])  # 0.05 m in a step
    assert reaches(1.119) and not reaches(1.121)
    p.stepSimulation()
    for _ in range(300):  # until machine code looks
        assert reaches(1.119) and not reaches(1.121)
    assert p.getBasePositionAndOrientation(moving)[0][2] > 1.04
    assert reaches(1.119) and not reaches(1.121)
    p.stepSimulation()
    assert reaches(1.1685) and not reaches(1.171)
    p.resetBasePositionAndOrientation(moving, [0, 0, 2], [0, 0, 0, 1])
    assert reaches(2.119) and not reaches(2.121)
    assert p.getOverlappingObjects([4.9, 0, 0.9], [5, 0, 1]) == ((other, -1),)


def test_overlaps_follow_bodies_that_come_go_and_grow(client: int) -> None:
    _boxes(0, 1)
    corners = [-1, -1, -1], [2, 1, 1]
    assert p.getOverlappingObjects(*corners) == ((1, -1), (0, -1))
    p.removeBody(0)
    assert p.getOverlappingObjects(*corners) == ((1, -1),)
    _boxes(0.5)
    assert p.getOverlappingObjects(*corners) == ((0, -1), (1, -1))
    above = [-1, -1, 0.14], [2, 1, 1]
    assert p.getOverlappingObjects(*above) is None
    corners = [[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]
    hull = p.createMultiBody(1, p.createCollisionShape(p.GEOM_MESH, vertices=corners))
    assert p.getOverlappingObjects(*above) is None
    p.changeDynamics(hull, -1, collisionMargin=0.05)
    p.performCollisionDetection()
    assert p.getOverlappingObjects(*above) == ((hull, -1),)
    p.resetSimulation()
    assert p.getOverlappingObjects(*above) is None


def _shape(kind: str) -> int:
    if kind == "box":
        return p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5] * 3)
    if kind == "sphere":
        return p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
    form = p.GEOM_CAPSULE if kind == "capsule" else p.GEOM_CYLINDER
    return p.createCollisionShape(form, radius=0.5, height=1)


@pytest.mark.parametrize(
    ("kind", "deepest", "normals"),
    [
        (
            "sphere",
            0.45,
            {0.005: (0.999, 0.02, 0.04), 0.1: (0.998, 0.025, 0.05), 0.45: (0.913, 0.183, 0.365)},
        ),
        ("capsule", 0.45, {0.005: (1.0, 0.02, 0.0), 0.1: (1.0, 0.025, 0.0), 0.45: (0.981, 0.196, 0.0)}),
        ("cylinder", 0.0005, {0.0005: (1.0, 0.019, 0.0)}),
        ("box", 0.0005, {0.0005: (1.0, 0.0, 0.0)}),
    ],
)
@pytest.mark.parametrize("together", [False, True])
def test_a_ray_that_starts_in_a_margin_and_heads_inwards_hits_at_once(
    client: int, kind: str, deepest: float, normals: dict[float, tuple[float, float, float]], together: bool
) -> None:
    """PyBullet 3.2.7's answers: the margin is all of a sphere or capsule, and 1 mm of others."""
    body = p.createMultiBody(0, _shape(kind), basePosition=[0, 0, 1], baseOrientation=[0, 0, 0.6, 0.8])
    turn = np.reshape(p.getMatrixFromQuaternion([0, 0, 0.6, 0.8]), (3, 3))
    for depth in (-0.0005, 0.0005, 0.005, 0.03, 0.1, 0.3, 0.45):
        for way in (-1, 1):
            start = turn @ [0.5 - depth, 0.01, 0.02] + [0, 0, 1]
            end = turn @ [0.5 - depth + 3 * way, 0.01, 0.02] + [0, 0, 1]
            hit = (p.rayTestBatch([start], [end]) if together else p.rayTest(start, end))[0]
            if way > 0 or depth > deepest:
                assert hit == (-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (depth, way)
                continue
            assert hit[:3] == (body, -1, 0.0), (depth, way)
            np.testing.assert_allclose(hit[3], start, atol=1e-12)
            if depth in normals:
                np.testing.assert_allclose(hit[4], turn @ normals[depth], atol=2e-3)


def test_rays_that_start_in_spheres_heed_masks_and_what_lies_behind(client: int) -> None:
    ball = p.createMultiBody(0, _shape("sphere"))
    p.setCollisionFilterGroupMask(ball, -1, 4, -1)
    wall = p.createMultiBody(0, _shape("box"), basePosition=[-2, 0, 0])
    starts, ends = [[0.2, 0, 0.0], [0.2, 0, 0], [3, 0, 0]], [[-3, 0, 0], [3, 0, 0], [-3, 0, 0]]
    assert [hit[0] for hit in p.rayTestBatch(starts, ends)] == [ball, -1, ball]
    found = p.rayTestBatch(starts, ends, collisionFilterMask=~4)
    assert [hit[0] for hit in found] == [wall, -1, wall]
    assert p.rayTest(starts[0], ends[0], collisionFilterMask=~4)[0][:3] == pytest.approx(
        (wall, -1, 1.7 / 3.2)
    )
    assert p.rayTest(starts[0], ends[0])[0][:3] == (ball, -1, 0.0)


def test_single_rays_hit_what_many_do_and_what_the_search_through_all_shapes_finds(client: int) -> None:
    rng = np.random.default_rng(5)
    boxes = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.2, 0.1])
    for kind in (p.GEOM_SPHERE, p.GEOM_CAPSULE, p.GEOM_CYLINDER):
        shape = p.createCollisionShape(kind, radius=0.2, height=0.4)
        for one in (shape, boxes):
            turn = p.getQuaternionFromEuler(rng.uniform(-3, 3, 3).tolist())
            p.createMultiBody(1, one, basePosition=rng.uniform(-0.6, 0.6, 3).tolist(), baseOrientation=turn)
    starts, ends = rng.uniform(-1, 1, (2, 300, 3)).tolist()
    many = p.rayTestBatch(starts, ends)
    for start, end, hit in zip(starts, ends, many, strict=True):
        first = p.rayTest(start, end)
        assert first == p.rayTest(start, end, collisionFilterMask=0xFFFF)
        assert first[0][:2] == hit[:2]
        assert np.hstack(first[0][2:]) == pytest.approx(np.hstack(hit[2:]))
    assert len({hit[0] for hit in many}) == 7
    missed = ((-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),)
    assert p.rayTest([0, 0, 2], [0, 0, 2]) == p.rayTest([0, 0, math.inf], [0, 0, 0]) == missed


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0, 1.0), (0.3, -0.2, 0.1, 0.8), (0.9, -0.3, 0.2, 0.1)])
def test_planes_are_met_from_both_sides(client: int, turn: tuple[float, ...]) -> None:
    """As in PyBullet: the normal is on the ray's side."""
    length = math.sqrt(sum(part * part for part in turn))
    turn = tuple(part / length for part in turn)
    place, normal = np.array([0.3, 0.2, 0.1]), np.array(p.getMatrixFromQuaternion(turn))[2::3]
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE), -1, place, turn)
    starts, ends = (
        np.array([[0.1, -0.2, 4.0], [0.4, 0.3, -4.0]]),
        np.array([[0.3, 0.1, -4.0], [0.2, 0.1, 4.0]]),
    )
    for start, end, hit in zip(starts, ends, p.rayTestBatch(starts.tolist(), ends.tolist()), strict=True):
        along = (end - start) @ normal
        fraction = (place - start) @ normal / along
        assert hit[:2] == (plane, -1)
        assert hit[2] == pytest.approx(fraction, abs=1e-12)
        assert hit[4] == pytest.approx(-np.sign(along) * normal, abs=1e-12)
        assert p.rayTest(start.tolist(), end.tolist())[0][2] == pytest.approx(fraction, abs=1e-12)


def test_rays_from_inside_a_shape_enter_the_ones_that_touch_it(client: int) -> None:
    """As recorded from PyBullet: a ray leaves a box where it enters the next one of a grid."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.025] * 3)
    for row in range(3):
        for column in range(3):
            p.createMultiBody(0, shape, basePosition=[0.05 * row, 0.05 * column, 0.5])
    ends = [[0.1 * math.sin(k * math.pi / 8), 0.1 * math.cos(k * math.pi / 8), 0.5] for k in range(6)]
    starts = [[0, 0, 0.5]] * len(ends)
    for wanted, bodies, fractions in (
        (-1, (1, 1, 1, 3, 3, 3), (0.25, 0.27059805, 0.353553391, 0.27059805, 0.25, 0.27059805)),
        (0, (2, 5, 4, 7, 6, 3), (0.75, 0.81179415, 0.3555, 0.81179415, 0.75, 0.27059805)),
        (1, (1, 4, 1, 4, 3, -1), (0.25, 0.653281482, 0.353553391, 0.653281482, 0.25, 1.0)),
    ):
        hits = p.rayTestBatch(starts, ends, reportHitNumber=wanted)
        assert tuple(hit[0] for hit in hits) == bodies
        assert [hit[2] for hit in hits] == pytest.approx(fractions, abs=3e-3 if wanted == 0 else 1e-8)


@pytest.mark.parametrize("axis", range(3))
def test_rays_in_sides_of_boxes_enter_the_lower_ones(client: int, axis: int) -> None:
    """As PyBullet decides in all but a few of them."""
    half, place = [0.07, 0.11, 0.23], [0.3, -0.4, 0.6]
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=half), basePosition=place)
    across = (axis + 1) % 3
    for side, expected in ((1, -1), (-1, 0)):
        start, end = list(place), list(place)
        start[axis] = end[axis] = place[axis] + side * half[axis]
        start[across] -= 2 * half[across]
        end[across] += 2 * half[across]
        end[3 - axis - across] += 0.3 * half[3 - axis - across]
        for wanted in (-1, 0):
            hit = p.rayTest(start, end, reportHitNumber=wanted)[0]
            assert hit[0] == expected
            assert hit[2] == pytest.approx(1.0 if side > 0 else 0.25)
