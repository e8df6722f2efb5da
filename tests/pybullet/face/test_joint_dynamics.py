"""Joint damping and limits that change often: as by the Python functions, and as in PyBullet."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from entry_robots import ARM, INERTIAL

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet.fast.properties import entries as property_entries

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert property_entries.PROPERTIES.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


@pytest.fixture
def arm(tmp_path: Path) -> int:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(inertial=INERTIAL))
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    flags = p.URDF_USE_INERTIA_FROM_FILE
    found = p.loadURDF(str(path), useFixedBase=True, flags=flags)
    for joint in (0, 1):
        p.setJointMotorControl2(found, joint, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(found, joint, 0.3)
    return found


def positions(arm: int) -> list[float]:
    return [number for state in p.getJointStates(arm, [0, 1]) for number in state[:2]]


def test_an_arm_with_changing_damping_and_limits_moves_as_in_pybullet(arm: int) -> None:
    for step in range(240):
        p.changeDynamics(arm, 0, jointDamping=0.01 * (step % 9))
        p.changeDynamics(arm, 1, jointDamping=0.02 + 0.001 * (step % 7))
        p.changeDynamics(arm, 0, jointLowerLimit=-1.5, jointUpperLimit=0.9 + 0.001 * (step % 3))
        p.stepSimulation()
    np.testing.assert_allclose(positions(arm), RECORDED, rtol=0, atol=1e-7)


RECORDED = [0.9017865061406408, 0.14595897680207215, 3.151693673173207, -6.711357930483839]
"""Positions and velocities in PyBullet 3.2.7."""


def test_numbers_are_those_of_the_python_function(arm: int, tmp_path: Path) -> None:
    outcomes: list[Any] = []
    p.disconnect()
    for is_python in (False, True):
        draw = random.Random(8)
        p.connect(p.DIRECT)
        p.setGravity(0, 0, -9.8)
        body = p.loadURDF(str(tmp_path / "arm.urdf"), useFixedBase=True)
        for joint in (0, 1):
            p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
        call = p.changeDynamics.__self__ if is_python else p.changeDynamics
        other = -1
        for step in range(200):
            joint = draw.choice([0, 1, 2, -1, 7])
            lower, upper = draw.choice([-1, -0.5]), draw.choice([0.4, 0.5, -0.9])
            values: Any = draw.choice(
                [
                    {"jointDamping": draw.choice([0, 0.1, 0.2])},
                    {"jointLowerLimit": lower, "jointUpperLimit": upper},
                    {"jointDamping": 0.3, "jointLowerLimit": lower, "jointUpperLimit": upper},
                    {"jointLowerLimit": lower},
                    {"jointUpperLimit": draw.choice([0.9, 1, 1.2])},
                    {"maxJointVelocity": draw.choice([2, 3.0, 50])},
                    {"anisotropicFriction": [1, 2, 3], "jointDamping": 0.05},
                    {"jointDamping": -1.0, "mass": draw.choice([0.4, 0.5])},
                ]
            )
            call(body, joint, **values)
            if step % 20 == 13:
                other = p.createMultiBody(1.0, basePosition=[3, 3, 3])
                call(body, 0, jointDamping=0.15 + 0.001 * step)
                call(body, 0, jointLowerLimit=-1.0, jointUpperLimit=0.6 + 0.001 * step)
            if step % 40 == 30:
                p.removeBody(other)
            if step % 3 == 0:
                p.stepSimulation()
            outcomes.append(positions(body))
            client: Any = CLIENTS[0]
            joints = client.scene.bodies[body].body.joints
            if step % 7 == 0:
                outcomes.append([one.damping for one in joints])
            world = client.scene.world
            if not world.is_stale:
                outcomes.append([world.live_model.dof_damping.tolist(), world.live_model.jnt_range.tolist()])
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_machine_code_writes_damping_and_limits(arm: int, monkeypatch: pytest.MonkeyPatch) -> None:
    p.stepSimulation()
    for k in range(3):
        p.changeDynamics(arm, 0, jointDamping=0.1 + k)
        p.changeDynamics(arm, 0, jointLowerLimit=-1 - k, jointUpperLimit=1)
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python function reads
    p.changeDynamics(arm, 0, jointDamping=0.7)
    p.changeDynamics(arm, 0, jointLowerLimit=-0.5, jointUpperLimit=1.5)
    monkeypatch.undo()
    world = client.scene.world
    assert world.live_model.dof_damping[0] == 0.7
    assert world.live_model.jnt_range[0].tolist() == [-0.5, 1.5]
    p.createMultiBody(1.0)
    p.stepSimulation()  # with a new model
    assert world.live_model.dof_damping[0] == 0.7
    assert world.live_model.jnt_range[0].tolist() == [-0.5, 1.5]


@pytest.mark.parametrize("calls", [1, 4])
def test_a_joint_that_is_locked_by_its_limits_stays_locked_in_a_new_model(arm: int, calls: int) -> None:
    p.stepSimulation()
    for k in range(calls):  # the last ones in machine code
        p.changeDynamics(arm, 0, jointLowerLimit=0.29 + 0.0025 * k, jointUpperLimit=0.29 + 0.0025 * k)
    p.resetJointState(arm, 0, 0.29 + 0.0025 * (calls - 1))
    for _ in range(2):
        p.createMultiBody(1.0, basePosition=[3, 3, 3])
        for _ in range(20):
            p.stepSimulation()
        assert p.getJointState(arm, 0)[0] == pytest.approx(0.29 + 0.0025 * (calls - 1), abs=1e-4)
