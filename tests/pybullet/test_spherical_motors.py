"""Motors of spherical joints; all figures are real PyBullet 3.2.7's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

TURNED = [0.2, 0.3, 0.1, 0.9274]


@pytest.fixture
def rod(client: int) -> int:
    shape = p.createCollisionShape(p.GEOM_CAPSULE, radius=0.05, height=0.3)
    return p.createMultiBody(
        0, -1, -1, [0, 0, 3], linkMasses=[1], linkCollisionShapeIndices=[shape], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, -0.25]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_SPHERICAL], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("start", "command", "velocity"),
    [
        (TURNED, None, [-3.8187, -6.1345, -0.7839]),
        (TURNED, {}, [-3.8187, -6.1345, -0.7839]),
        (TURNED, {"targetVelocity": [0, 0, 0]}, [-1.9093, -3.0672, -0.392]),
        (TURNED, {"targetVelocity": [1, 0, 0], "positionGain": 0.5}, [-9.5467, -15.3361, -1.9599]),
        (TURNED, {"targetPosition": [0, 1, 0, 0]}, [-13.1703, 3.0672, 14.6877]),
        (TURNED, {"targetPosition": [1, 2], "positionGain": 0.5}, [-3.8187, -6.1345, -0.7839]),
        ([0, 0, 0, 1], {"targetPosition": TURNED}, [2.5311, 2.6047, 1.7507]),
        ([0, 0, 0, 1], {"targetPosition": TURNED, "positionGain": 0.5}, [12.6557, 13.0235, 8.7536]),
        ([0, 0, 0, 1], {"targetPosition": TURNED, "velocityGain": 0.1}, [2.5311, 2.6047, 1.7507]),
        (
            [0, 0, 0, 1],
            {"targetPosition": TURNED, "positionGain": 1, "force": [1, 2]},
            [25.3114, 26.047, 17.507],
        ),
    ],
)
def test_velocity_after_a_step(
    rod: int, start: list[float], command: dict[str, Any] | None, velocity: list[float]
) -> None:
    p.resetJointStateMultiDof(rod, 0, start, [0, 0, 0])
    if command is not None:
        p.setJointMotorControlMultiDof(rod, 0, p.POSITION_CONTROL, **command)
    p.stepSimulation()
    np.testing.assert_allclose(p.getJointStateMultiDof(rod, 0)[1], velocity, rtol=2e-3, atol=1e-3)


@pytest.mark.parametrize(("damping", "velocity"), [(0.0, 3.5552), (0.5, 3.0432), (1.0, 2.5311), (2.0, 1.507)])
def test_damping_takes_velocity_away(rod: int, damping: float, velocity: float) -> None:
    p.resetJointStateMultiDof(rod, 0, [0, 0, 0, 1], [1, 2, 3])
    p.setJointMotorControlMultiDof(rod, 0, p.POSITION_CONTROL, targetPosition=TURNED, damping=damping)
    p.stepSimulation()
    assert p.getJointStateMultiDof(rod, 0)[1][0] == pytest.approx(velocity, abs=0.03)


def test_one_force_bounds_all_three(rod: int) -> None:
    p.resetJointStateMultiDof(rod, 0, [0, 0, 0, 1], [1, 2, 3])
    p.setJointMotorControlMultiDof(
        rod, 0, p.POSITION_CONTROL, targetPosition=TURNED, positionGain=1, force=[1]
    )
    p.stepSimulation()
    np.testing.assert_allclose(p.getJointStateMultiDof(rod, 0)[1], [1.0784, 2.0414, 5.4976], atol=1e-3)
    np.testing.assert_allclose(p.getJointStateMultiDof(rod, 0)[3], [1, 1, 1], rtol=1e-3)


def test_a_point_of_the_jacobian_lies_along_the_inertial_axes(client: int) -> None:
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    body = p.createMultiBody(
        0, box, linkMasses=[1], linkCollisionShapeIndices=[box], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0.1]],
        linkInertialFrameOrientations=[[0.6, 0, 0, 0.8]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]],
    )  # fmt: skip
    linear, _ = p.calculateJacobian(body, 0, [0.1, 0.2, 0.3], [0.3], [0.0], [0.0])
    np.testing.assert_allclose(np.ravel(linear), [0.23412085, 0.0, -0.17709723], atol=1e-7)
