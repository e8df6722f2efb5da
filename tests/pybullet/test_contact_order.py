"""Contacts in the order in which PyBullet solves them; its numbers are of 3.2.7."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roboyard import pybullet as p


def _column(count: int, top: float, ground: int, step: float = 0.2) -> list[int]:
    """Return cubes 0.2 m wide on each other, of 1 kg, the last one of `top` kg."""
    p.setGravity(0, 0, -9.81)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    return [
        p.createMultiBody(top if k == count - 1 else 1, shape, basePosition=[0, 0, 0.1 + step * k])
        for k in range(count)
    ]


def _block() -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.1])
    return p.createMultiBody(0, shape, basePosition=[0, 0, -0.1])


def test_a_heavy_cube_on_a_column_sinks_as_in_pybullet(client: int) -> None:
    """In another order the lowest cube is pressed in by ten times as much, and the column falls."""
    cubes = _column(5, 100.0, _block())
    wanted = {
        0: (-0.00239, -0.04088, -0.04088, -0.04088, -0.04088),
        1: (0.0, 0.00285, 0.00044, -0.08174, -0.08174),
    }
    for step in range(600):
        p.stepSimulation()
        if step in wanted:
            speeds = [p.getBaseVelocity(cube)[0][2] for cube in cubes]
            np.testing.assert_allclose(speeds, wanted[step], atol=1.1e-5)
    heights = [p.getBasePositionAndOrientation(cube)[0][2] for cube in cubes]
    np.testing.assert_allclose(heights, [0.09965, 0.29163, 0.49124, 0.68362, 0.88308], atol=0.03)


@pytest.mark.parametrize(
    ("bodies", "wanted"),
    [
        ((2, 4), (-0.058378, -0.045249, -0.104823, -0.147396, -0.204306)),
        ((0, 1), (-0.002234, -0.101980, -0.108644, -0.150908, -0.212038)),
    ],
)
def test_bodies_that_get_a_filter_lose_their_points_as_in_pybullet(
    client: int, bodies: tuple[int, int], wanted: tuple[float, ...]
) -> None:
    """Their pairs end and come back behind the others, with one point each."""
    cubes = _column(5, 100.0, _block())
    for step in range(12):
        if step == 6:
            p.setCollisionFilterPair(*bodies, -1, -1, 1)
        p.stepSimulation()
    speeds = [p.getBaseVelocity(cube)[0][2] for cube in cubes]
    np.testing.assert_allclose(speeds, wanted, atol=2e-5)


def test_the_last_of_very_many_filters_decide_the_order_of_contacts(client: int) -> None:
    """Programs set the filters of all pairs of links in loops; the order is PyBullet's, as recorded."""
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    boxes = [p.createMultiBody(1, shape, -1, [0.5 * k, 0, 0.1]) for k in range(4)]
    for _ in range(3):
        p.stepSimulation()
    for count, order in ((40, [1, 4, 2, 3]), (600, [1, 4, 2, 3]), (1501, [3, 4, 1, 2]), (2502, [4, 3, 2, 1])):
        for k in range(count):
            p.setCollisionFilterPair(plane, boxes[(k * k // 7 + 3 * k + count) % 4], -1, -1, 1)
        p.stepSimulation()
        assert list(dict.fromkeys(row[1] for row in p.getContactPoints())) == order


def test_a_cube_on_a_plane_has_its_corners_one_by_one(client: int) -> None:
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05] * 3)
    cube = p.createMultiBody(1, shape, basePosition=[0, 0, 0.05])
    wanted = [
        (0.0498735, [(0.05, 0.0, 2.7153)]),
        (0.0498831, [(-0.0499501, -0.0002428, 10.5249), (0.0500498, -0.00001, 7.3108)]),
        (0.0498920, [(-0.04995, -0.0002234, 4.9679), (0.0500499, -0.0000102, 4.9905)]),
    ]
    for height, points in wanted:
        p.stepSimulation()
        assert p.getBasePositionAndOrientation(cube)[0][2] == pytest.approx(height, abs=1e-7)
        found = sorted((point[5][0], point[8], point[9]) for point in p.getContactPoints())
        np.testing.assert_allclose(found, points, rtol=5e-4, atol=1e-7)


def test_a_sliding_box_is_carried_by_one_corner_at_a_time(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.05])
    box = p.createMultiBody(40, shape, basePosition=[0, 0, 0.05])
    for body, friction in ((plane, 1.0), (box, 0.5)):
        p.changeDynamics(body, -1, lateralFriction=friction, linearDamping=0, angularDamping=0)
    for _ in range(120):
        p.stepSimulation()
    p.resetBaseVelocity(box, [2, 0, 0])
    wanted = {1: (0.049854, 1.975325), 11: (0.046622, 1.786650), 23: (0.044711, 1.510975)}
    for step in range(24):
        p.stepSimulation()
        if step in wanted:
            height = p.getBasePositionAndOrientation(box)[0][2]
            speed = np.linalg.norm(p.getBaseVelocity(box)[0])
            np.testing.assert_allclose((height, speed), wanted[step], atol=2e-6)


def test_a_column_follows_pybullet_for_sixty_steps(client: int) -> None:
    """Four cubes beside each other by some millimetres, turned, with gaps of half a millimetre.

    Those of a column without an offset have points of which one is as useful as another, but for rounding.
    """
    p.setGravity(0, 0, -9.81)
    _block()
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    cubes = [
        p.createMultiBody(
            20.0 if k == 3 else 1.0,
            shape,
            basePosition=[0.003 * k, -0.005 * k + 0.002 * k * k, 0.1 + 0.2005 * k],
            baseOrientation=p.getQuaternionFromEuler([0, 0, 0.1 * k]),
        )
        for k in range(4)
    ]
    wanted = {
        20: [
            [-3.8e-05, -8.5e-05, 0.099425],
            [0.002882, -0.003179, 0.29931],
            [0.005975, -0.001926, 0.49825],
            [0.00919, 0.00355, 0.698172],
        ],
        59: [
            [2.78e-05, 8.65e-05, 0.0993335],
            [0.0030501, -0.0026926, 0.2992276],
            [0.0063372, -0.0009934, 0.4979802],
            [0.0098939, 0.0050397, 0.6979038],
        ],
    }
    for step in range(60):
        p.stepSimulation()
        if step in wanted:
            places = [p.getBasePositionAndOrientation(cube)[0] for cube in cubes]
            np.testing.assert_allclose(places, wanted[step], atol=2e-6)


def test_contacts_beside_a_constraint_come_in_the_order_of_pybullet(client: int) -> None:
    """MuJoCo makes the rows of such a world, of which the contacts have the same order as of any other."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    row = [p.createMultiBody(1, box, -1, [0.3 * k, 0.02 * k, 0.11]) for k in range(3)]
    top = p.createMultiBody(0.5, box, -1, [0.02, 0, 0.32])
    p.createConstraint(row[2], -1, row[1], -1, p.JOINT_FIXED, [0, 0, 0], [0.15, 0, 0], [-0.15, 0, 0])
    for _ in range(60):
        p.stepSimulation()
    for _ in range(3):  # by Python, then by machine code
        found = p.getContactPoints()
        assert [row[1:5] for row in found] == [(1, 0, -1, -1)] * 3 + [(1, 4, -1, -1)] * 3
        places = [
            *((0.1005, 0.1004, 0.0), (-0.0995, -0.0996, 0.0), (0.1005, -0.0996, 0.0)),
            *((-0.079, 0.1004, 0.2), (0.1005, 0.1004, 0.2), (0.1005, -0.0995, 0.2)),
        ]
        np.testing.assert_allclose([row[5] for row in found], places, atol=2e-4)
        forces = [7.5272, 6.9841, 0.4695, 2.2109, 0.2963, 2.4808]
        np.testing.assert_allclose([row[9] for row in found], forces, atol=0.02)
        assert p.getContactPoints(top, row[0])[0][9] == found[3][9]
        assert p.getContactPoints(row[1], 0) == ()


PLAIN = """
import roboyard.pybullet as p
p.connect(p.DIRECT)
p.setGravity(0, 0, -9.81)
shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
p.createMultiBody(0, shape, basePosition=[0, 0, -0.1])
cube = p.createMultiBody(1, shape, basePosition=[0.02, 0.01, 0.1])
other = p.createMultiBody(1, shape, basePosition=[0.03, 0.0, 0.3])
for _ in range(3):
    p.stepSimulation()
print(*p.getBasePositionAndOrientation(cube)[0], *p.getBasePositionAndOrientation(other)[0])
"""


def test_a_column_stands_without_compiled_code() -> None:
    """Numbers that wrap around in compiled code are too large for NumPy's in plain Python."""
    places = [
        subprocess.run(
            [sys.executable, "-c", PLAIN],
            env={**os.environ, "NUMBA_DISABLE_JIT": off},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for off in ("0", "1")
    ]
    np.testing.assert_allclose(*np.array(places, dtype=float), atol=1e-9)


@pytest.mark.parametrize(
    ("sorts", "links", "speeds", "forces"),
    [
        (
            0,
            [0, 1, 2, 3, -1, -1, -1, -1],
            [9.3406e-05, -0.000209475, -0.000837892, 0.000753329, 0.000305086, -9.6484e-05],
            [11.268916, 14.88436, 15.314173, 7.602003, 2.928821, 2.003588, 3.166958, 1.724722],
        ),
        (
            1,
            [-1, -1, -1, -1, 3, 2, 1, 0],
            [0.000100108, -0.000342298, -0.000851552, 0.001586827, 0.00062559, 0.000201161],
            [2.914305, 2.014595, 3.148322, 1.744107, 7.605888, 15.308964, 14.891928, 11.260633],
        ),
    ],
)
def test_pairs_are_sorted_by_the_order_in_which_links_were_made_where_asked(
    client: int, sorts: int, links: list[int], speeds: list[float], forces: list[float]
) -> None:
    """Contacts of new pairs are listed from the last link on, and solved from the first; 3 rounds show it."""
    p.setGravity(0, 0, -9.8)
    p.setPhysicsEngineParameter(numSolverIterations=3, deterministicOverlappingPairs=sorts)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    foot = p.createCollisionShape(p.GEOM_SPHERE, radius=0.05)
    robot = p.createMultiBody(
        2,
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.2, 0.05]),
        basePosition=[0, 0, 0.256],
        linkMasses=[0.5] * 4,
        linkCollisionShapeIndices=[foot] * 4,
        linkVisualShapeIndices=[-1] * 4,
        linkPositions=[[0.3, 0.2, -0.2], [0.3, -0.2, -0.204], [-0.3, 0.2, -0.198], [-0.3, -0.2, -0.2]],
        linkOrientations=[[0, 0, 0, 1]] * 4,
        linkInertialFramePositions=[[0, 0, 0]] * 4,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 4,
        linkParentIndices=[0] * 4,
        linkJointTypes=[p.JOINT_PRISMATIC] * 4,
        linkJointAxis=[[0, 0, 1]] * 4,
    )
    load = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    p.createMultiBody(1, load, basePosition=[0.1, 0.05, 0.4055])
    for joint in range(4):
        p.setJointMotorControl2(robot, joint, p.POSITION_CONTROL, targetPosition=0, force=500)
    for _ in range(20):
        p.stepSimulation()
    found = p.getContactPoints()
    assert [contact[3] for contact in found] == links
    np.testing.assert_allclose([c[9] for c in found], forces, rtol=1e-5)
    np.testing.assert_allclose(np.ravel(p.getBaseVelocity(robot)), speeds, atol=1e-8)


def test_the_link_that_got_a_filter_last_is_listed_second(client: int) -> None:
    """Of two shapes of a kind; before, that of the body which was made last."""
    p.setGravity(0, 0, -9.8)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    for k in range(2):
        p.createMultiBody(k, ball, basePosition=[0.05 * k, 0, 0.19 * k])
    found = []
    for step in range(4):
        if step == 2:
            p.setCollisionFilterPair(1, 0, -1, -1, 1)
        p.stepSimulation()
        (contact,) = p.getContactPoints()
        found.append((contact[1:3], contact[5], contact[7], contact[9]))
    recorded = [
        ((0, 1), (0.025449, 0.0, 0.096707), (-0.254493, 0.0, -0.967075), 25.7029),
        ((0, 1), (0.025465, 0.0, 0.096703), (-0.254645, 0.0, -0.967035), 8.18149),
        ((1, 0), (0.024733, 0.0, 0.093804), (0.254949, 0.0, 0.966955), 8.28344),
        ((1, 0), (0.024838, 0.0, 0.094023), (0.255403, 0.0, 0.966835), 8.37614),
    ]
    for (bodies, point, normal, force), (pair, place, way, push) in zip(found, recorded, strict=True):
        assert bodies == pair
        np.testing.assert_allclose([*point, *normal], [*place, *way], atol=1e-6)
        assert force == pytest.approx(push, rel=1e-5)


def test_parts_of_a_compound_are_taken_as_its_tree_has_them(client: int) -> None:
    """Five spheres of one body touch the ground at once; three rounds show the order."""
    p.setGravity(0, 0, -9.8)
    p.setPhysicsEngineParameter(numSolverIterations=3)
    ground = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 1])
    p.createMultiBody(0, ground, basePosition=[0, 0, -1])
    places = [[-0.3, 0, 0], [0.3, 0.1, 0], [0, 0.3, 0.001], [0.05, -0.3, -0.001], [0.1, 0, 0.002]]
    shape = p.createCollisionShapeArray([p.GEOM_SPHERE] * 5, radii=[0.1] * 5, collisionFramePositions=places)
    body = p.createMultiBody(1, shape, -1, [0, 0, 0.098], baseInertialFramePosition=[0.05, 0.02, 0.1])
    for _ in range(3):
        p.stepSimulation()
    found = p.getContactPoints()
    touched = [(-1e-5, 0.30004), (0.04999, -0.29996), (-0.30001, 4e-5), (0.29999, 0.10004)]
    np.testing.assert_allclose([c[5][:2] for c in found], touched, atol=1e-5)
    np.testing.assert_allclose([c[9] for c in found], [0.0, 0.85095, 3.37039, 4.78833], atol=2e-5)
    speeds = [-0.00201404, 0.00952742, 0.03371251, -0.04742915, -0.00988759, 8.705e-05]
    np.testing.assert_allclose(np.ravel(p.getBaseVelocity(body)), speeds, atol=2e-8)


def test_corners_of_a_box_in_a_compound_come_in_its_order(client: int) -> None:
    """Its face is the first of the two that are as deep as each other, since compounds come first."""
    p.setGravity(0, 0, -9.81)
    block = p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 0.5])
    p.createMultiBody(0, block, -1, [0, 0, -0.5], [0, 0, 0.198669, 0.980067])
    brick = p.createCollisionShape(
        p.GEOM_BOX, halfExtents=[0.2, 0.1, 0.15], collisionFramePosition=[0.01, 0, 0]
    )
    body = p.createMultiBody(1, brick, -1, [0.1, -0.2, 0.1], [0, 0, 0.5, 0.866025])
    p.stepSimulation()
    found = p.getContactPoints()
    corners = [(0.1184, 0.03187), (0.2916, -0.06813), (0.0916, -0.41454), (-0.0816, -0.31454)]
    np.testing.assert_allclose([c[5][:2] for c in found], corners, atol=1e-5)
    np.testing.assert_allclose([c[9] for c in found], [88.1018, 25.9695, 94.1362, 31.954], atol=1e-3)
    speeds = [-5.59e-05, 6.504e-05, 0.95979814, -0.00060206, -0.00057598, -0.0001886]
    np.testing.assert_allclose(np.ravel(p.getBaseVelocity(body)), speeds, atol=2e-8)


@pytest.mark.parametrize("depth", [10.0, 1.0, 0.3])
def test_boxes_that_touch_what_they_stand_on_exactly_are_paired_when_they_are_loaded(
    client: int, tmp_path: Path, depth: float
) -> None:
    """As in PyBullet 3.2.7, whose boxes around shapes touch to the last bit there: the first one is first."""

    def loaded(size: str, place: str, mass: float, position: list[float]) -> int:
        shape = f'<origin xyz="0 0 {place}"/><geometry><box size="{size}"/></geometry>'
        inertial = f'<inertial><mass value="{mass}"/>'
        inertial += '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        file = tmp_path / f"{mass}.urdf"
        file.write_text(
            f'<robot name="b"><link name="l">{inertial}<collision>{shape}</collision></link></robot>'
        )
        return p.loadURDF(str(file), position)

    p.setGravity(0, 0, -9.8)
    p.setTimeStep(1 / 480)
    loaded(f"30 30 {depth}", f"{-depth / 2}", 0, [0, 0, -0.001])
    for number in range(6):
        loaded("0.04 0.04 0.04", "0", 0.1, [0.3 * (number * 5 % 7), 0.2 * (number * 3 % 4), 0.02])
    for _ in range(12):
        p.stepSimulation()
    pairs = list(dict.fromkeys(point[1:3] for point in p.getContactPoints()))
    assert pairs == [(0, number) for number in range(1, 7)]
