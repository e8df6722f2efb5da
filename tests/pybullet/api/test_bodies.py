"""Listing, placing and removing bodies, compared with PyBullet 3.2.7 and with rigid body kinematics."""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

OFFSET = ([0.2, -0.1, 0.3], [0.1, 0.2, 0.3, 0.9273618495495703])


def offset_body(p: Any, mass: float = 1.0) -> int:
    """A box whose centre of mass is not at its link frame."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    return p.createMultiBody(
        mass, shape, basePosition=[1, 2, 3], baseOrientation=[0, 0, sqrt(0.5), sqrt(0.5)],
        baseInertialFramePosition=OFFSET[0], baseInertialFrameOrientation=OFFSET[1],
    )  # fmt: skip


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def record_poses(p: Any, folder: Path) -> Any:
    body = offset_body(p)
    poses = [p.getBasePositionAndOrientation(body)]
    p.resetBasePositionAndOrientation(body, [0, 1, 0], [0, 2, 0, 0])
    poses.append(p.getBasePositionAndOrientation(body))
    p.resetBasePositionAndOrientation(body, [5, 6, 7], [0.1, -0.2, 0.3, 0.4])
    poses.append(p.getBasePositionAndOrientation(body))
    return poses


def record_velocities(p: Any, folder: Path) -> Any:
    body = offset_body(p)
    found = [p.getBaseVelocity(body)]
    for change in (
        {"linearVelocity": [1, 2, 3]},
        {"angularVelocity": [0.5, -1, 2]},
        {"linearVelocity": [0, 0, 1], "angularVelocity": [1, 0, 0]},
    ):
        p.resetBaseVelocity(body, **change)
        found.append(p.getBaseVelocity(body))
    p.resetBasePositionAndOrientation(body, [0, 0, 0], [0, 0, 0, 1])
    return [*found, p.getBaseVelocity(body)]


def record_ids(p: Any, folder: Path) -> Any:
    ids = [p.createMultiBody(1) for _ in range(5)]
    p.removeBody(1)
    p.removeBody(3)
    p.removeBody(99)
    listed = [p.getBodyUniqueId(i) for i in range(-1, 5)]
    again = [p.createMultiBody(1) for _ in range(3)]
    return [ids, listed, again, p.getNumBodies(), [p.getBodyUniqueId(i) for i in range(6)]]


def record_names(p: Any, folder: Path) -> Any:
    file = folder / "named.urdf"
    file.write_text('<robot name="robbie"><link name="foot"/></robot>')
    return [p.getBodyInfo(p.createMultiBody(1)), p.getBodyInfo(p.loadURDF(str(file)))]


def record_errors(p: Any, folder: Path) -> Any:
    body = p.createMultiBody(1)
    return [
        message_of(lambda: p.getBasePositionAndOrientation(7)),
        message_of(lambda: p.getBodyInfo(7)),
        message_of(lambda: p.resetBasePositionAndOrientation(body, [0, 0], [0, 0, 0, 1])),
        message_of(lambda: p.resetBasePositionAndOrientation(body, [0, 0, 0], [0, 0, 1])),
        message_of(lambda: p.resetBaseVelocity(body)),
        message_of(lambda: p.resetBaseVelocity(7, [0, 0, 0])),
        message_of(lambda: p.removeBody(7)),
    ]


@pytest.mark.parametrize("scenario", [record_poses, record_velocities])
def test_poses_and_velocities_are_pybullets(agrees: Any, scenario: Any) -> None:
    agrees(scenario, 1e-6)


@pytest.mark.parametrize("scenario", [record_ids, record_names, record_errors])
def test_ids_names_and_errors_are_pybullets(agrees: Any, scenario: Any) -> None:
    agrees(scenario)


def test_a_thrown_body_without_gravity_moves_straight_on(client: int) -> None:
    body = offset_body(p)
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    start = np.array(p.getBasePositionAndOrientation(body)[0])
    p.resetBaseVelocity(body, [1, -2, 0.5], [0, 0, 3])
    for _ in range(120):
        p.stepSimulation()
    travelled = np.array(p.getBasePositionAndOrientation(body)[0]) - start
    assert travelled == pytest.approx([0.5, -1, 0.25], abs=5e-3)


@pytest.mark.parametrize("gravity", [(0, 0, -9.81), (1, 0, 0), (0.5, -2, 3)])
def test_a_drop_of_n_steps(client: int, gravity: tuple[float, float, float]) -> None:
    """Semi-implicit Euler: after n steps the way is g dt² n (n + 1) / 2."""
    body = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    p.setGravity(*gravity)
    n, dt = 48, 1 / 240
    for _ in range(n):
        p.stepSimulation()
    position = p.getBasePositionAndOrientation(body)[0]
    assert position == pytest.approx([g * dt * dt * n * (n + 1) / 2 for g in gravity], rel=1e-6, abs=1e-9)


def test_a_fixed_body_has_the_velocity_that_it_was_given(client: int) -> None:
    body = offset_body(p, mass=0.0)
    assert p.getBaseVelocity(body) == ((0, 0, 0), (0, 0, 0))
    p.resetBaseVelocity(body, [1, 1, 1], [1, 1, 1])
    assert np.array(p.getBaseVelocity(body)) == pytest.approx(np.ones((2, 3)))


def test_lists_of_another_length_count_as_zeros(client: int) -> None:
    body = offset_body(p)
    p.resetBaseVelocity(body, [1, 1, 1], [1, 1, 1])
    p.resetBaseVelocity(body, [1, 2])
    assert p.getBaseVelocity(body)[0] == pytest.approx((0, 0, 0))


def test_a_zero_quaternion_is_an_error_that_quotes_it(client: int) -> None:
    body = offset_body(p)
    with pytest.raises(p.error) as caught:
        p.resetBasePositionAndOrientation(body, [0, 0, 0], [0, 0, 0, 0])
    assert "(0, 0, 0, 0)" in caught.value.__notes__[0]


def test_reset_removes_everything_but_the_time_step(client: int) -> None:
    offset_body(p)
    p.setTimeStep(0.01)
    p.setGravity(0, 0, -3)
    p.resetSimulation()
    settings = p.getPhysicsEngineParameters()
    assert p.getNumBodies() == 0
    assert settings["fixedTimeStep"] == 0.01
    assert settings["gravityAccelerationZ"] == 0.0
    assert offset_body(p) == 0


def test_bodies_of_a_removed_client_are_not_found(client: int) -> None:
    other = p.connect(p.DIRECT)
    body = p.createMultiBody(1, physicsClientId=other)
    p.disconnect(other)
    with pytest.raises(p.error, match="Not connected to physics server"):
        p.getBodyInfo(body, physicsClientId=other)
    assert p.syncBodyInfo() is None
