"""Joints that machine code resets are as their Python functions reset them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands, joint_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
NAN = float("nan")


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert joint_entries.JOINTS.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_joints()
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


CALLS: dict[str, list[tuple[Any, ...]]] = {
    "resetJointState": [
        (2, 0.3),
        (2, 0.3, 0.4),
        (2, np.float64(0.3), np.float32(0.5)),
        (np.int64(3), 1, 2),
        (0, 0.3),
        (99, 0.3),
        (-1, 0.3),
        (2.0, 0.3),
        (2, "0.3"),
        (2, NAN),
        (2, 0.3, NAN),
        (2, 0.3, None),
        (10**30, 0.3),
        (2,),
    ],
    "resetJointStateMultiDof": [
        (2, [0.3]),
        (2, [0.3], [0.4]),
        (2, (1,), np.array([2.0])),
        (2, [0.3], None),
        (2, [0.3], []),
        (2, [], [0.4]),
        (2, [0.3], [1, 2]),
        (2, [0.3, 0.4]),
        (0, [0.3]),
        (99, [0.3]),
        (2, "a"),
        (2, 0.3),
        (2, [NAN]),
        (2, [0.3], [NAN]),
        (2, [], []),
    ],
    "resetJointStatesMultiDof": [
        ([2, 3], [[0.1], [0.2]], [[1], [2.5]]),
        (range(2, 4), ((1,), (2,)), np.array([[0.5], [0.6]])),
        ([2, 2], [[0.1], [0.2]], [[0.3], [0.4]]),
        ([2, 3], [[0.1], [0.2]], [[0.3], []]),
        ([2, 3], [[0.1], [0.2]], [[0.3]]),
        ([2, 3], [[0.1], [0.2]], []),
        ([2, 3], [[0.1], [0.2]], [[0.3], [NAN]]),
        ([2, 3], [[0.1], [0.2]], [[0.3], "a"]),
        ([2, 3], [[0.1], [0.2]], 5),
        ([0, 3], [[0.1], [0.2]], [[0.3], [0.4]]),
        ([2, 99], [[0.1], [0.2]], [[0.3], [0.4]]),
    ],
}


@pytest.mark.parametrize(("name", "given"), [(name, given) for name in CALLS for given in CALLS[name]])
def test_joints_are_reset_as_by_the_python_functions(name: str, given: tuple[Any, ...]) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
        places = range(p.getNumJoints(robot))
        for edit in (p.stepSimulation, lambda: p.createMultiBody(1.0), lambda: p.removeBody(1)):
            edit()
            for joint in places:
                p.resetJointState(robot, joint, 0.5, 0.25)
            for _ in range(2):  # prepared, or the edit would hide what the machine code does
                p.resetJointStatesMultiDof(robot, [6, 8], [[0.3], [0.4]], [[1], [2]])
                p.resetJointStateMultiDof(robot, 7, [0.3], [0.4])
            p.getLinkState(robot, 5, computeForwardKinematics=1)
            call = getattr(p, name)
            call = call.__self__ if is_python else call
            try:
                outcomes.append(call(robot, *given))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
            outcomes.append(p.getJointStates(robot, places))
            outcomes += [p.getLinkState(robot, 3, 1, fresh) for fresh in (0, 1)]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_whole_numbers_let_machine_code_reset_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1])
    p.stepSimulation()
    p.resetJointStatesMultiDof(robot, [6, 8], [[1], [2]], [[0], np.ones(1)])
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python function reads
    p.resetJointStatesMultiDof(robot, [6, 8], [[3], [4]], [[0], np.ones(1)])
    monkeypatch.undo()
    assert [state[:2] for state in p.getJointStates(robot, [6, 8])] == [(3, 0), (4, 1)]


def test_machine_code_resets_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1])
    p.stepSimulation()
    p.resetJointState(robot, 2, 0.1)
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python functions read
    p.resetJointState(robot, 2, 0.5, targetVelocity=0.25)
    p.resetJointState(robot, 7, 0.75)
    p.resetJointStateMultiDof(robot, 3, [0.125], [2])
    p.resetJointStatesMultiDof(robot, [6, 8], [[1], [2]], targetVelocities=[[3], [4]])
    monkeypatch.undo()
    states = p.getJointStates(robot, [2, 7, 3, 6, 8])
    assert [state[:2] for state in states] == [(0.5, 0.25), (0.75, 0), (0.125, 2), (1, 3), (2, 4)]
