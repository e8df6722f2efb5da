"""Steps whose preparation is known from the last one agree with prepared ones to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet_data import getDataPath
from roboyard.sim.stepping.time_steps import Stepping


def states(client: int, bodies: list[int]) -> list[Any]:
    found: list[Any] = []
    for body in bodies:
        found.append(p.getBasePositionAndOrientation(body, physicsClientId=client))
        found.append(p.getBaseVelocity(body, physicsClientId=client))
        joints = range(p.getNumJoints(body, physicsClientId=client))
        found += [p.getJointState(body, joint, physicsClientId=client) for joint in joints]
    return found


def program() -> list[Any]:
    """Steps between which all is changed that steps depend on."""
    client = p.connect(p.DIRECT)
    c: dict[str, Any] = {"physicsClientId": client}
    p.setAdditionalSearchPath(getDataPath(), **c)
    p.setGravity(0, 0, -9.8, **c)
    plane = p.loadURDF("plane.urdf", **c)
    robot = p.loadURDF("r2d2.urdf", [0, 0, 0.6], **c)
    cart = p.loadURDF("cartpole.urdf", [3, 0, 1], **c)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3, **c)
    bodies = [plane, robot, cart]
    found: list[Any] = []

    def steps(count: int) -> None:
        for k in range(count):
            p.setJointMotorControl2(cart, 0, p.TORQUE_CONTROL, force=(-1) ** k, **c)
            p.stepSimulation(**c)
        found.append(states(client, bodies))

    steps(5)
    for joint in (2, 3, 6, 7):
        p.setJointMotorControl2(robot, joint, p.VELOCITY_CONTROL, targetVelocity=-8, force=40, **c)
    steps(20)
    p.applyExternalForce(robot, -1, [200, 0, 0], [0, 0, 0], p.WORLD_FRAME, **c)
    steps(5)
    bodies.append(p.createMultiBody(1.0, box, -1, [0.3, 0, 1.2], **c))  # falls on the robot
    steps(60)
    p.setTimeStep(1 / 500, **c)
    steps(5)
    p.changeDynamics(bodies[-1], -1, lateralFriction=0.1, restitution=0.5, mass=3.0, **c)
    steps(5)
    p.setGravity(0, 1, -5, **c)
    steps(5)
    p.setPhysicsEngineParameter(erp=0.4, contactERP=0.3, numSolverIterations=20, **c)
    steps(5)
    lock = p.createConstraint(robot, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1], **c)
    steps(5)
    p.removeConstraint(lock, **c)
    steps(5)
    p.setCollisionFilterPair(robot, bodies[-1], -1, -1, 0, **c)
    p.changeDynamics(robot, 2, jointDamping=0.5, maxJointVelocity=2.0, **c)
    steps(5)
    p.removeBody(bodies.pop(), **c)
    steps(5)
    p.resetBasePositionAndOrientation(robot, [0, 1, 0.5], [0, 0, 0, 1], **c)
    p.resetJointState(cart, 1, 0.3, 0.1, **c)
    steps(5)
    kept = p.saveState(**c)
    steps(5)
    p.restoreState(kept, **c)
    steps(5)
    p.disconnect(client)
    return found


def test_direct_steps_are_those_that_are_prepared(monkeypatch: pytest.MonkeyPatch) -> None:
    direct: list[bool] = []
    attempt = Stepping._direct_step

    def counted(self: Stepping, model: Any, data: Any) -> bool:
        direct.append(attempt(self, model, data))
        return direct[-1]

    monkeypatch.setattr(Stepping, "direct_step", lambda *given: None)  # which machine code makes
    monkeypatch.setattr(Stepping, "_direct_step", counted)
    found = program()
    assert sum(direct) > 100
    monkeypatch.setattr(Stepping, "_direct_step", lambda *given: False)
    np.testing.assert_equal(found, program())
