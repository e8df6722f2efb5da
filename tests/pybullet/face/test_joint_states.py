"""States of joints that machine code reads are those of the Python functions."""

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
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands, joint_states

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
MANY, ONE = ("getJointStates", "getJointStatesMultiDof"), ("getJointState", "getJointStateMultiDof")
ORDERS: tuple[Any, ...] = (
    *([0, 1, 2], [1], (1, 0), range(3), np.arange(2), [np.int64(1), np.int64(0)], [0, 0], [True]),
    *([2], np.array([2, 1], np.uint8), [1.0], np.array([1, 0, 2])[::-1], np.array([1, 5, 0, 5])[::2]),
    *(np.array([1, 0], ">i8"), np.array([0, 1], np.int32), np.array([[0, 1]])[0], np.array([0.0, 1.0])),
)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert joint_states.STATES.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_joint_reads()
    assert p.connect(p.DIRECT) == 0
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


@pytest.fixture
def arm(tmp_path: Path) -> int:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(inertial=INERTIAL))
    p.setGravity(0, 0, -9.8)
    return p.loadURDF(str(path), useFixedBase=True)


def check(robot: int) -> None:
    client = CLIENTS[0]
    for name in ONE:
        for joint in (0, 1, 2, np.int64(1), np.int32(0)):
            assert getattr(p, name)(robot, joint) == COMMANDS[name].function(client, robot, int(joint))
    for name in MANY:
        for joints in ORDERS:
            assert getattr(p, name)(robot, joints) == COMMANDS[name].function(client, robot, joints)


def is_prepared(robot: int) -> bool:
    client: Any = CLIENTS[0]
    return robot in client.prepared[joint_states.KIND]


def test_states_after_steps_commands_and_edits(arm: int) -> None:
    draw = random.Random(5)
    sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    check(arm)
    for turn in range(60):
        joint = draw.randrange(2)
        kind = draw.randrange(9)
        if kind < 3:
            p.setJointMotorControl2(
                arm, joint, p.POSITION_CONTROL, draw.uniform(-1, 1), force=draw.uniform(0, 9)
            )
        elif kind == 3:
            p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, force=0)
        elif kind == 4:
            p.resetJointState(arm, joint, draw.uniform(-1, 1), draw.uniform(-1, 1))
        elif kind == 5:
            p.createMultiBody(1.0, sphere, basePosition=[3, turn, 1])
        elif kind == 6:
            p.enableJointForceTorqueSensor(arm, joint, draw.randrange(2))
        elif kind == 7:
            p.setPhysicsEngineParameter(numSubSteps=draw.choice([0, 2]))
        check(arm)
        for _ in range(draw.randrange(3)):
            p.stepSimulation()
            check(arm)
    for joint in range(2):
        p.enableJointForceTorqueSensor(arm, joint, 0)
    check(arm)
    assert is_prepared(arm)
    saved = p.saveState()
    p.stepSimulation()
    p.restoreState(saved)
    check(arm)


def test_prepared_states_are_read_by_machine_code(arm: int, monkeypatch: pytest.MonkeyPatch) -> None:
    p.stepSimulation()
    check(arm)
    assert is_prepared(arm)
    p.stepSimulation()
    expected = [COMMANDS[name].function(CLIENTS[0], arm, [0, 1]) for name in MANY]
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python functions read
    assert [getattr(p, name)(arm, [np.int64(0), 1]) for name in MANY] == expected
    assert [p.getJointStates(arm, (0, 1)), p.getJointStatesMultiDof(arm, range(2))] == expected
    assert [getattr(p, name)(arm, 1) for name in ONE] == [states[1] for states in expected]
    assert p.getJointState(bodyUniqueId=arm, jointIndex=2)[3] == 0.0


def test_errors_are_those_of_the_python_functions(arm: int) -> None:
    p.stepSimulation()
    check(arm)
    for name in ONE:
        for joint in (3, -1, 10**30):
            with pytest.raises((p.error, OverflowError)):
                getattr(p, name)(arm, joint)
    for name in MANY:
        for joints in ([3], [0, -1], [0, 99], np.array([0, 3]), np.array([-1]), np.array([2**62])):
            with pytest.raises(p.error, match="out-of-range"):
                getattr(p, name)(arm, joints)
        with pytest.raises(p.error):
            getattr(p, name)(arm, np.array([[0, 1]]))
        assert getattr(p, name)(arm, []) is None
        assert getattr(p, name)(arm, np.zeros(0, np.int64)) is None


def test_an_index_that_steps_and_removes_while_it_is_read(arm: int) -> None:
    class Stepping:
        """An index whose function makes a step, and removes the robot."""

        def __init__(self, removes: bool) -> None:
            self.removes = removes

        def __index__(self) -> int:
            p.stepSimulation()
            if self.removes:
                p.removeBody(arm)
            return 1

    p.stepSimulation()
    check(arm)
    for name in MANY:
        assert len(getattr(p, name)(arm, [0, Stepping(False), 1])) == 3
    assert len(p.getJointStates(arm, [0, Stepping(True), 1])) == 3
    with pytest.raises(p.error):
        p.getJointStates(arm, [0])
