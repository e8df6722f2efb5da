"""Contacts, nearest points and friction directions, compared with figures of PyBullet 3.2.7."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.api import contact_points


def _body(kind: int, mass: float, height: float, **size: object) -> int:
    return p.createMultiBody(mass, p.createCollisionShape(kind, **size), basePosition=[0, 0, height])


def _box(mass: float, height: float) -> int:
    return _body(p.GEOM_BOX, mass, height, halfExtents=[0.1, 0.1, 0.1])


def _steps(count: int) -> None:
    for _ in range(count):
        p.stepSimulation()


def test_friction_is_what_the_first_named_body_feels(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    ground, box = _body(p.GEOM_BOX, 0, -1, halfExtents=[5, 5, 1]), _box(1, 0.1)
    p.changeDynamics(ground, -1, lateralFriction=1)
    _steps(100)
    p.resetBaseVelocity(box, [2, 1, 0])
    _steps(20)
    for pair in ((box, ground), (ground, box)):
        points = p.getContactPoints(*pair)
        assert {tuple(np.round(point[11], 6) + 0.0) for point in points} == {(0.0, 1.0, 0.0)}
        assert {tuple(np.round(point[13], 6) + 0.0) for point in points} == {(1.0, 0.0, 0.0)}
        across = sum(point[10] * np.array(point[11]) + point[12] * np.array(point[13]) for point in points)
        # drags the ground along, whichever of the two is asked for first, as PyBullet's box in this step
        assert across == pytest.approx([2.392175, 1.182546, 0], abs=1e-5)
        assert sum(point[9] for point in points) == pytest.approx(5.337013, abs=1e-5)


SHAPES = {"box": p.GEOM_BOX, "ball": p.GEOM_SPHERE, "plane": p.GEOM_PLANE}


@pytest.mark.parametrize(
    ("first", "second", "named"),
    [
        (("box", 0.1), ("ball", 0.65), (0, 1)),
        (("ball", 0.65), ("box", 0.1), (0, 1)),
        (("plane", 0.0), ("ball", 0.49), (1, 0)),
        (("ball", 0.49), ("plane", 0.0), (0, 1)),
    ],
)
def test_bullet_names_the_older_body_first_and_planes_last(
    client: int, first: tuple[str, float], second: tuple[str, float], named: tuple[int, int]
) -> None:
    for name, height in (first, second):
        size = {"halfExtents": [0.1, 0.1, 0.1]} if name == "box" else {}
        _body(SHAPES[name], float(name != "plane"), height, **size)
    p.performCollisionDetection()
    assert {point[1:3] for point in p.getContactPoints()} == {named}


def test_a_link_of_several_shapes_is_named_before_a_single_one(client: int) -> None:
    p.setGravity(0, 0, -10)
    box = _box(1, 0.1)
    shapes = p.createCollisionShapeArray(
        [p.GEOM_BOX, p.GEOM_BOX],
        halfExtents=[[1, 1, 1], [1, 1, 1]],
        collisionFramePositions=[[0, 0, -1], [2, 0, -1]],
    )
    ground = p.createMultiBody(0, shapes)
    _steps(5)
    assert {point[1:3] for point in p.getContactPoints()} == {(ground, box)}
    assert p.getContactPoints(bodyB=ground) == ()
    assert {point[1:3] for point in p.getContactPoints(bodyB=box)} == {(ground, box)}
    assert p.getContactPoints(box)[0][7] == pytest.approx((0, 0, 1), abs=1e-6)


def test_nearest_points_know_the_margin_of_hulls(client: int) -> None:
    ball = _body(p.GEOM_SPHERE, 1, 1, radius=0.1)
    corners = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    cube = _body(p.GEOM_MESH, 1, 3, vertices=corners)
    point = p.getClosestPoints(ball, cube, 5)[0]
    assert point[8] == pytest.approx(1.399, abs=1e-6)
    assert point[6][2] == pytest.approx(2.499, abs=1e-6)


def test_a_body_meets_itself(client: int) -> None:
    box = _body(p.GEOM_BOX, 1, 1, halfExtents=[0.1, 0.2, 0.3])
    (point,) = p.getClosestPoints(box, box, 1)
    assert point[1:5] == (box, box, -1, -1)
    assert point[8] == pytest.approx(-0.2, abs=1e-3)


def test_shapes_of_no_body_count_as_link_minus_two(client: int) -> None:
    box = _box(1, 0)
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    (point,) = p.getClosestPoints(
        bodyA=-1, bodyB=box, distance=5, collisionShapeA=ball, collisionShapePositionA=[0, 0, 1]
    )
    assert point[1:5] == (-1, box, -2, -1)
    assert point[8] == pytest.approx(0.8)


def test_the_normal_force_of_a_resting_ball_settles_within_three_steps(client: int) -> None:
    """Numbers of PyBullet 3.2.7: one point, 10 N from the third step on, and a distance of -10 µm."""
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.5), -1, [0, 0, 0.5])
    for step in range(1, 6):
        p.stepSimulation()
        ((*_, distance, force, _, _, _, _),) = p.getContactPoints(ball, plane)
        assert force == pytest.approx(10.0, abs=1e-4 if step >= 3 else 1.0)
        assert distance == pytest.approx(0.0, abs=3e-5)


@pytest.mark.parametrize("of_plane", [0.0, 0.003])
def test_rolling_friction_is_the_sum_of_both_bodies(client: int, of_plane: float) -> None:
    """A ball slows by c g / (1.4 r); c (m) is each body's own times the other's sliding friction."""
    radius, mu_plane, mu_ball, own = 0.1, 0.5, 0.8, 0.004
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=radius), -1, [0, 0, radius])
    p.changeDynamics(plane, -1, lateralFriction=mu_plane, rollingFriction=of_plane)
    p.changeDynamics(
        ball, -1, lateralFriction=mu_ball, rollingFriction=own, linearDamping=0, angularDamping=0
    )
    p.resetBaseVelocity(ball, [1, 0, 0], [0, 1 / radius, 0])
    for _ in range(120):
        p.stepSimulation()
    c = own * mu_plane + of_plane * mu_ball
    assert p.getBaseVelocity(ball)[0][0] == pytest.approx(1 - 0.5 * c * 10 / (1.4 * radius), abs=0.01)


@pytest.mark.parametrize("from_file", [False, True])
def test_a_body_sinks_into_a_compliant_surface_by_its_weight_over_the_stiffness(
    client: int, tmp_path: Path, from_file: bool
) -> None:
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    if from_file:
        file = tmp_path / "ball.urdf"
        file.write_text(
            '<robot name="ball"><link name="base">'
            '<contact><stiffness value="5000"/><damping value="300"/></contact><inertial><mass value="10"/>'
            '<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>'
            '<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>'
        )
        ball = p.loadURDF(str(file), [0, 0, 0.1])
    else:
        ball = _body(p.GEOM_SPHERE, 10, 0.1, radius=0.1)
        p.changeDynamics(ball, -1, contactStiffness=5000, contactDamping=300)
    _steps(480)
    assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(0.1 - 10 * 10 / 5000, abs=2e-4)
    assert p.getContactPoints(ball)[0][9] == pytest.approx(100, rel=1e-3)


@pytest.mark.parametrize("kind", ["box", "plane"])
@pytest.mark.parametrize(
    ("height", "gaps"),
    [
        (0.0113, [-1.20e-04, -1.11e-04, -1.03e-04]),
        (0.0117, [2.8e-04, -1.0e-05, -1.0e-05]),
        (0.0121, [6.8e-04, -9.1e-04, -8.38e-04]),
        (0.0125, [1.08e-03, -5.1e-04, -4.7e-04]),
    ],
)
def test_a_gap_beyond_bullets_threshold_stops_nothing(
    client: int, kind: str, height: float, gaps: list[float]
) -> None:
    """The gaps are PyBullet's: 0.4 mm under a ball of 1 cm are not a contact, 0.3 mm are."""
    p.setGravity(0, 0, -9.81)
    if kind == "box":
        _body(p.GEOM_BOX, 0, -1, halfExtents=[1, 1, 1])
    else:
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    ball = _body(p.GEOM_SPHERE, 0.1, height, radius=0.01)
    p.resetBaseVelocity(ball, [0, 0, -0.3])
    for gap in gaps:
        p.stepSimulation()
        assert p.getBasePositionAndOrientation(ball)[0][2] - 0.01 == pytest.approx(gap, abs=1.2e-5)


def test_a_convex_hull_rests_on_its_margin(client: int, tmp_path: Path) -> None:
    corners = [[x, y, z] for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]
    p.setGravity(0, 0, -10)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 1]), basePosition=[0, 0, -1])
    hull = _body(p.GEOM_MESH, 1, 0.12, vertices=corners)
    _steps(240)
    assert p.getBasePositionAndOrientation(hull)[0][2] == pytest.approx(0.101, abs=1e-4)
    assert p.getContactPoints(hull)[0][5][2] == pytest.approx(0, abs=1e-4)


def test_contacts_asked_for_once_more_are_those_of_the_present(client: int) -> None:
    p.setGravity(0, 0, -10)
    floor = p.createMultiBody(
        0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1, 1, 0.5]), -1, [0, 0, -0.5]
    )
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    balls = [p.createMultiBody(1, shape, -1, [x, 0, 0.0995]) for x in (-0.5, 0.5)]
    p.stepSimulation()
    contacts = p.getContactPoints()
    assert len(contacts) == 2
    assert tuple(row for ball in balls for row in p.getContactPoints(floor, ball)) == contacts
    p.stepSimulation()
    later = p.getContactPoints()
    assert [row[8] for row in later] != [row[8] for row in contacts]
    p.resetBasePositionAndOrientation(balls[0], [-0.5, 0, 3], [0, 0, 0, 1])
    p.performCollisionDetection()
    assert {row[1:3] for row in p.getContactPoints()} in ({(balls[1], floor)}, {(floor, balls[1])})


def test_contacts_are_listed_as_those_that_are_kept(client: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """In all ways of asking, of shapes of all kinds, older and newer than what they touch."""
    p.setGravity(0, 0, -9.81)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    pair = p.createCollisionShapeArray(
        [p.GEOM_BOX, p.GEOM_SPHERE],
        radii=[0.1, 0.1],
        halfExtents=[[0.1, 0.1, 0.1]] * 2,
        collisionFramePositions=[[0, 0, 0], [0.2, 0, 0]],
    )
    first = p.createMultiBody(1, box, basePosition=[0, 0, 0.3])
    floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    second = p.createMultiBody(1, box, basePosition=[0.03, 0.02, 0.1])
    both = p.createMultiBody(2, pair, basePosition=[0, 0.5, 0.11], baseOrientation=[0, 0, 0.1, 0.995])
    chain = p.createMultiBody(
        1,
        box,
        basePosition=[0, -0.5, 0.1],
        linkMasses=[0.5],
        linkCollisionShapeIndices=[box],
        linkVisualShapeIndices=[-1],
        linkPositions=[[0.3, 0, 0]],
        linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0],
        linkJointTypes=[p.JOINT_FIXED],
        linkJointAxis=[[0, 0, 1]],
    )
    for _ in range(20):
        p.stepSimulation()
    asked = [{}, {"linkIndexA": -1}, {"bodyA": chain, "linkIndexA": 0}, {"bodyB": second, "linkIndexB": -1}]
    asked += [{"bodyA": a} for a in (first, floor, second, both, chain)]
    asked += [{"bodyA": a, "bodyB": b} for a in (first, floor, both) for b in (second, floor, chain)]

    def listed() -> list[tuple[Any, ...]]:
        return [p.getContactPoints(**given) for given in asked]

    found = listed()
    monkeypatch.setattr(contact_points, "contacts_between", lambda *_: None)
    assert len(found[0]) > 12 and sum(map(bool, found)) > 10
    for one, other in zip(found, listed(), strict=True):
        assert [row[:5] for row in one] == [row[:5] for row in other]
        for row, kept in zip(one, other, strict=True):
            assert [type(value) for value in row] == [type(value) for value in kept]
            np.testing.assert_allclose(np.hstack(row[5:]), np.hstack(kept[5:]), atol=1e-12)
