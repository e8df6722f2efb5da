"""Bases, torques, contacts, texts and user data by machine code are those of the Python functions."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(scope="module", autouse=True)
def _machine_code() -> Iterator[None]:
    for module in ("base_entries", "contact_entries", "fast_entries", "item_entries", "data_entries"):
        loaded = import_module(f"roboyard.pybullet.fast.{module}")
        assert all(front.address() for front in vars(loaded).values() if isinstance(front, type(FRONT)))
    assert FRONT.address()
    few, fast_commands.FEW = fast_commands.FEW, 0
    direct_calls.START.enter(waits=False)
    for load in ("bases", "motors", "contacts", "lines", "user_data"):
        getattr(fast_commands, f"replace_{load}")()
    yield
    fast_commands.FEW = few


@pytest.fixture
def robot() -> Iterator[int]:
    assert p.connect(p.DIRECT) == 0
    p.setGravity(0, 0, -9.8)
    p.loadURDF(f"{getDataPath()}/plane.urdf")
    yield p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 0.5], [0.1, 0.2, 0.3, 0.9])
    p.disconnect()


def python(name: str, *given: Any) -> Any:
    return COMMANDS[name].function(CLIENTS[0], *given)


def outcome(call: Any, *given: Any) -> Any:
    try:
        return call(*given)
    except Exception as problem:
        return type(problem), str(problem)


def scene() -> Any:
    return CLIENTS[0].scene  # type: ignore[union-attr]


POSES: list[tuple[Any, ...]] = [
    ([1, 2, 3], [0, 0, 0, 1]),
    ((0.1, 0.2, 0.3), (0.1, 0.2, 0.3, 0.9)),
    (np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.5, -0.5, 0.5])),
    ([1, 2, 3], [0, 0, 0, 0]),
    ([1, 2], [0, 0, 0, 1]),
    ([1, 2, 3], [0, 0, 1]),
    ([1, 2, float("nan")], [0, 0, 0, 1]),
    ([1, 2, "3"], [0, 0, 0, 1]),
    (None, [0, 0, 0, 1]),
]


@pytest.mark.parametrize("given", POSES)
def test_bases_are_put_where_the_python_function_puts_them(robot: int, given: tuple[Any, ...]) -> None:
    found = []
    for call in (p.resetBasePositionAndOrientation, p.resetBasePositionAndOrientation.__self__):
        python("resetBasePositionAndOrientation", robot, [0, 0, 1], [0, 0, 0, 1])
        python("resetBaseVelocity", robot, [1, 2, 3], [4, 5, 6])
        p.stepSimulation()
        world = scene().world
        state = outcome(call, robot, *given), world.live_data.qpos.copy(), world.live_data.qvel.copy()
        found.append((*state, world.is_moved, scene().frames_are_old))
    assert found[0][0] == found[1][0]
    base = slice(scene().bodies[robot].body.free_qpos, None)
    for one, other in zip(found[0][1:3], found[1][1:3], strict=True):  # joints move on a little between
        np.testing.assert_allclose(one[base][:6], other[base][:6], rtol=0, atol=1e-9)
    assert found[0][3:] == found[1][3:]


@pytest.mark.parametrize(
    "given",
    [
        ([1, 2, 3], [4, 5, 6]),
        ([1, 2, 3],),
        (None, [0.1, 0.2, 0.3]),
        ((0, 0, 0), (0, 0, 0)),
        (np.array([1.0, 2.0, 3.0]), None),
        ([1, 2], [4, 5, 6]),
        ([1, 2, float("inf")], None),
        (None, None),
        (5, None),
    ],
)
def test_velocities_of_bases_are_those_of_the_python_function(robot: int, given: tuple[Any, ...]) -> None:
    found = []
    for call in (p.resetBaseVelocity, p.resetBaseVelocity.__self__):
        python("resetBasePositionAndOrientation", robot, [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
        python("resetBaseVelocity", robot, [0.3, 0.2, 0.1], [0.4, -0.5, 0.6])
        found.append((outcome(call, robot, *given), scene().world.live_data.qvel.copy()))
    assert found[0][0] == found[1][0]
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=0, atol=1e-14)
    if found[0][0] is None and np.size(given[0]) == 3:
        np.testing.assert_allclose(p.getBaseVelocity(robot)[0], given[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "velocities",
    [None, [[1.0], [2.0], [-3.0]], [[1], [2], [3]], [(), (), ()], [[1.0], [float("nan")], [2.0]], [[1.0]]],
)
def test_joints_that_are_set_together_are_as_set_one_by_one(robot: int, velocities: Any) -> None:
    joints, positions = [2, 3, 6], [[0.1], [0.2], [-0.3]]
    given = (positions, velocities) if velocities is not None else (positions,)
    found = outcome(p.resetJointStatesMultiDof, robot, joints, *given)
    assert found is None or found[0] is p.error
    if found is not None:
        return
    for place, joint in enumerate(joints):
        speed = velocities[place][0] if velocities and velocities[place] else 0.0
        assert p.getJointState(robot, joint)[:2] == (positions[place][0], float(speed))


def test_torques_add_up_as_by_the_python_function(robot: int) -> None:
    calls: list[tuple[Any, ...]] = [
        ([2, 3], [1.0, 2.0]),
        (range(4), np.array([0.1, 0.2, 0.3, 0.4])),
        ((2, 2), (1, 2)),
        ([2, 99], [1, 2]),
        ([2, 3], [1]),
        ([2], ["1"]),
        ([2.5], [1.0]),
        ([], []),
        ([2], [float("nan")]),
    ]
    p.setJointMotorControlArray(robot, [2, 3], p.TORQUE_CONTROL, forces=[0, 0])
    for joints, torques in calls:
        found = []
        for call in (p.setJointMotorControlArray, p.setJointMotorControlArray.__self__):
            p.stepSimulation()
            given = robot, joints, p.TORQUE_CONTROL, None, None, torques
            answer = outcome(call, *given)
            efforts = scene().world.live_data.qfrc_applied.copy()
            found.append((answer, efforts.tolist(), scene().world.wrenches.pending))
        assert found[0] == found[1]


def test_contacts_are_those_of_the_python_function(robot: int) -> None:
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    boxes = [p.createMultiBody(1, box, -1, [1, 0, 0.1 + 0.2 * k]) for k in range(3)]
    draw, some = random.Random(1), 0
    for step in range(120):
        p.stepSimulation()
        for given in ((), (robot,), (-1, robot), (boxes[0], boxes[1]), (robot, -1, 0), (0, -1, -1, 0), (99,)):
            expected = python("getContactPoints", *given)
            assert p.getContactPoints(*given) == p.getContactPoints(*given) == expected
            some += len(expected)
        assert outcome(p.getContactPoints, 1.5) == outcome(p.getContactPoints.__self__, 1.5)
        if step % 10 == 9:
            change = draw.choice(
                [
                    lambda: p.setCollisionFilterGroupMask(boxes[2], -1, 1, 1),
                    lambda: p.changeDynamics(boxes[1], -1, collisionMargin=0.01),
                    lambda: p.setPhysicsEngineParameter(numSubSteps=draw.choice([0, 3])),
                    lambda: p.createMultiBody(1, box, -1, [1.05, 0, 1.0]),
                    lambda: p.resetBasePositionAndOrientation(boxes[0], [3, 0, 0.1], [0, 0, 0, 1]),
                    p.performCollisionDetection,
                ]
            )
            change()
            assert p.getContactPoints() == python("getContactPoints")
    assert some > 100


def test_texts_are_those_of_the_python_function() -> None:
    a, color = [0, 0, 1], (1, 0.5, 0)
    calls: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
        (("text", a), {}),
        (("other", np.array(a), color, 2), {"replaceItemUniqueId": 0}),
        (("t", a), {"parentObjectUniqueId": 3, "parentLinkIndex": 2}),
        (("t", a), {"parentObjectUniqueId": 3}),
        (("t", a), {"parentObjectUniqueId": -7, "replaceItemUniqueId": 99}),
        (("t", a), {"lifeTime": 50.0}),
        (("t", a), {"textOrientation": [0, 0, 0, 1]}),
        (("t", a, [1, 1]), {}),
        (("t", [1, 2]), {}),
        (("t", [1, 2, float("nan")]), {}),
        ((b"t", a), {}),
        (("t", a), {"textSize": "2"}),
        (("t", a), {"parentObjectUniqueId": 0.5}),
        (("t",), {}),
    ]
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        call = p.addUserDebugText.__self__ if is_python else p.addUserDebugText
        for given, keywords in calls:
            try:
                outcomes.append(call(*given, **keywords))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        items: Any = CLIENTS[0].debug_items  # type: ignore[union-attr]
        assert items.has_expiring
        outcomes.append(repr([(n, *text[:6], text.expires is None) for n, text in items.drawings()]))
        p.disconnect()
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


def test_user_data_come_and_go_as_by_the_python_functions() -> None:
    calls: list[tuple[str, tuple[Any, ...]]] = [
        *[("addUserData", (0, key, f"{key} value")) for key in ("a", "b", "c")],
        *(("getUserDataId", (0, "b")), ("getUserDataId", (0, "b", 1)), ("getUserDataId", (0, "no", -1, -1))),
        *(("getUserData", (1,)), ("getUserData", (77,)), ("getUserData", (1.5,)), ("removeUserData", (1,))),
        *(("getUserData", (1,)), ("removeUserData", (1,)), ("removeUserData", (0,))),
        *(("getNumUserData", (0,)), ("addUserData", (0, "d", "x"))),
        *(("addUserData", (0, "e", "y", 0, 2)), ("addUserData", (0, "f", "z"))),
        *(("getUserDataInfo", (0, 0)), ("getUserDataInfo", (0, 1)), ("getUserDataId", (0, b"d"))),
        *(("addUserData", (5, "d", "x")), ("addUserData", (0, "d", "\ud800")), ("getNumUserData", (0,))),
    ]
    outcomes: list[Any] = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        p.loadURDF(f"{getDataPath()}/cube_small.urdf")
        for name, given in calls:
            call = getattr(p, name).__self__ if is_python else getattr(p, name)
            outcomes.append(outcome(call, *given))
        p.removeBody(0)
        outcomes.append(p.getNumUserData(0))
        p.disconnect()
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


_REPLACED = f"""
import roboyard.pybullet as p
p.connect(p.DIRECT)
cube = p.loadURDF("{getDataPath()}/cube_small.urdf")
data = p.addUserData(cube, "key", "value")
for _ in range(1500):
    p.getNumBodies()
for k in range(300):
    assert p.addUserData(cube, "key", str(k)) == data
    assert p.getUserData(data) == str(k).encode()
print("all")
"""


def test_a_command_that_is_replaced_while_it_is_called_keeps_its_answer() -> None:
    environment = {**os.environ, "PYTHONMALLOC": "debug"}
    done = subprocess.run([sys.executable, "-c", _REPLACED], capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stdout.split()) == (0, ["all"]), done.stderr
