"""Commands called by machine code: the same answers and errors as through Python, for all arguments."""

from __future__ import annotations

import gc
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet import functions
from roboyard.pybullet.bullet_client import BulletClient
from roboyard.pybullet.face import command_names, direct_calls
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(scope="module", autouse=True)
def _machine_code() -> None:
    assert FRONT.address()
    direct_calls.START.enter(waits=False)


@pytest.fixture
def box() -> Iterator[int]:
    client = p.connect(p.DIRECT)
    assert client == 0
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    yield p.createMultiBody(2.0, shape, basePosition=[0, 0, 1])
    p.disconnect()


def python(name: str) -> Any:
    """Return the public function without machine code."""
    return functions.public_function(name).__self__  # type: ignore[attr-defined]


CALLS: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    ("getNumBodies", (), {}),
    ("getNumBodies", (), {"physicsClientId": 0}),
    ("getNumBodies", (0,), {}),
    ("getNumBodies", (1, 2), {}),
    ("getNumBodies", (), {"physicsClientId": True}),
    ("getNumBodies", (), {"physicsClientId": 0.0}),
    ("getNumBodies", (), {"physicsClientId": 7}),
    ("getNumBodies", (), {"clientId": 0}),
    ("getNumJoints", (0,), {}),
    ("getNumJoints", (1.0,), {}),
    ("getNumJoints", ("0",), {}),
    ("getNumJoints", (True,), {}),
    ("getNumJoints", (10**30,), {}),
    ("getNumJoints", (), {}),
    ("getNumJoints", (0, 0, 0), {}),
    ("getNumJoints", (), {"bodyUniqueId": 0}),
    ("getNumJoints", (0,), {"bodyUniqueId": 0}),
    ("getNumJoints", (), {"bodyUniqueId": 0, "physicsClientId": 0}),
    ("getNumJoints", (), {"physicsClientId": 0, "bodyUniqueId": 0}),
    ("getBodyInfo", (5,), {}),
    ("getDynamicsInfo", (0, -1), {}),
    ("getDynamicsInfo", (0, -1), {"physicsClientId": 0}),
    ("getDynamicsInfo", (0, -2), {}),
    ("getDynamicsInfo", (0, 3), {}),
    ("getDynamicsInfo", ([0], -1), {}),
    ("getJointInfo", (0, 0), {}),
    ("getBasePositionAndOrientation", (0,), {}),
    ("getBasePositionAndOrientation", (3,), {}),
    ("resetBaseVelocity", (0, [float("inf"), 0, 0]), {}),
    ("resetBasePositionAndOrientation", (0, [0, 0, 1], [0, 0, 0]), {}),
    ("setJointMotorControl2", (0,), {}),
    ("setJointMotorControl2", (0, 0), {"controlMode": 2, "physicsClientId": 0}),
    ("setJointMotorControl2", (), {"bodyIndex": 0, "jointIndex": 0, "controlMode": 2}),
    ("changeDynamics", (0, -1), {"mass": float("nan")}),
    ("changeDynamics", (0, -1), {"lateralFriction": 0.7, "physicsClientId": 0, "restitution": 0.1}),
    ("getUserDataId", (0, "physicsClientId"), {}),
    ("rayTest", ([0, 0, 3], [0, 0, 0]), {}),
    ("rayTest", (), {"rayToPosition": [0, 0, 0], "rayFromPosition": [0, 0, 3]}),
    ("rayTest", ([0, 0, 3],), {"reportHitNumber": 0, "rayToPosition": [0, 0, 0], "physicsClientId": 0}),
    ("rayTest", ([0, 0, 3],), {"reportHitNumber": 0}),
    ("rayTest", (), {"rayToPosition": [0, 0, 0]}),
    ("rayTest", ([0, 0, 3], [0, 0, 0], -1, -1, 0), {}),
    ("rayTest", ([0, 0, 3], [0, 0, 0], -1, -1), {"physicsClientId": 0}),
    ("rayTest", ([0, 0, 3], [0, 0, 0]), {"rayFromPosition": [0, 0, 3]}),
    ("getDynamicsInfo", (), {"linkIndex": -1, "bodyUniqueId": 0}),
    ("getDynamicsInfo", (), {"linkIndex": -1}),
    ("getVisualShapeData", (0,), {}),
    ("getVisualShapeData", (0,), {"flags": 0}),
    ("getVisualShapeData", (0,), {"flags": 1}),
    ("getNumBodies", (0,), {}),
    ("getNumBodies", (1,), {}),
    ("getNumBodies", (0.0,), {}),
    ("getNumBodies", (0,), {"physicsClientId": 0}),
    ("getNumBodies", (0, 0), {}),
    ("getDynamicsInfo", (0, -1, 0), {}),
    ("getDynamicsInfo", (0, -1, 7), {}),
    ("getDynamicsInfo", (0, -1, 0), {"linkIndex": -1}),
    ("getDynamicsInfo", (0, -1, np.int64(0)), {}),
    ("getDynamicsInfo", (np.int64(0), np.int32(-1)), {}),
    ("getDynamicsInfo", (np.float64(0), -1), {}),
    ("getDynamicsInfo", (np.int64(5), np.int8(-1)), {}),
    ("getUserDataInfo", (np.int64(0),), {"userDataId": np.int64(0)}),
    ("isConnected", (0,), {}),
    ("isConnected", (1,), {}),
    ("isConnected", (0, 0), {}),
    ("getBasePositionAndOrientation", (np.int32(0),), {"physicsClientId": 0}),
    ("changeDynamics", (np.int64(0), np.int64(-1)), {"mass": np.int64(2)}),
    ("rayTest", ([0, 0, 3], [0, 0, 0], np.int64(-1), np.int64(0), 0), {}),
]


def outcome(function: Any, given: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
    """Return the answer of a call, or class, text, notes and cause of its error."""
    try:
        return function(*given, **keywords)
    except Exception as problem:
        return type(problem), str(problem), getattr(problem, "__notes__", []), type(problem.__cause__)


@pytest.mark.parametrize(("name", "given", "keywords"), CALLS)
def test_calls_have_the_same_outcome(
    box: int, name: str, given: tuple[Any, ...], keywords: dict[str, Any]
) -> None:
    expected = outcome(python(name), given, keywords)
    for _ in range(3):  # kept answers, too
        assert outcome(getattr(p, name), given, keywords) == expected


def test_errors_have_the_frames_of_the_command_alone(box: int) -> None:
    with pytest.raises(p.error) as caught:
        p.getBodyInfo(box + 9)
    assert [entry.name for entry in caught.traceback][1:] == ["getBodyInfo"]
    assert caught.value.__notes__


def test_kept_answers_follow_what_changes_them(box: int) -> None:
    assert (p.getNumBodies(), p.getDynamicsInfo(box, -1)[1], p.getNumUserData(box)) == (1, 0.5, 0)
    second = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    assert (p.getNumBodies(), p.getBodyUniqueId(1)) == (2, second)
    p.changeDynamics(box, -1, lateralFriction=0.25)
    assert p.getDynamicsInfo(box, -1)[1] == 0.25
    p.addUserData(box, "key", "value")
    assert (p.getNumUserData(box), p.getUserData(0)) == (1, b"value")
    p.addUserData(box, "key", "other")
    assert p.getUserData(0) == b"other"
    made = p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    assert (p.getNumConstraints(), p.getConstraintInfo(made)[10]) == (1, 500)
    p.changeConstraint(made, maxForce=30)
    assert p.getConstraintInfo(made)[10] == 30
    p.removeConstraint(made)
    assert (p.getNumConstraints(), p.getConstraintUniqueId(0)) == (0, -1)
    p.changeVisualShape(box, -1, rgbaColor=[1, 0, 0, 1])
    assert p.getVisualShapeData(box)[0][7] == (1, 0, 0, 1)
    p.removeBody(second)
    assert (p.getNumBodies(), p.getBodyUniqueId(1)) == (1, -1)
    p.loadURDF(f"{getDataPath()}/plane.urdf")
    assert p.getNumBodies() == 2
    p.resetSimulation()
    assert p.getNumBodies() == 0


def contacts() -> list[tuple[Any, ...]]:
    """Return the links, places and distances of all contact points."""
    return [point[1:9] for point in p.getContactPoints()]


def settled_boxes(box: int) -> list[int]:
    """Return boxes that lie one on the other, after steps."""
    p.setGravity(0, 0, -10)
    p.loadURDF(f"{getDataPath()}/plane.urdf")
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    p.resetBasePositionAndOrientation(box, [0, 0, 0.299], [0, 0, 0, 1])
    boxes = [p.createMultiBody(2.0, shape, basePosition=[0.02 * k, 0, 0.3 + 0.598 * k]) for k in (1, 2)]
    for _ in range(5):
        p.stepSimulation()
    return [box, *boxes]


def failed(name: str, *given: Any) -> tuple[str, list[str], Any]:
    """Return text and notes of the error that a command raises, and the error."""
    with pytest.raises(p.error) as problem:
        getattr(p, name)(*given)
    assert type(problem.value) is p.error
    return str(problem.value), getattr(problem.value, "__notes__", []), problem.value


READS: dict[str, tuple[Any, ...]] = {
    "getAABB": (7, -1), "getBasePositionAndOrientation": (7,), "getBaseVelocity": (7,), "getBodyInfo": (7,),
    "getConstraintInfo": (7,), "getDynamicsInfo": (7, -1), "getJointInfo": (7, 0), "getJointState": (7, 0),
    "getJointStateMultiDof": (7, 0), "getLinkState": (7, 0),
}  # fmt: skip


def test_repeated_errors_are_new_exceptions_of_the_same_texts(box: int) -> None:
    assert READS.keys() == command_names.KEPT_FAILURES.keys()
    for name, given in READS.items():
        with pytest.raises(p.error) as expected:
            python(name)(*given)
        found = [failed(name, *given) for _ in range(4)]
        assert found[0][0] == str(expected.value)
        assert found[0][1] == expected.value.__notes__
        assert all(one[:2] == found[0][:2] for one in found)
        assert len({id(one[2]) for one in found}) == 4
        found[3][2].add_note("of the script")
        assert failed(name, *given)[1] == found[0][1], "a script's notes stay with its exception"
        one = failed(name, *given)[2]
        assert one.__context__ is None
        assert one.__cause__ is None
    try:
        raise KeyError(1)
    except KeyError as first:
        assert failed("getBodyInfo", 7)[2].__context__ is first


def test_errors_follow_what_makes_bodies_and_constraints(box: int) -> None:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    for _ in range(3):
        assert [failed("getBodyInfo", 1)[1] for _ in range(3)] == [["there is no body 1; bodies: 0"]] * 3
        for _ in range(3):
            failed("getBasePositionAndOrientation", 1)
            failed("getDynamicsInfo", 1, -1)
            failed("getConstraintInfo", 1)
        assert p.createMultiBody(1.0, shape, basePosition=[0, 0, 2]) == 1
        assert p.getBodyInfo(1)[0]
        assert p.getBasePositionAndOrientation(1)[0] == (0, 0, 2)
        assert p.getDynamicsInfo(1, -1)[0] == 1.0
        assert failed("getBasePositionAndOrientation", 2)[1] == ["there is no body 2; bodies: 0, 1"]
        nowhere = [0, 0, 0]
        made = p.createConstraint(1, -1, -1, -1, p.JOINT_POINT2POINT, nowhere, nowhere, nowhere)
        assert p.getConstraintInfo(made)[4] == p.JOINT_POINT2POINT
        p.removeConstraint(made)
        for _ in range(3):
            failed("getConstraintInfo", made)
        p.resetSimulation()
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        p.createMultiBody(1.0, shape)


def test_errors_of_two_clients_are_their_own(box: int) -> None:
    other = p.connect(p.DIRECT)
    for _ in range(4):
        failed("getBodyInfo", 1)
        with pytest.raises(p.error, match="Couldn't get body info"):
            p.getBodyInfo(0, physicsClientId=other)
        assert p.getBodyInfo(0)[0]
    p.createMultiBody(1.0, physicsClientId=other)
    assert p.getBodyInfo(0, physicsClientId=other)[0]
    p.disconnect(other)


def test_repeated_detection_finds_the_same(box: int) -> None:
    settled_boxes(box)
    p.performCollisionDetection()
    once = contacts()
    assert len(once) >= 12
    p.performCollisionDetection()
    assert contacts() == once
    python("performCollisionDetection")()  # which always detects
    assert contacts() == once


def test_detection_is_repeated_after_whatever_changes_contacts(box: int) -> None:
    boxes = settled_boxes(box)
    state = p.saveState()
    changes: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
        ("resetBasePositionAndOrientation", (boxes[2], [3, 0, 3], [0, 0, 0, 1]), {}),
        ("restoreState", (state,), {}),
        ("setCollisionFilterPair", (boxes[0], boxes[1], -1, -1, 0), {}),
        ("setCollisionFilterPair", (boxes[0], boxes[1], -1, -1, 1), {}),
        ("setCollisionFilterGroupMask", (boxes[1], -1, 0, 0), {}),
        ("setCollisionFilterGroupMask", (boxes[1], -1, 1, 1), {}),
        ("stepSimulation", (), {}),
        ("removeBody", (boxes[2],), {}),
        ("createMultiBody", (1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0.9, 0.05]), {}),
        ("loadURDF", (f"{getDataPath()}/cube_small.urdf", [0, 1.9, 0.02]), {}),
        ("resetSimulation", (), {}),
    ]
    for name, given, keywords in changes:
        p.performCollisionDetection()
        before = contacts()
        getattr(p, name)(*given, **keywords)
        p.performCollisionDetection()
        found = contacts()
        python("performCollisionDetection")()  # which always detects
        assert contacts() == found, name
        assert found != before, name


def test_detections_of_two_clients_are_their_own(box: int) -> None:
    other = BulletClient(p.DIRECT)
    shape = other.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    for x in (0.0, 0.15):
        other.createMultiBody(1.0, shape, basePosition=[x, 0, 0])
    p.performCollisionDetection()
    other.performCollisionDetection()
    assert (len(contacts()), len(other.getContactPoints())) == (0, 1)
    other.resetBasePositionAndOrientation(1, [1, 0, 0], [0, 0, 0, 1])
    other.performCollisionDetection()
    assert len(other.getContactPoints()) == 0
    other.disconnect()


def test_each_client_has_its_own_answers(box: int) -> None:
    other = p.connect(p.DIRECT)
    assert (p.getNumBodies(), p.getNumBodies(physicsClientId=other)) == (1, 0)
    p.createMultiBody(1.0, physicsClientId=other)
    p.createMultiBody(1.0, physicsClientId=other)
    assert (p.getNumBodies(), p.getNumBodies(physicsClientId=other)) == (1, 2)
    p.disconnect(other)
    with pytest.raises(p.error, match="Not connected"):
        p.getNumBodies(physicsClientId=other)
    assert p.connect(p.DIRECT) == other
    assert p.getNumBodies(physicsClientId=other) == 0
    p.disconnect(other)


def test_logged_commands_are_seen_by_the_log(box: int, tmp_path: Any) -> None:
    p.stepSimulation()
    log = p.startStateLogging(p.STATE_LOGGING_ALL_COMMANDS, str(tmp_path / "commands"))
    p.resetBasePositionAndOrientation(box, [0, 0, 5], [0, 0, 0, 1])
    p.stopStateLogging(log)
    p.resetBasePositionAndOrientation(box, [0, 0, 2], [0, 0, 0, 1])
    assert direct_calls.DIRECT
    p.stopStateLogging(p.startStateLogging(p.STATE_REPLAY_ALL_COMMANDS, str(tmp_path / "commands")))
    assert p.getBasePositionAndOrientation(box)[0] == (0, 0, 5)


def test_objects_are_released(box: int) -> None:
    body, vector, wrong = 10**20, [0.5, 1.5, 2.5], object()
    counts = []
    for _ in range(3):
        for _ in range(100):
            p.getNumJoints(body)
            p.resetBaseVelocity(box, vector, physicsClientId=0)
            p.resetBaseVelocity(box, physicsClientId=0, angularVelocity=vector)
            p.rayTest(wrong, vector)
            for call, given in ((p.getNumJoints, (wrong,)), (p.getQuaternionFromEuler, (wrong,))):
                with pytest.raises((TypeError, p.error)):
                    call(*given)
        gc.collect()
        counts.append([sys.getrefcount(one) for one in (body, vector, wrong, p.getNumBodies)])
    assert counts[0] == counts[1] == counts[2]


def test_answers_that_are_kept_are_of_commands_that_change_none() -> None:
    assert set(COMMANDS) >= {*command_names.KEPT_ANSWERS, *command_names._HARMLESS, *command_names._CHANGED}
    assert not any(map(command_names.changed_answers, command_names.KEPT_ANSWERS))
    for name in ("createMultiBody", "removeBody", "resetSimulation", "restoreState"):
        assert len(command_names.changed_answers(name)) == command_names.KINDS
        assert command_names.CONTACTS in command_names.changed_answers(name)
    assert set(COMMANDS) >= command_names._UNMOVING


def test_loads_name_all_commands_that_they_replace(monkeypatch: pytest.MonkeyPatch) -> None:
    assert all(COMMANDS[name] for name in COMMANDS), "all modules are imported"
    replaced: list[str] = []
    monkeypatch.setattr(direct_calls.START, "replace", lambda name, _: replaced.append(name))
    groups = [(load, commands) for load, commands in direct_calls.START.waiting if commands]
    assert len(groups) > 20
    for load, commands in groups:
        replaced.clear()
        load()
        assert set(replaced) == set(commands)


FEW_CALLS = """
import sys
import roboyard.pybullet as p
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.fast import fast_commands

ENTRIES = "roboyard.pybullet.fast.link_entries"
p.connect(p.DIRECT)
box = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0, 1], linkMasses=[1],
    linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 1]],
    linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
    linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0], linkJointTypes=[p.JOINT_FIXED],
    linkJointAxis=[[0, 0, 1]])
state = p.getLinkState(box, 0)
for k in range(direct_calls.MANY):
    p.resetBaseVelocity(box, [0, 0, 0], [0, 0, 0])
assert ENTRIES not in sys.modules
for k in range(2 * fast_commands.FEW):
    assert p.getLinkState(box, 0) == state
assert ENTRIES in sys.modules
print(fast_commands.is_machine_code("getLinkState"), fast_commands.is_machine_code("getLinkStates"))
"""


def test_machine_code_is_loaded_for_what_a_program_calls_some_times() -> None:
    done = subprocess.run([sys.executable, "-c", FEW_CALLS], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.stdout == "True False\n"
