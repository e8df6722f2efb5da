"""Fixed bases that have a velocity, compared with PyBullet 3.2.7."""

from __future__ import annotations

import pytest

import roboyard.pybullet as p

UPRIGHT = (0, 0, 0, 1)


def _box(mass: float, half: list[float], place: list[float]) -> int:
    return p.createMultiBody(mass, p.createCollisionShape(p.GEOM_BOX, halfExtents=half), -1, place)


def _step(count: int) -> None:
    for _ in range(count):
        p.stepSimulation()


def test_a_belt_takes_along_what_lies_on_it(client: int) -> None:
    p.setGravity(0, 0, -9.8)
    belt, parcel = _box(0, [1, 1, 0.1], [0, 0, 0]), _box(1, [0.1, 0.1, 0.1], [0, 0, 0.2])
    p.resetBaseVelocity(belt, [0.5, 0, 0], [0, 0, 0.3])
    _step(100)
    place, turn = p.getBasePositionAndOrientation(belt)
    assert place == pytest.approx((0.208, 0, 0), abs=0.02)
    assert turn == pytest.approx((0, 0, 0.0625, 0.998), abs=1e-3)
    linear, angular = p.getBaseVelocity(belt)
    assert linear == pytest.approx((0.5, 0, 0), abs=0.07)
    assert angular == pytest.approx((0, 0, 0.3), abs=1e-5)
    assert p.getBasePositionAndOrientation(parcel)[0] == pytest.approx((0.158, 0.0, 0.2), abs=0.012)
    assert p.getBaseVelocity(parcel)[0] == pytest.approx((0.5, 0.0, 0.0), abs=0.06)
    assert p.getDynamicsInfo(belt, -1)[0] == 0.0


def test_fixed_objects_do_not_stop_it(client: int) -> None:
    p.setGravity(0, 0, -9.8)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    _box(0, [0.1, 1, 0.5], [0.6, 0, 0.5])
    obstacle = _box(0, [0.2, 0.2, 0.2], [0, 0, 0.2])
    p.resetBaseVelocity(obstacle, [0.8, 0, 0])
    _step(60)
    _box(0, [0.1, 1, 0.5], [0.3, 0, 0.5])  # created where it is already
    _step(60)
    assert p.getBasePositionAndOrientation(obstacle)[0] == pytest.approx((0.4, 0, 0.2), abs=1e-3)
    assert p.getBaseVelocity(obstacle)[0] == pytest.approx((0.8, 0, 0), abs=1e-3)
    p.resetBaseVelocity(obstacle, [0, 0, 0])
    p.resetBasePositionAndOrientation(obstacle, [0, 0, 1], UPRIGHT)
    _step(20)
    assert p.getBasePositionAndOrientation(obstacle)[0] == pytest.approx((0, 0, 1)), "it does not fall"


def test_it_pushes_what_is_in_its_way(client: int) -> None:
    p.setGravity(0, 0, -9.8)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    obstacle, pushed = _box(0, [0.2, 0.2, 0.2], [0, 0, 0.2]), _box(0.5, [0.1] * 3, [0.31, 0, 0.1])
    p.resetBaseVelocity(obstacle, [0.8, 0, 0])
    _step(20)
    assert p.getBasePositionAndOrientation(pushed)[0][0] == pytest.approx(0.3673, abs=2e-3)


def test_a_robot_rides_on_its_moving_base(client: int) -> None:
    body = p.createMultiBody(
        0, -1, linkMasses=[1], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[UPRIGHT], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[UPRIGHT], linkParentIndices=[0], linkJointTypes=[p.JOINT_FIXED],
        linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    p.resetBaseVelocity(body, [0, 0, 0])
    _step(3)
    assert p.getBasePositionAndOrientation(body)[0] == (0, 0, 0)
    p.resetBaseVelocity(body, [0, 0.5, 0])
    _step(48)
    assert p.getLinkState(body, 0, computeForwardKinematics=1)[4] == pytest.approx((0, 0.1, 1), abs=1e-4)


def test_dynamics_of_a_fixed_base_that_moves_stay_those_of_its_joints(client: int) -> None:
    """As many rows as joints, not six more: the arm is one that was loaded with a fixed base."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    arm = p.createMultiBody(
        0, shape, linkMasses=[1, 2], linkCollisionShapeIndices=[shape] * 2, linkVisualShapeIndices=[-1] * 2,
        linkPositions=[[0, 0, 0.3]] * 2, linkOrientations=[UPRIGHT] * 2,
        linkInertialFramePositions=[[0, 0, 0.1]] * 2, linkInertialFrameOrientations=[UPRIGHT] * 2,
        linkParentIndices=[0, 1], linkJointTypes=[p.JOINT_REVOLUTE] * 2, linkJointAxis=[[1, 0, 0]] * 2,
    )  # fmt: skip
    p.setGravity(0, 0, -9.8)
    angles = [0.3, -0.5]

    def read() -> list[float]:
        efforts = p.calculateInverseDynamics(arm, angles, [0.1, 0.2], [1.0, -1.0])
        matrix = p.calculateMassMatrix(arm, angles)
        linear, angular = p.calculateJacobian(arm, 1, [0, 0, 0], angles, [0, 0], [0, 0])
        return [x for row in (efforts, *matrix, *linear, *angular) for x in row]

    before = read()
    p.resetBaseVelocity(arm, [0.1, 0, 0])
    p.stepSimulation()
    assert read() == pytest.approx(before, abs=1e-9)
    assert len(before) == 2 + 2 * 2 + 2 * 3 * 2
