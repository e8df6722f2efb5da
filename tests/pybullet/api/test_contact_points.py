"""Contacts and closest points, compared with PyBullet 3.2.7 and with geometry and statics."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p


def sphere(p: Any, at: Any, radius: float = 0.2, mass: float = 1.0) -> int:
    return p.createMultiBody(mass, p.createCollisionShape(p.GEOM_SPHERE, radius=radius), basePosition=at)


def box(p: Any, at: Any, half: Any = (0.2, 0.2, 0.2), mass: float = 1.0, turn: Any = (0, 0, 0, 1)) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half)
    return p.createMultiBody(mass, shape, basePosition=at, baseOrientation=turn)


def record_closest_points_of_spheres(p: Any, folder: Path) -> Any:
    a, b = sphere(p, [0, 0, 0]), sphere(p, [1, 0, 0], 0.3)
    inside = sphere(p, [0.1, 0.2, 0.2], 0.15)
    return [
        p.getClosestPoints(a, b, 2.0),
        p.getClosestPoints(b, a, 2.0),
        p.getClosestPoints(a, b, 0.1),
        p.getClosestPoints(a, inside, 0.1),
        p.getClosestPoints(a, 9, 1.0),
    ]


def record_closest_points_of_a_box_and_a_sphere(p: Any, folder: Path) -> Any:
    a, b = box(p, [0, 0, 0]), sphere(p, [1, 0.1, 0.05])
    return [[row[1:5], row[5], row[6], row[7], row[8]] for row in p.getClosestPoints(a, b, 2.0)]


def record_no_contacts(p: Any, folder: Path) -> Any:
    a = sphere(p, [0, 0, 0])
    sphere(p, [1, 0, 0])
    p.performCollisionDetection()
    return [p.getContactPoints(), p.getContactPoints(a), p.getContactPoints(9)]


def record_a_resting_sphere(p: Any, folder: Path) -> Any:
    """Flag, bodies, links, and the normal; positions and forces are compared below."""
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    sphere(p, [0, 0, 0.2])
    for _ in range(20):
        p.stepSimulation()
    return [[list(row[:5]), row[7]] for row in p.getContactPoints()]


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_closest_points_of_spheres, 1e-5),
        (record_closest_points_of_a_box_and_a_sphere, 1e-5),
        (record_no_contacts, 0),
        (record_a_resting_sphere, 1e-5),
    ],
)
def test_points_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


@pytest.mark.parametrize("offset", [(1.0, 0, 0), (0.3, 0.4, 0), (0.6, -0.6, 0.6), (0.25, 0.1, 0.1)])
def test_spheres_are_nearest_on_the_line_of_their_centres(client: int, offset: Any) -> None:
    a, b = sphere(p, [0, 0, 0], 0.2), sphere(p, offset, 0.1)
    length = sqrt(sum(value * value for value in offset))
    ((_, first, second, _, _, on_a, on_b, normal, distance, *forces),) = p.getClosestPoints(a, b, 5.0)
    assert (first, second) == (a, b)
    assert distance == pytest.approx(length - 0.3, abs=1e-6)
    assert on_a == pytest.approx([0.2 * value / length for value in offset], abs=1e-6)
    assert on_b == pytest.approx([value * (1 - 0.1 / length) for value in offset], abs=1e-6)
    assert normal == pytest.approx([-value / length for value in offset], abs=1e-6)
    assert forces[0] == 0.0


@pytest.mark.parametrize("mass", [0.5, 1.0, 20.0])
def test_the_forces_of_a_resting_box_carry_its_weight(client: int, mass: float) -> None:
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    body = box(p, [0, 0, 0.2], mass=mass)
    for _ in range(60):
        p.stepSimulation()
    rows = p.getContactPoints(body, plane)
    assert sum(row[9] for row in rows) == pytest.approx(10 * mass, rel=1e-3)
    found = sorted((*row[5], row[8], row[9] / mass) for row in rows)
    wanted = [(-0.19994, -0.19994, -1e-5, -9e-6, 5.0), (0.20006, 0.20006, -1e-5, -1.3e-5, 5.0)]
    np.testing.assert_allclose(found, wanted, atol=1e-5, rtol=2e-5)  # as with PyBullet 3.2.7
    assert all(row[7] == pytest.approx((0, 0, 1)) for row in rows)


def test_friction_opposes_a_push(client: int) -> None:
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    body = box(p, [0, 0, 0.2])
    for body_id in (plane, body):
        p.changeDynamics(body_id, -1, lateralFriction=1.0)
    for _ in range(60):
        p.applyExternalForce(body, -1, [3, 0, 0], p.getBasePositionAndOrientation(body)[0], p.WORLD_FRAME)
        p.stepSimulation()
    total = np.zeros(3)
    for row in p.getContactPoints(body, plane):
        total += row[10] * np.array(row[11]) + row[12] * np.array(row[13])
    assert abs(total[0]) == pytest.approx(3, rel=0.02)
    assert abs(total[1]) < 0.05


def test_arguments_select_bodies_and_swap_sides(client: int) -> None:
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    first, second = sphere(p, [0, 0, 0.2]), sphere(p, [2, 0, 0.2])
    for _ in range(10):
        p.stepSimulation()
    assert len(p.getContactPoints()) == 2
    assert [row[1:3] for row in p.getContactPoints(first)] == [(first, plane)]
    assert [row[1:3] for row in p.getContactPoints(plane, second)] == [(plane, second)]
    assert p.getContactPoints(first, second) == ()
    assert p.getContactPoints(first, linkIndexA=3) == ()
    up, down = p.getContactPoints(first)[0][7], p.getContactPoints(plane, first)[0][7]
    assert up == pytest.approx([-value for value in down])


def test_shapes_without_bodies_have_distances(client: int) -> None:
    a = p.createCollisionShape(p.GEOM_SPHERE, radius=0.2)
    b = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    for gap in (0.5, 0.1, 0.02):
        (row,) = p.getClosestPoints(
            -1, -1, 2.0, collisionShapeA=a, collisionShapeB=b, collisionShapePositionA=[0, 0, 0],
            collisionShapePositionB=[0.3 + gap, 0, 0],
        )  # fmt: skip
        assert row[8] == pytest.approx(gap, abs=1e-6)
    with pytest.raises(p.error, match="Couldn't get closest points") as caught:
        p.getClosestPoints(-1, -1, 1.0, collisionShapeA=a, collisionShapeB=99)
    assert "99" in caught.value.__notes__[0]


def test_a_shape_and_a_body_have_a_distance(client: int) -> None:
    body = sphere(p, [0, 0, 0])
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    (row,) = p.getClosestPoints(
        body,
        -1,
        2.0,
        collisionShapeB=shape,
        collisionShapePositionB=[0, 1, 0],
        collisionShapeOrientationB=[0, 0, 0, 1],
    )
    assert row[1:5] == (body, -1, -1, -2)
    assert row[8] == pytest.approx(0.7, abs=1e-6)
    assert p.getNumBodies() == 1, "the shape is not left in the world"


def test_shapes_that_are_used_again_follow_bodies_and_poses(client: int) -> None:
    """The distance of a sphere to a face of a box, in a closed form, however often a program asks for it."""
    box_shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    body = p.createMultiBody(
        1, box_shape, -1, [0, 0, 1], linkMasses=[1], linkCollisionShapeIndices=[box_shape],
        linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 2]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_PRISMATIC], linkJointAxis=[[1, 0, 0]],
    )  # fmt: skip
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    shape: dict[str, Any] = {}
    for turn in range(12):
        x = 0.01 * turn
        p.resetBasePositionAndOrientation(body, [x, 0, 1], [0, 0, 0, 1])
        p.resetJointState(body, 0, -2 * x)
        shape = {"collisionShapeB": ball, "collisionShapePositionB": [1 + 2 * x, 0, 1]}
        (row,) = p.getClosestPoints(body, -1, 1.0, **shape)
        assert row[1:5] == (body, -1, -1, -2)
        assert row[8] == pytest.approx(0.8 + x, abs=1e-9)
        np.testing.assert_allclose(row[5] + row[6], [x + 0.1, 0, 1, 0.9 + 2 * x, 0, 1], atol=1e-9)
        (row,) = p.getClosestPoints(
            -1, body, 2.0, linkIndexB=0, collisionShapeA=ball, collisionShapePositionA=[-x, 0.5 + x, 3],
            collisionShapeOrientationA=[0, 0, 0, 2],
        )  # fmt: skip
        assert row[1:5] == (-1, body, -2, 0)
        assert row[8] == pytest.approx(0.2 + x, abs=1e-9)
        assert p.getClosestPoints(body, -1, 0.7, **shape) == ()
        assert {row[3] for row in p.getClosestPoints(body, -1, 9.0, **shape)} == {-1, 0}
        (row,) = p.getClosestPoints(-1, -1, 5.0, collisionShapeA=ball, **shape)
        assert row[8] == pytest.approx(float(np.hypot(1 + 2 * x, 1)) - 0.2, abs=1e-9)
    p.removeBody(body)
    assert p.getClosestPoints(body, -1, 1.0, **shape) == ()
    assert p.createMultiBody(0, ball, -1, [0, 0, 1]) == body
    p.removeCollisionShape(ball)
    with pytest.raises(p.error, match="Couldn't get closest points"):
        p.getClosestPoints(body, -1, 1.0, **shape)
    box_shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.3, 0.3, 0.3])
    for _ in range(6):
        (row,) = p.getClosestPoints(
            body, -1, 1.0, collisionShapeB=box_shape, collisionShapePositionB=[1, 0, 1]
        )
        assert row[8] == pytest.approx(0.6, abs=1e-9)


def test_collision_detection_needs_no_step(client: int) -> None:
    a, b = sphere(p, [0, 0, 0]), sphere(p, [0.3, 0, 0])
    assert p.getContactPoints() == ()
    p.performCollisionDetection()
    ((*_, distance, force, _, _, _, _),) = p.getContactPoints(a, b)
    assert distance == pytest.approx(-0.1, abs=1e-6)
    assert force >= 0.0


@pytest.mark.parametrize("enabled", [0, 1])
def test_filtered_pairs_do_not_touch(client: int, enabled: int) -> None:
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    body = sphere(p, [0, 0, 0.2])
    p.setCollisionFilterPair(plane, body, -1, -1, enabled)
    for _ in range(60):
        p.stepSimulation()
    assert bool(p.getContactPoints(body)) == bool(enabled)
    assert (p.getBasePositionAndOrientation(body)[0][2] > 0.15) == bool(enabled)


@pytest.mark.parametrize(
    ("groups", "touches"),
    [
        (((1, 1), (1, 1)), True),
        (((1, 2), (2, 1)), True),
        (((1, 2), (2, 4)), True),
        (((1, 2), (4, 8)), False),
        (((4, -1), (8, -1)), True),
        (((0, 0), (1, -1)), False),
    ],
)
def test_groups_and_masks(client: int, groups: Any, touches: bool) -> None:
    bodies = sphere(p, [0, 0, 0]), sphere(p, [0.3, 0, 0])
    for body, (group, mask) in zip(bodies, groups, strict=True):
        p.setCollisionFilterGroupMask(body, -1, group, mask)
    p.performCollisionDetection()
    assert bool(p.getContactPoints()) == touches


def record_points_across_a_gap(p: Any, folder: Path) -> Any:
    """A ball that bounces: PyBullet keeps the point while the gap is below 0.02 of the ball's reach."""
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 1]), -1, [0, 0, -1])
    found = []
    for radius, gap in ((0.1, 0.0015), (0.1, 0.0036), (0.02, 0.0005), (0.02, 0.0009)):
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=radius)
        ball = p.createMultiBody(1.0, shape, -1, [0, 0, radius + gap])
        p.performCollisionDetection()
        found.append([[point[8], point[9]] for point in p.getContactPoints(ball)])
        p.removeBody(ball)
    return found


def test_points_across_a_gap(agrees: Callable[..., None]) -> None:
    agrees(record_points_across_a_gap, 1e-5)
