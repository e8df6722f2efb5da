"""Optional vectors of another length than expected: PyBullet 3.2.7 ignores them, and so do its programs."""

from __future__ import annotations

from typing import Any

import pytest

import roboyard.pybullet as p

BAD = [[0.0, 1.0], [], [1.0, 2.0, 3.0, 4.0, 5.0], 7]
IDENTITY = (0.0, 0.0, 0.0, 1.0)
NOWHERE = (0.0, 0.0, 0.0)


@pytest.mark.parametrize("bad", BAD)
def test_shapes_and_bodies_keep_their_defaults(client: int, bad: Any) -> None:
    shape = p.createCollisionShape(
        p.GEOM_BOX, halfExtents=bad, collisionFramePosition=bad, collisionFrameOrientation=bad
    )
    visual = p.createVisualShape(
        p.GEOM_BOX, halfExtents=bad, rgbaColor=bad, specularColor=bad, visualFramePosition=bad,
        visualFrameOrientation=bad,
    )  # fmt: skip
    body = p.createMultiBody(
        1, shape, visual, basePosition=bad, baseOrientation=bad, baseInertialFramePosition=bad,
        baseInertialFrameOrientation=bad,
    )  # fmt: skip
    p.changeVisualShape(body, -1, specularColor=bad)
    assert p.getCollisionShapeData(body, -1) == ((0, -1, 3, (2.0, 2.0, 2.0), b"", NOWHERE, IDENTITY),)
    assert p.getVisualShapeData(body)[0][2:8] == (
        3, (2.0, 2.0, 2.0), b"", NOWHERE, IDENTITY, (1.0, 1.0, 1.0, 1.0),
    )  # fmt: skip
    assert p.getBasePositionAndOrientation(body) == (NOWHERE, IDENTITY)
    mass, friction, moments, *frame = p.getDynamicsInfo(body, -1)[:5]
    assert (mass, friction, *frame) == (1.0, 0.5, NOWHERE, IDENTITY)
    assert moments == pytest.approx((2 / 3, 2 / 3, 2 / 3))


@pytest.mark.parametrize("bad", [*BAD, None])
def test_frames_of_constraints_keep_their_defaults(client: int, bad: Any) -> None:
    body = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3))
    weld = p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, bad, bad, bad, bad, bad)
    assert p.getConstraintInfo(weld)[4:10] == (4, NOWHERE, NOWHERE, NOWHERE, IDENTITY, IDENTITY)
    p.changeConstraint(weld, [1, 2, 3], [0, 0, 1, 0])
    p.changeConstraint(weld, bad, bad)
    assert p.getConstraintInfo(weld)[7:10] == ((1.0, 2.0, 3.0), IDENTITY, (0.0, 0.0, 1.0, 0.0))


@pytest.mark.parametrize("bad", BAD)
def test_rays_inertias_and_lights(client: int, bad: Any) -> None:
    body = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[1.0] * 3))
    plane = p.createCollisionShape(p.GEOM_PLANE, planeNormal=bad)
    floor = p.createMultiBody(0, plane, basePosition=[0, 0, -9])
    assert p.rayTest(bad, [0, 0, -20])[0][:3] == (floor, -1, pytest.approx(0.45, abs=1e-5))
    p.changeDynamics(body, -1, localInertiaDiagonal=[1, 2, 3])
    p.changeDynamics(body, -1, localInertiaDiagonal=bad)  # PyBullet sets numbers at random
    assert p.getDynamicsInfo(body, -1)[2] == (1.0, 2.0, 3.0)
    assert len(p.getCameraImage(8, 8, lightDirection=bad, lightColor=bad, renderer=p.ER_TINY_RENDERER)) == 5


@pytest.mark.parametrize("bad", BAD)
def test_targets_of_the_camera(window: int, bad: Any) -> None:
    p.resetDebugVisualizerCamera(2.0, 30.0, -40.0, bad)
    assert p.getDebugVisualizerCamera()[8:11] == (30.0, -40.0, 2.0)


def test_numbers_are_still_required(client: int) -> None:
    with pytest.raises(TypeError):
        p.createVisualShape(p.GEOM_SPHERE, rgbaColor=["r", "g", "b", "a"])
