"""The bundled stand-ins for PyBullet's models: joints as PyBullet 3.2.7 reports those of its own files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.assets import STAND_INS, assets_root

RECORDED = json.loads((Path(__file__).parent / "data" / "standins.json").read_text())
"""By file: name, type, (lower, upper, effort, velocity), link, axis, origin, parent, mass of each joint."""


def _load(file: str) -> int:
    path = str(assets_root() / file)
    return p.loadSDF(path)[0] if file.endswith(".sdf") else p.loadURDF(path)


@pytest.mark.parametrize("file", RECORDED)
def test_joints_are_those_of_pybullets_model(client: int, file: str) -> None:
    body = _load(file)
    assert p.getNumJoints(body) == len(RECORDED[file])
    for joint, (name, kind, limits, link, axis, origin, parent, mass) in enumerate(RECORDED[file]):
        info = p.getJointInfo(body, joint)
        assert (info[1].decode(), info[2], info[12].decode(), info[16]) == (name, kind, link, parent)
        if limits is not None:
            np.testing.assert_allclose(info[8:12], limits, atol=1e-4, err_msg=name)
        np.testing.assert_allclose(info[13], axis, atol=1e-3, err_msg=name)
        np.testing.assert_allclose(info[14], origin, atol=2e-3, err_msg=name)
        assert p.getDynamicsInfo(body, joint)[0] == pytest.approx(mass, abs=1e-5), name


@pytest.mark.parametrize("file", STAND_INS)
def test_every_stand_in_loads_and_is_seen(client: int, file: str) -> None:
    body = _load(file)
    boxes = np.array([p.getAABB(body, link) for link in range(-1, p.getNumJoints(body))])
    assert (boxes[:, 1] >= boxes[:, 0]).all()
    assert p.getVisualShapeData(body)


def test_the_panda_grasps_a_cube(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    p.setAdditionalSearchPath(str(assets_root()))
    p.loadURDF("plane.urdf")
    arm = p.loadURDF("franka_panda/panda.urdf", useFixedBase=True)
    cube = p.createMultiBody(
        0.1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.02] * 3), basePosition=[0.5, 0, 0.02]
    )
    down = p.getQuaternionFromEuler([np.pi, 0, 0])
    for joint, angle in zip(
        (0, 1, 2, 3, 4, 5, 6, 9, 10), (0, 0.3, 0, -2, 0, 2.3, 0.8, 0.04, 0.04), strict=True
    ):
        p.resetJointState(arm, joint, angle)
    for height, width, steps in ((0.15, 0.04, 120), (0.02, 0.04, 240), (0.02, 0.0, 120), (0.25, 0.0, 240)):
        for _ in range(steps):
            angles = p.calculateInverseKinematics(arm, 11, [0.5, 0, height], down)
            for joint in range(7):
                p.setJointMotorControl2(
                    arm, joint, p.POSITION_CONTROL, angles[joint], force=87, maxVelocity=1.5
                )
            for joint in (9, 10):
                p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, width, force=20)
            p.stepSimulation()
    assert p.getBasePositionAndOrientation(cube)[0][2] == pytest.approx(0.25, abs=0.02)
