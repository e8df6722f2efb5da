"""Errors for wrong arguments of joint, link and dynamics functions, as in PyBullet 3.2.7."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import roboyard.pybullet as p
import roboyard.pybullet_data as data


@pytest.fixture
def arm(client: int) -> int:
    p.setAdditionalSearchPath(data.getDataPath())
    return p.loadURDF("r2d2.urdf")


@pytest.fixture
def ball_joint(client: int) -> int:
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    return p.createMultiBody(
        1, ball, linkMasses=[1], linkCollisionShapeIndices=[ball], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_SPHERICAL], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip


CALLS: dict[str, Callable[[int], object]] = {
    "getJointState failed; invalid bodyUniqueId": lambda arm: p.getJointState(-1, 0),
    "getJointState failed; invalid jointIndex": lambda arm: p.getJointState(arm, -1),
    "getJointState failed (2).": lambda arm: p.getJointState(arm, 99),
    "getLinkState failed; invalid bodyUniqueId": lambda arm: p.getLinkStates(-1, [0]),
    "expected a sequence of joint indices": lambda arm: p.getJointStates(arm, 5),
    "Joint index out-of-range.": lambda arm: p.getJointStates(arm, [1, "x"]),
    "calculateInverseKinematics couldn't extract position vector3": lambda arm: p.calculateInverseKinematics(
        arm, 3, [1, 2]
    ),
    "Illegal control mode.": lambda arm: p.setJointMotorControlMultiDof(arm, 2, p.VELOCITY_CONTROL),
    "Expected an position and/or velocity list.": lambda arm: p.resetJointStateMultiDof(arm, 2, []),
}


@pytest.mark.parametrize("text", CALLS)
def test_texts(arm: int, text: str) -> None:
    with pytest.raises(p.error) as caught:
        CALLS[text](arm)
    assert str(caught.value) == text


def test_velocities_and_accelerations_go_together(arm: int) -> None:
    with pytest.raises(p.error, match="need to be equal and match the number of degrees of freedom"):
        p.calculateInverseDynamics(arm, [0.0] * 15, [0.0] * 14, [0.0] * 13)


def test_joints_that_no_jacobian_covers(ball_joint: int) -> None:
    with pytest.raises(p.error, match="Spherirical joints are not supported in the pybullet binding"):
        p.calculateJacobian(ball_joint, 0, [0, 0, 0], [0, 0, 0, 1], [0] * 3, [0] * 3)


def test_a_joint_is_put_at_a_number(arm: int) -> None:
    for wrong in (None, "x", [1.0]):
        with pytest.raises(TypeError):
            p.resetJointState(arm, 2, wrong)
        with pytest.raises(TypeError):
            p.resetJointState(arm, 2, 0.0, wrong)
    assert p.getJointState(arm, 2)[:2] == (0.0, 0.0)


def test_indices_may_be_floats(arm: int) -> None:
    assert p.getJointStates(arm, np.array([2.0, 3.0])) == p.getJointStates(arm, [2, 3])


def test_numbers_of_another_count_change_nothing(ball_joint: int) -> None:
    p.resetJointStateMultiDof(ball_joint, 0, [0.6, 0, 0, 0.8], [1, 2, 3])
    before = p.getJointStateMultiDof(ball_joint, 0)[:2]
    assert before == (pytest.approx((0.6, 0, 0, 0.8)), (1.0, 2.0, 3.0))
    p.resetJointStateMultiDof(ball_joint, 0, [1, 2], [4])
    p.resetJointStatesMultiDof(ball_joint, [0], [[1, 2]])
    assert p.getJointStateMultiDof(ball_joint, 0)[:2] == before
    p.setJointMotorControlMultiDofArray(ball_joint, [0], p.POSITION_CONTROL, [], [[0, 0, 0], [1, 1, 1]], [])
    p.resetBaseVelocity(ball_joint, [1, 2], [3, 4, 5])
    assert p.getBaseVelocity(ball_joint) == ((0.0, 0.0, 0.0), (3.0, 4.0, 5.0))


def test_an_orientation_of_another_count_is_left_free(arm: int) -> None:
    free = p.calculateInverseKinematics(arm, 3, [0.1, 0.2, 0.1])
    assert p.calculateInverseKinematics(arm, 3, [0.1, 0.2, 0.1], [0, 1]) == free
    assert p.calculateInverseKinematics(arm, 3, [0.1, 0.2, 0.1], currentPositions=[]) == free
