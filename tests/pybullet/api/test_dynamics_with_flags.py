"""calculateMassMatrix and calculateInverseDynamics with flags 1, as recorded from PyBullet 3.2.7."""

from __future__ import annotations

import numpy as np
import pytest

import roboyard.pybullet as p

TURN = [0.48, 0.0, 0.64, 0.6]
FIXED_MASSES = [
    3, 0, 0, 0, 1.34634557, 0.9578382, 0, 0.196338043, -0.145461604, 3, 0, -1.34634557, 0, 0.83813769,
    0, 0.652760709, 1.86335962, 3, -0.9578382, -0.83813769, 0, 0, 0.579098291, 0.711851009, 1.09592186,
    0.299413058, -0.419554068, 0, -0.654517164, -1.35316225, 0.965074011, 0.509312337, 0, -0.0878192028,
    -0.307962536, 0.652387595, 0, 0.320898105, 0.529621786, 1, 0, 0, 0.45, 0.8, 2,
]  # fmt: skip
"""Upper triangle of the (9, 9) mass matrix, row by row (kg, kg m, kg m²)."""
FIXED_EFFORTS = [
    -2.52536382, -2.53649947, 25.858161, -7.04244728, -8.42927336, -1.61157326, 0, 4.18095489,
    4.71603027,
]  # fmt: skip
"""Force (N), torque (N m), zero, torque and force of the joints."""
FLOATING_MASSES = [
    6, 0, 0, 0, 1.34634557, 0.9578382, 0, 0.196338043, -0.145461604, 6, 0, -1.34634557, 0, 0.83813769,
    0, 0.652760709, 1.86335962, 6, -0.9578382, -0.83813769, 0, 0, 0.579098291, 0.711851009, 1.17802815,
    0.32127341, -0.432785786, 0, -0.654517164, -1.35316225, 1.06617993, 0.538997073, 0, -0.0878192028,
    -0.307962536, 0.749175384, 0, 0.320898105, 0.529621786, 1, 0, 0, 0.45, 0.8, 2,
]  # fmt: skip
"""Upper triangle of the (9, 9) mass matrix, row by row (kg, kg m, kg m²)."""
FLOATING_EFFORTS = [
    -4.04425016, -5.8733932, 53.5328087, -7.38955386, -9.17715975, -1.97622922, 0, 4.32089887,
    5.06858482,
]  # fmt: skip
"""Force (N), torque (N m), zero, torque and force of the joints."""


def arm(mass: float) -> int:
    p.setGravity(0.5, 1, -9)
    base, link = (
        p.createCollisionShape(p.GEOM_BOX, halfExtents=size) for size in ([0.1, 0.2, 0.3], [0.1, 0.05, 0.2])
    )
    return p.createMultiBody(
        mass, base, basePosition=[1, 0, 1], baseOrientation=TURN, linkMasses=[1, 2],
        linkCollisionShapeIndices=[link] * 2, linkVisualShapeIndices=[-1] * 2,
        linkPositions=[[0.1, 0, 0.3], [0, 0.2, 0.4]], linkOrientations=[[0, 0, 0, 1]] * 2,
        linkInertialFramePositions=[[0, 0, 0]] * 2, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 1], linkJointTypes=[p.JOINT_REVOLUTE, p.JOINT_PRISMATIC],
        linkJointAxis=[[0, 1, 0], [1, 0, 0]],
    )  # fmt: skip


def triangle(matrix: tuple[tuple[float, ...], ...]) -> list[float]:
    found = np.array(matrix)
    np.testing.assert_allclose(found, found.T, rtol=0, atol=1e-12)
    return found[np.triu_indices(len(found))].tolist()


def test_a_fixed_base_has_rows_for_all_links_that_it_carries(client: int) -> None:
    """Positions and velocities are those of joints alone."""
    body = arm(0)
    q, speeds = [0.4, -0.2], [0.5, 0.7]
    assert triangle(p.calculateMassMatrix(body, q, 1)) == pytest.approx(FIXED_MASSES, abs=1e-8)
    found = p.calculateInverseDynamics(body, q, speeds, [9, 9], 1)
    assert found == pytest.approx(FIXED_EFFORTS, abs=1e-7)


def test_a_floating_base_has_world_axes_and_no_accelerations(client: int) -> None:
    body = arm(3)
    q, speeds = [1, 2, 3, *TURN, 0.4, -0.2], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0, 0.5, 0.7]
    assert triangle(p.calculateMassMatrix(body, q, 1)) == pytest.approx(FLOATING_MASSES, abs=1e-8)
    found = p.calculateInverseDynamics(body, q, speeds, [9] * 9, 1)
    assert found == pytest.approx(FLOATING_EFFORTS, abs=1e-7)


def test_lists_that_are_too_short_are_errors(client: int) -> None:
    """PyBullet reads what an earlier call left in their place."""
    body = arm(3)
    with pytest.raises(p.error):
        p.calculateInverseDynamics(body, [0, 0], [0, 0], [0, 0], 1)
    with pytest.raises(p.error):
        p.calculateMassMatrix(body, [0, 0], 1)
