"""What scripts change while a simulation runs: pushes, speeds, masses, terrain."""

from __future__ import annotations

import numpy as np
import pytest

import roboyard.pybullet as p
import roboyard.pybullet_data as data


@pytest.fixture
def ball(client: int) -> int:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
    body = p.createMultiBody(2.0, shape, basePosition=[0, 0, 5])
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    return body


@pytest.mark.parametrize("parts", [1, 4])
def test_a_push_lasts_a_whole_step(ball: int, parts: int) -> None:
    p.setPhysicsEngineParameter(numSubSteps=parts)
    p.applyExternalForce(ball, -1, [48, 0, 0], [0, 0, 0], p.LINK_FRAME)
    p.stepSimulation()
    p.stepSimulation()
    assert p.getBaseVelocity(ball)[0][0] == pytest.approx(48 / 2 / 240)


def test_the_greatest_joint_speed_can_be_changed(client: int) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    cart = p.loadURDF("cartpole.urdf")
    for greatest in (100, 3, 150):
        if greatest != 100:
            p.changeDynamics(cart, 1, maxJointVelocity=greatest)
        p.setJointMotorControl2(cart, 1, p.VELOCITY_CONTROL, targetVelocity=500, force=1e6)
        for _ in range(5):
            p.stepSimulation()
        assert p.getJointState(cart, 1)[1] == pytest.approx(greatest, rel=1e-3)


def test_a_client_that_left_frees_its_world(client: int) -> None:
    import weakref

    from roboyard.pybullet.clients import CLIENTS

    other = p.connect(p.DIRECT)
    p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, physicsClientId=other), physicsClientId=other)
    p.stepSimulation(physicsClientId=other)
    freed = weakref.ref(CLIENTS[other].scene.world.data)
    p.disconnect(other)
    assert freed() is None, "without waiting for the garbage collector"
    assert np.isfinite(p.getAPIVersion())
