"""Bodies and links without inertia, compared with PyBullet 3.2.7: nothing turns them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

MOMENTS = ([0, 0, 0], [0, 0, 1], [0.1, 0, 0.1])


def _pushed(p: Any, body: int) -> list[Any]:
    """Push and twist a body for a tenth of a second; return its pose and velocity."""
    for _ in range(24):
        p.applyExternalTorque(body, -1, [0.01, 0.02, 0.03], p.WORLD_FRAME)
        p.applyExternalForce(body, -1, [1, 0, 0], [2, 0.1, 0.1], p.WORLD_FRAME)
        p.stepSimulation()
    return [*p.getBasePositionAndOrientation(body), *p.getBaseVelocity(body)]


def record_bodies(p: Any, folder: Path) -> list[Any]:
    """Bodies without shapes, and boxes with such moments that overhang an edge or spin."""
    found = []
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.25] * 3)
    edge = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 5, 0.1])
    for frame in ([0, 0, 0], [0.1, 0, 0]):
        p.setGravity(0, 0, -10)
        visual = p.createVisualShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
        found.append(_pushed(p, p.createMultiBody(1, -1, visual, [1, 0, 0], baseInertialFramePosition=frame)))
    for moments in MOMENTS:
        p.createMultiBody(0, edge, -1, [0.15, 0, -0.1])
        body = p.createMultiBody(1, shape, -1, [-0.2, 0, 0.26])
        p.changeDynamics(body, -1, localInertiaDiagonal=moments)
        found.append(_pushed(p, body))
        p.resetBaseVelocity(body, [0, 0, 0], [0.1, 0.2, 0.5])
        found.append(_pushed(p, body)[3])
        p.removeBody(body)
    return found


def _hinge(p: Any, moments: Any, frame: Any, base: float) -> int:
    """Return a body of two boxes with a hinge about z."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    body = p.createMultiBody(
        base, shape, -1, [0, 0, 1],
        linkMasses=[1],
        linkCollisionShapeIndices=[-1 if moments is None else shape],
        linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0.3]],
        linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[frame],
        linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE],
        linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    if moments is not None:
        p.changeDynamics(body, 0, localInertiaDiagonal=moments)
    return body


def record_hinges(p: Any, folder: Path) -> list[Any]:
    """Positions of hinges, free and driven, whose links have no inertia about the axis."""
    found = []
    p.setGravity(0, 0, -10)
    for moments in (None, [0, 0, 0], [0, 0, 1]):
        for frame, base in (([0, 0, 0], 0), ([0, 0, 0.1], 1), ([0.1, 0, 0], 0)):
            for torque, speed in ((1, None), (None, 2)):
                body = _hinge(p, moments, frame, base)
                p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
                if speed:
                    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, targetVelocity=speed, force=50)
                for _ in range(24):
                    if torque:
                        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=torque)
                    p.stepSimulation()
                found.append(p.getJointState(body, 0)[:2])
                p.removeBody(body)
    return found


@pytest.mark.parametrize("scenario", [record_bodies, record_hinges])
def test_nothing_turns_them(agrees: Callable[..., None], scenario: Any) -> None:
    agrees(scenario, 2e-3)


def test_a_held_joint_adds_nothing_to_the_mass_matrix(client: int) -> None:
    """A hinge whose link has no inertia about it: PyBullet's matrix has 0 there."""
    import roboyard.pybullet as p

    body = _hinge(p, None, [0, 0, 0], 0.0)
    p.stepSimulation()
    assert p.calculateMassMatrix(body, [0.3])[0] == pytest.approx([0.0], abs=1e-9)
    assert p.calculateInverseDynamics(body, [0.3], [0.1], [0.2]) == pytest.approx([0.0], abs=1e-9)
