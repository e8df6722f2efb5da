"""Commands that are machine code as a whole agree with their Python functions in all states of a world."""

from __future__ import annotations

import contextlib
import functools
import gc
import random
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.sim.colliding_links import colliding_links

import roboyard.pybullet as p
from roboyard.native.fronts import Front
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet import fast
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands, fast_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(scope="module", autouse=True)
def _machine_code() -> Iterator[None]:
    found = walk_packages(fast.__path__, f"{fast.__name__}.")
    modules = [import_module(module.name) for module in found]
    entries = [value for module in modules for value in vars(module).values() if isinstance(value, Front)]
    assert len(entries) > 10
    assert all(front.address() for front in (FRONT, *entries)), "compiled and stored now, if not before"
    few, fast_commands.FEW = fast_commands.FEW, 0
    direct_calls.START.enter(waits=False)
    fast_commands.replace_pushes()
    fast_commands.replace_boxes()
    fast_commands.replace_motors()
    fast_commands.replace_dynamics()
    yield
    fast_commands.FEW = few


@pytest.fixture
def robot() -> Iterator[int]:
    assert p.connect(p.DIRECT) == 0
    p.setGravity(0, 0, -9.8)
    p.loadURDF(f"{getDataPath()}/plane.urdf")
    yield p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
    p.disconnect()


def python(name: str, *given: Any) -> Any:
    return COMMANDS[name].function(CLIENTS[0], *given)


def forces() -> np.ndarray:
    data = CLIENTS[0].scene.world.live_data  # type: ignore[union-attr]
    found = data.xfrc_applied.copy()
    data.xfrc_applied[:] = 0.0
    return found


PUSHES: list[tuple[str, tuple[Any, ...]]] = [
    (name, (link, *vectors, frame))
    for link in (-1, 0, 3, 7)
    for frame in (p.LINK_FRAME, p.WORLD_FRAME)
    for name, vectors in (
        ("applyExternalForce", ([1.0, -2.0, 3], [0.1, 0.2, 0.3])),
        ("applyExternalForce", ((0, 0, 1), np.array([0.5, 0.0, 0.1]))),
        ("applyExternalTorque", ([0.3, 0.2, -0.1],)),
    )
]


@pytest.mark.parametrize(("name", "given"), PUSHES)
def test_pushes_are_those_of_the_python_function(robot: int, name: str, given: tuple[Any, ...]) -> None:
    expected = np.zeros(0)
    for moves in (
        p.stepSimulation,
        lambda: p.getLinkState(robot, 2),
        lambda: p.resetBasePositionAndOrientation(robot, [1, 0, 2], [0, 0.6, 0, 0.8]),
        lambda: p.resetJointState(robot, 1, 0.4),
        lambda: p.getLinkState(robot, 2, computeForwardKinematics=1),
        lambda: p.createMultiBody(1.0),
        lambda: p.removeBody(p.getBodyUniqueId(p.getNumBodies() - 1)),
    ):
        moves()
        for _ in range(2):
            python(name, robot, *given)
            expected = forces()
            getattr(p, name)(robot, *given)
            np.testing.assert_array_equal(forces(), expected)
            getattr(p, name)(robot, *given[:-1], flags=given[-1], physicsClientId=0)
            np.testing.assert_array_equal(forces(), expected)
    assert expected.any()


def test_pushed_bodies_move_with_the_next_step_alone(robot: int) -> None:
    p.setGravity(0, 0, 0)
    for _ in range(3):
        before = p.getBaseVelocity(robot)[0][0]
        p.applyExternalForce(robot, -1, [100, 0, 0], [0, 0, 0], p.LINK_FRAME)
        p.stepSimulation()
        between = p.getBaseVelocity(robot)[0][0]
        p.stepSimulation()
        assert between > before + 1e-3
        assert p.getBaseVelocity(robot)[0][0] == pytest.approx(between, rel=0.02)


@pytest.mark.parametrize(
    "given",
    [
        (99, -1, [0, 0, 1], [0, 0, 0], 1),
        (1, 99, [0, 0, 1], [0, 0, 0], 1),
        (1, -2, [0, 0, 1], [0, 0, 0], 1),
        (1, -1, [0, 0, 1], [0, 0, 0], 3),
        (1, -1, [0, 0, 1], [0, 0, 0], 1.0),
        (1, 0.0, [0, 0, 1], [0, 0, 0], 1),
        (1, -1, [0, 0], [0, 0, 0], 1),
        (1, -1, [0, 0, "1"], [0, 0, 0], 1),
        (1, -1, "123", [0, 0, 0], 1),
        (1, -1, [0, 0, float("inf")], [0, 0, 0], 1),
        (1, -1, [0, 0, 1], None, 1),
        ([1], -1, [0, 0, 1], [0, 0, 0], 1),
        (1, -1, [0, 0, 1]),
    ],
)
def test_irregular_pushes_have_the_same_outcome(robot: int, given: tuple[Any, ...]) -> None:
    p.applyExternalForce(robot, -1, [0, 0, 1], [0, 0, 0], 1)
    forces()

    def outcome(call: Any) -> Any:
        try:
            call(*given)
        except Exception as problem:
            return type(problem).__mro__[-3:], str(problem), forces().tolist()
        return forces().tolist()

    assert outcome(p.applyExternalForce) == outcome(p.applyExternalForce.__self__)


def test_boxes_are_those_of_the_python_function(robot: int) -> None:
    for moves in (
        p.stepSimulation,
        lambda: p.resetBasePositionAndOrientation(robot, [1, 0, 2], [0, 0.6, 0, 0.8]),
        lambda: p.changeDynamics(robot, 3, collisionMargin=0.3),
        lambda: p.createMultiBody(1.0),
        p.stepSimulation,
    ):
        moves()
        for link in (-1, 0, 3, 3, 8):
            for body in (0, robot):
                if body or link == -1:
                    expected = python("getAABB", body, link)
                    for found in (p.getAABB(body, link), p.getAABB(body, link, physicsClientId=0)):
                        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)
        np.testing.assert_allclose(p.getAABB(robot), python("getAABB", robot), rtol=0, atol=1e-14)
    for wrong in ((robot, 99), (robot, -2), (robot, 1.0), (99,), (-1,), ("a",)):
        with pytest.raises((TypeError, p.error)):
            p.getAABB(*wrong)


@pytest.mark.parametrize("fixed", [False, True])
def test_dynamics_are_those_of_the_python_function(robot: int, fixed: bool) -> None:
    if fixed:
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [3, 0, 1], [0.1, 0.2, 0.3, 0.9], useFixedBase=True)
    rng = np.random.default_rng(1)
    joints = sum(p.getJointInfo(robot, k)[2] != p.JOINT_FIXED for k in range(p.getNumJoints(robot)))
    sizes = (joints,) * 3 if fixed else (joints + 7, joints + 6, joints + 6)
    found = set()
    for moves in (
        p.stepSimulation,
        lambda: p.setGravity(1, 2, -3),
        lambda: p.resetBasePositionAndOrientation(robot, [1, 0, 2], [0, 0.6, 0, 0.8]),
        lambda: p.changeDynamics(robot, 3, mass=7.0),
        lambda: p.createMultiBody(1.0),
        p.stepSimulation,
    ):
        moves()
        for kind in (list, tuple, np.array):
            lists = [kind(rng.normal(size=size).tolist()) for size in sizes]
            for name, given in (
                ("calculateInverseDynamics", lists),
                ("calculateInverseDynamics", [*lists, 0]),
                ("calculateMassMatrix", [lists[0][-joints:]]),
                ("calculateMassMatrix", [[*lists[0], 1.0]]),
            ):
                expected = python(name, robot, *given)
                assert getattr(p, name)(robot, *given) == expected
                assert getattr(p, name)(robot, *given, physicsClientId=0) == expected
                found.add(expected)
    assert len(found) > 30


def test_irregular_dynamics_have_the_same_outcome(robot: int) -> None:
    count = sum(p.getJointInfo(robot, k)[2] != p.JOINT_FIXED for k in range(p.getNumJoints(robot)))
    lists = [0.1] * (count + 7), [0.2] * (count + 6), [0.3] * (count + 6)

    def outcome(call: Any, given: tuple[Any, ...]) -> Any:
        try:
            return repr(call(*given))
        except Exception as problem:
            return type(problem).__mro__[-3:], str(problem)

    for given in (
        (robot, *lists[:2], [0.3]),
        (robot, *lists[:2], [float("nan")] * (count + 6)),
        (robot, *lists[:2], ["1"] * (count + 6)),
        (robot, *lists[:2], 7),
        (robot, *lists, 1),
        (robot, *lists, None),
        (99, *lists),
        ([], *lists),
        (robot, *lists[:2]),
    ):
        for call in (p.calculateInverseDynamics, p.calculateMassMatrix):
            few = given if call is p.calculateInverseDynamics else (given[0], given[-1])
            call(*((robot, *lists) if call is p.calculateInverseDynamics else (robot, lists[0])))
            assert outcome(call, few) == outcome(call.__self__, few)


def test_bodies_of_another_world_are_not_mistaken(robot: int) -> None:
    p.stepSimulation()
    box, expected = p.getAABB(robot), []
    p.resetSimulation()
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
    bodies = [p.createMultiBody(1.0, shape, basePosition=[k, 0, 0]) for k in range(2)]
    expected = [python("getAABB", body) for body in bodies]
    assert [p.getAABB(body) for body in bodies] == expected
    assert box not in expected
    other = p.connect(p.DIRECT)
    with pytest.raises(p.error):
        p.getAABB(bodies[0], physicsClientId=other)
    p.disconnect(other)


def test_objects_are_released(robot: int) -> None:
    p.stepSimulation()
    vector, scene = [0.25, 1.5, 2.5], CLIENTS[0].scene  # type: ignore[union-attr]
    counts = []
    for _ in range(3):
        for _ in range(200):
            p.applyExternalForce(robot, -1, vector, vector, p.LINK_FRAME)
            p.applyExternalTorque(robot, 2, vector, p.LINK_FRAME)
            p.getAABB(robot, 2)
        gc.collect()
        counts.append([sys.getrefcount(one) for one in (vector, scene, scene.world, scene.world.wrenches)])
    assert counts[0] == counts[1] == counts[2]


def motors(robot: int) -> list[list[Any]]:
    """Return what the motors of a robot aim at, and their bounds, with all pending commands."""
    scene = CLIENTS[0].scene  # type: ignore[union-attr]
    scene.flush_motors()
    own = scene.world.motors.of(scene.bodies[robot].body)
    return [own.motors.tolist(), own.targets.tolist(), own.bounds.tolist()]


def test_motors_are_those_of_the_python_function(robot: int) -> None:
    draw = random.Random(1)
    movable = [k for k in range(p.getNumJoints(robot)) if p.getJointInfo(robot, k)[2] != p.JOINT_FIXED]
    changes = (
        lambda: p.setTimeStep(1 / draw.choice([100, 240])),
        lambda: p.createMultiBody(1.0),
        lambda: p.setJointMotorControl2(robot, movable[0], p.VELOCITY_CONTROL, force=draw.choice([0, 3])),
        lambda: p.setJointMotorControl2(robot, movable[1], p.POSITION_CONTROL, 0.2, force=7),
        lambda: p.removeBody(p.getBodyUniqueId(p.getNumBodies() - 1)) if p.getNumBodies() > 2 else None,
    )
    name = "setJointMotorControlArray"
    for step in range(300):
        joints: Any = draw.choice([movable, movable[:2], [0, 2, 3], [5], range(4), [movable[0]] * 2])
        count = len(joints)
        given: list[Any] = [None] * 5
        for place in range(5):
            if draw.random() < 0.5:
                given[place] = [draw.choice([0, 1, -0.3, 0.7]) for _ in range(count)]
        given[2] = draw.choice([None, [5.0] * count, [draw.choice([5, 6]) for _ in range(count)]])
        mode = draw.choice([p.POSITION_CONTROL, p.POSITION_CONTROL, p.VELOCITY_CONTROL])
        found = []
        for call in (functools.partial(python, name), p.setJointMotorControlArray):
            for _ in range(2):  # bounds are known to the second one
                python(name, robot, movable, p.POSITION_CONTROL, [0.01 * step] * len(movable))
                call(robot, joints, mode, *given)
                found.append(motors(robot))
        p.setJointMotorControlArray(robot, joints, mode, *given)  # machine code: nothing else came between
        assert all(one == found[0] for one in (*found, motors(robot)))
        if step % 7 == 0:
            draw.choice(changes)()
        if step % 3 == 0:
            p.stepSimulation()


@pytest.mark.parametrize(
    "given",
    [
        ([0, 2], 2, [0.1]),
        ([0, 99], 2, [0.1, 0.2]),
        ([2, -1], 2, [0.1, 0.2]),
        ([2, 3], 2, [0.1, "a"]),
        ([2, 3], 2, [0.1, float("nan")]),
        ([2, 3], 9, [0.1, 0.2]),
        ([2, 3], 2.0, [0.1, 0.2]),
        ([2.0, 3], 2, [0.1, 0.2]),
        ("23", 2, [0.1, 0.2]),
        (2, 2, [0.1]),
        ([2, 3], 2, [0.1, 0.2], None, [1.0]),
        ([2, 3], 2, [0.1, 0.2], None, [0.0, 1.0]),
        ([2, 3], 2, [0.1, 0.2], None, [-1.0, 1.0]),
        ([2, 3], 1, None, None, [0.1, 0.2]),
        ([], 2, []),
    ],
)
def test_irregular_motor_commands_have_the_same_outcome(robot: int, given: tuple[Any, ...]) -> None:
    outcomes = []
    for call in (p.setJointMotorControlArray, p.setJointMotorControlArray.__self__):
        for _ in range(3):
            p.setJointMotorControlArray(robot, [2, 3], p.POSITION_CONTROL, [0.3, 0.4], forces=[5, 6])
        try:
            outcomes.append(call(robot, *given))
        except Exception as problem:
            outcomes.append((type(problem), str(problem)))
        outcomes[-1] = outcomes[-1], motors(robot)
    assert outcomes[0] == outcomes[1]


def test_commands_are_compiled_after_many_calls(robot: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without stored code the Python function is called, and counted, until the code is worth compiling."""
    made = fast_entries.BOX.address()
    for can_be_kept in (False, True):
        stand_in = SimpleNamespace(is_stored=False, is_cheap=can_be_kept, address=lambda: made)
        monkeypatch.setattr(fast_entries, "BOX", stand_in)
        monkeypatch.setattr(fast_commands, "MOST", 5)
        monkeypatch.setattr(fast_commands, "_machine_code", set())
        fast_commands.replace_boxes()
        for call in range(8):
            assert p.getAABB(robot, 2) == python("getAABB", robot, 2)
            assert fast_commands.is_machine_code("getAABB") == (can_be_kept and call >= 4)
    monkeypatch.undo()
    fast_commands.replace_boxes()


def test_stored_machine_code_is_loaded_after_a_few_calls(robot: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fast_commands, "FEW", 4)
    monkeypatch.setattr(fast_commands, "_machine_code", set())
    fast_commands.replace_boxes()
    for call in range(8):
        assert p.getAABB(robot, 2) == python("getAABB", robot, 2)
        assert fast_commands.is_machine_code("getAABB") == (call >= 3)
    monkeypatch.undo()
    fast_commands.replace_boxes()


FORMS: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
    ((2, [0.3]), {}),
    ((2, (0.3,)), {"force": [5]}),
    ((2, [0.3]), {"targetVelocity": [0.1], "force": [5.0], "positionGain": 0.2, "velocityGain": 0.4}),
    ((2, [0.3]), {"force": [5], "maxVelocity": 1.0}),
    ((2, [0.3]), {"force": [5], "damping": 0.5}),
    ((2, [0.3]), {"force": [5], "damping": 1}),
    ((2, [0.3]), {"force": [5], "positionGain": 1}),
    ((2, [0.3]), {"force": [7]}),
    ((2, [0.3]), {"force": [0.0]}),
    ((2, []), {}),
    ((2, [0.1, 0.2]), {}),
    ((2, "a"), {}),
    ((2, [float("nan")]), {}),
    ((2, np.array([99.0])), {}),
    ((0, [0.3]), {"force": [5]}),
    ((2.0, [0.3]), {}),
    ((1,), {"targetVelocity": [0.3]}),
]
"""Mode and position after the joint, and keywords."""


@pytest.mark.parametrize(("given", "keywords"), FORMS)
def test_motors_of_joints_of_any_kind_are_those_of_the_python_function(
    robot: int, given: tuple[Any, ...], keywords: dict[str, Any]
) -> None:
    outcomes = []
    mode, *positions = given
    lists = {name + "s": [value, value] for name, value in keywords.items() if name != "damping"}
    lists["maxVelocities"] = lists.pop("maxVelocitys", None)
    for is_python in (False, True):
        for joints in (2, 1, 99, 3.0):
            for name, called, places, names in (
                ("setJointMotorControlMultiDof", joints, positions, keywords),
                ("setJointMotorControlMultiDofArray", [joints, 3], [[q, q] for q in positions], lists),
            ):
                call = getattr(p, name)
                for _ in range(3):
                    p.setJointMotorControlMultiDof(robot, 2, p.POSITION_CONTROL, [0.2], force=[5])
                    p.setJointMotorControlMultiDofArray(robot, [2, 3], 2, [[0.3], [0.4]], forces=[[5], [6]])
                try:
                    call = call.__self__ if is_python else call
                    outcomes.append(call(robot, called, mode, *places, **names))
                except Exception as problem:
                    outcomes.append((type(problem), str(problem)))
                outcomes[-1] = outcomes[-1], motors(robot)
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


def settings() -> Any:
    client: Any = CLIENTS[0]
    parameters, view = client.parameters, client.visualizer
    names = [name for name in type(parameters).__dataclass_fields__ if name != "others"]
    return (
        {name: getattr(parameters, name) for name in names},
        dict(parameters.others),
        *(view.distance, view.yaw, view.pitch, view.target, view.up_axis),
        *(dict(view.switches), dict(view.settings)),
    )


@pytest.mark.parametrize(
    ("name", "given", "keywords"),
    [
        ("setGravity", (0, 1.5, -9.8), {}),
        ("setGravity", (0, True, np.float64(2)), {}),
        ("setGravity", (0, 1), {"gravZ": -3}),
        ("setGravity", (0, float("inf"), 0), {}),
        ("setGravity", (0, "1", 0), {}),
        ("setGravity", (0, 1), {}),
        ("setGravity", (0, 1, 2, 3, 4), {}),
        ("setTimeStep", (0.01,), {}),
        ("setTimeStep", (1,), {}),
        ("setTimeStep", (float("nan"),), {}),
        ("setTimeStep", (10**400,), {}),
        ("setTimeStep", (), {"timeStep": 0.02, "physicsClientId": 0}),
        ("setTimeStep", (0.02,), {"physicsClientId": 7}),
        ("setRealTimeSimulation", (1,), {}),
        ("setRealTimeSimulation", (True,), {}),
        ("setRealTimeSimulation", (0.5,), {}),
        ("setDefaultContactERP", (0.3,), {}),
        ("setDefaultContactERP", (None,), {}),
        ("setTimeOut", (3,), {}),
        ("setTimeOut", ("3",), {}),
        ("setPhysicsEngineParameter", (), {}),
        ("setPhysicsEngineParameter", (0.005, 20), {}),
        ("setPhysicsEngineParameter", (), {"numSolverIterations": 30, "numSubSteps": 4}),
        ("setPhysicsEngineParameter", (), {"numSubSteps": 20000, "erp": 0.5}),
        ("setPhysicsEngineParameter", (), {"numSolverIterations": 30.5, "erp": 0.5}),
        ("setPhysicsEngineParameter", (), {"erp": 1, "contactERP": 0.5, "enableConeFriction": 0}),
        ("setPhysicsEngineParameter", (), {"erp": -2.0, "contactERP": 0.4}),
        ("setPhysicsEngineParameter", (), {"fixedTimeStep": float("inf")}),
        ("setPhysicsEngineParameter", (), {"restitutionVelocityThreshold": 1}),
        ("setPhysicsEngineParameter", (), {"nothing": 1}),
        ("setDebugObjectColor", ("any", None), {}),
        ("setDebugObjectColor", (0, 0, (1, 0.5, 0)), {}),
        ("setDebugObjectColor", (0, 0, np.ones(3)), {}),
        ("setDebugObjectColor", (0, 0), {"objectDebugColorRGB": [1, 0]}),
        ("setDebugObjectColor", (0, 0, [1, 0, "a"]), {}),
        ("configureDebugVisualizer", (), {}),
        ("configureDebugVisualizer", (p.COV_ENABLE_GUI, 0), {}),
        ("configureDebugVisualizer", (p.COV_ENABLE_GUI,), {}),
        ("configureDebugVisualizer", (p.COV_ENABLE_Y_AXIS_UP, 1), {}),
        ("configureDebugVisualizer", (-3, 1), {}),
        ("configureDebugVisualizer", (2, 0.5), {}),
        ("configureDebugVisualizer", (), {"enable": 1}),
        ("configureDebugVisualizer", (), {"rgbBackground": [1, 0, 0]}),
        ("configureDebugVisualizer", (2, 1), {"shadowMapResolution": 4}),
        ("resetDebugVisualizerCamera", (2, 30.1, -20.3, [0.1, 2, 3]), {}),
        ("resetDebugVisualizerCamera", (2, 30.1, -20.3), {"cameraTargetPosition": np.array([0.1, 2, 3])}),
        ("resetDebugVisualizerCamera", (1e300, 30.1, -20.3, (1, 2, 3)), {}),
        ("resetDebugVisualizerCamera", (2, 30.1, -20.3, (1, 2)), {}),
        ("resetDebugVisualizerCamera", (2, 30.1, -20.3, (1, 2, True)), {}),
        ("resetDebugVisualizerCamera", (2, "a", -20.3, (1, 2, 3)), {}),
    ],
)
def test_settings_are_those_of_the_python_function(
    name: str, given: tuple[Any, ...], keywords: dict[str, Any]
) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        call = getattr(p, name)
        try:
            outcomes.append((call.__self__ if is_python else call)(*given, **keywords))
        except Exception as problem:
            outcomes.append((type(problem), str(problem)))
        outcomes[-1] = repr((outcomes[-1], settings()))
        p.disconnect()
    assert outcomes[0] == outcomes[1]


@pytest.mark.parametrize(
    "given",
    [
        {"lateralFriction": 0.7},
        {"lateralFriction": 1, "spinningFriction": 0.2, "rollingFriction": 0.1},
        {"mass": 2.5},
        {"mass": 0},
        {"mass": 2, "lateralFriction": 0.2, "localInertiaDiagonal": [1, 2, 3]},
        {"linearDamping": 0.3, "angularDamping": 0.1},
        {"jointDamping": 0.4},
        {"jointDamping": 0.4, "restitution": 0.5},
        {"contactStiffness": 10.0},
        {"mass": 1.0, "lateralFriction": -0.5},
        {"mass": float("nan")},
        {"mass": True, "lateralFriction": np.float64(0.3)},
        {"lateralFriction": "1"},
        {"nothing": 1},
    ],
)
def test_changed_dynamics_are_those_of_the_python_function(given: dict[str, Any]) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
        p.stepSimulation()
        call = p.changeDynamics.__self__ if is_python else p.changeDynamics
        for body, link in ((robot, -1), (robot, 2), (robot, 99), (robot, -2), (9, 0), (robot, 1.0), ("a", 0)):
            try:
                outcomes.append(call(body, link, **given))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        model: Any = CLIENTS[0].scene.world.model  # type: ignore[union-attr]
        outcomes += [p.getDynamicsInfo(robot, link) for link in (-1, 2)]
        outcomes += [a.tolist() for a in (model.body_mass, model.body_inertia, model.geom_friction)]
        outcomes.append(model.dof_damping.tolist())
        p.stepSimulation()
        outcomes.append(p.getBaseVelocity(robot))
        p.disconnect()
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


@pytest.mark.parametrize("is_stale", [False, True])
@pytest.mark.parametrize(
    "change", [{}, {"localInertiaDiagonal": [1, 2, 3]}, {"collisionMargin": 0.3}, {"mass": 0}]
)
def test_dynamics_that_change_often_are_those_of_the_python_function(
    change: dict[str, Any], is_stale: bool
) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        p.setGravity(0, 0, -9.8)
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
        fixed = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [9, 0, 1], useFixedBase=True)
        cube = p.loadURDF(f"{getDataPath()}/cube_small.urdf", [1, 2, 1])
        call = p.changeDynamics.__self__ if is_python else p.changeDynamics
        world: Any = CLIENTS[0].scene.world  # type: ignore[union-attr]
        for step in range(3):
            p.stepSimulation()
            if is_stale:
                p.createMultiBody(0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [step, 5, 5])
                assert world.is_stale or step
            for body, link in ((robot, -1), (robot, 2), (fixed, -1), (fixed, 3), (cube, -1)):
                for k in (1, 2, 3, 2, 5):
                    call(body, link, mass=0.7 * k)
                    call(body, link, lateralFriction=0.1 * k, mass=0.3 * k)
                    if k == 3 and step:
                        call(body, link, **change)
                        call(body, link, spinningFriction=0.01 * step)
                    if k == 5:
                        call(body, link, mass=10**-9.0)
                        call(body, link, mass=2)
                handle = world.bodies[body].links[link + 1]
                outcomes += [handle.mass, handle.friction, *python("getDynamicsInfo", body, link)[:3]]
            if not world.is_stale:
                model = world.live_model
                outcomes += [model.body_mass, model.body_inertia, model.geom_friction]
            p.stepSimulation()
            outcomes += [np.array(p.getBaseVelocity(body)) for body in (robot, fixed, cube)]
        p.removeBody(robot)
        p.changeDynamics(cube, -1, lateralFriction=0.9)
        model = world.model
        outcomes += [model.body_mass.copy(), model.body_inertia.copy(), model.geom_friction.copy()]
        p.disconnect()
    half = len(outcomes) // 2
    for place, (one, other) in enumerate(zip(outcomes[:half], outcomes[half:], strict=True)):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-13, err_msg=f"outcome {place}")


def test_masses_and_frictions_that_change_often_act() -> None:
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -10)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.1])
    floor, box = p.createMultiBody(0, shape, -1, [0, 0, -0.1]), p.createMultiBody(1, shape, -1, [0, 0, 0.1])
    for mass, friction in ((1, 0.5), (2, 0.4), (3, 0.2), (4, 0.1), (5, 0.3)):
        p.changeDynamics(box, -1, mass=mass, lateralFriction=friction, linearDamping=0, angularDamping=0)
        p.changeDynamics(floor, -1, lateralFriction=1.0)
        p.resetBasePositionAndOrientation(box, [0, 0, 0.1], [0, 0, 0, 1])
        p.resetBaseVelocity(box, [2, 0, 0])
        for _ in range(24):
            p.stepSimulation()
        assert p.getBaseVelocity(box)[0][0] == pytest.approx(2 - 10 * friction * 0.1, abs=1e-3)
        assert sum(point[9] for point in p.getContactPoints(box)) == pytest.approx(10 * mass, rel=1e-3)
    p.disconnect()


@pytest.mark.parametrize("seed", range(4))
def test_filters_that_change_often_are_those_of_the_python_function(seed: int) -> None:
    outcomes = []
    for is_python in (False, True):
        source = random.Random(seed)
        p.connect(p.DIRECT)
        p.setGravity(0, 0, -9.8)
        ground = p.loadURDF(f"{getDataPath()}/plane.urdf")
        flags = p.URDF_USE_SELF_COLLISION if seed == 3 else 0
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 0.5], flags=flags)
        cubes = [p.loadURDF(f"{getDataPath()}/cube_small.urdf", [1, 0.04 * k, 0.02]) for k in range(3)]
        call = functools.partial(python, "setCollisionFilterGroupMask")
        call = call if is_python else p.setCollisionFilterGroupMask
        assert is_python or fast_commands.is_machine_code("setCollisionFilterGroupMask")
        p.stepSimulation()
        scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
        places = [(cubes[0], -1), (robot, 2), (robot, -1), (cubes[1], -1), (ground, -1), (robot, 99), (77, 0)]
        for k in range(150):
            place = source.choice(places[: 1 + k // 25])
            numbers = [source.choice((0, 1, 2, 3, -1, -3, 8, True, 2**70)) for _ in range(2)]
            try:
                outcomes.append(call(*place, *numbers))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
            if k % 10 == 0:
                p.stepSimulation()
            if k == 140:
                p.removeBody(cubes[1])
            outcomes.append(colliding_links(scene.world, scene.world.live_model))
            outcomes.append((sorted(scene.last_step.filtered), sorted(scene.filters.groups.items())))
        p.disconnect()
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


def test_clients_in_this_process_are_connected_and_others_as_before() -> None:
    for call in (p.isConnected, p.isNumpyEnabled, p.getAPIVersion):
        for _ in range(2):
            assert call() == call.__self__() == call.__self__.__wrapped__()
            one, two = p.connect(p.DIRECT), p.connect(p.DIRECT)
            for number in (one, two, 5, -1):
                expected = call.__self__.__wrapped__(number)
                assert call(number) == call(physicsClientId=number) == expected
                assert p.isConnected(number) == (number in (one, two))
            p.disconnect(one)
            assert (p.isConnected(), p.isConnected(two), p.isConnected(physicsClientId=two)) == (0, 1, 1)
            p.disconnect(two)
            with pytest.raises(TypeError):
                call(1, 2)
            with pytest.raises(TypeError):
                call(nothing=1)


def test_settings_and_dynamics_are_machine_code() -> None:
    names = "setGravity", "resetDebugVisualizerCamera", "setDebugObjectColor", "changeDynamics"
    names += "setJointMotorControlMultiDof", "setJointMotorControlMultiDofArray", "addUserData"
    for name in (*names, "addUserDebugLine", "removeUserDebugItem", "resetJointStatesMultiDof"):
        getattr(p, name)
        assert fast_commands.is_machine_code(name)


@pytest.mark.parametrize(
    "given",
    [
        ([2, 3], [[0.1], [0.2]]),
        (range(2, 4), ([1], (np.float64(0.2),))),
        (np.array([2, 3]), np.array([[0.1], [0.2]])),
        ([2, 2], [[0.1], [0.2]]),
        ([2, 3], [[0.1], [0.2]], None),
        ([2, 3], [[0.1], [0.2]], [[1], [2]]),
        ([2.7, 3], [[0.1], [0.2]]),
        ([0, 3], [[0.1], [0.2]]),
        ([2, 99], [[0.1], [0.2]]),
        ([2, -1], [[0.1], [0.2]]),
        ([2, 3], [[0.1]]),
        ([2, 3], [[0.1], [0.2, 0.3]]),
        ([2, 3], [0.1, 0.2]),
        ([2, 3], [[0.1], "a"]),
        ([2, 3], [[0.1], [float("nan")]]),
        ([2] * 40, [[0.1]] * 40),
        ([], []),
        (2, [[0.1]]),
    ],
)
def test_joints_that_are_reset_are_those_of_the_python_function(given: tuple[Any, ...]) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
        places = range(p.getNumJoints(robot))
        for edit in (p.stepSimulation, lambda: p.createMultiBody(1.0), lambda: p.removeBody(1)):
            edit()
            for joint in places:
                p.resetJointState(robot, joint, 0.5, 0.25)
            for _ in range(2):
                p.resetJointStatesMultiDof(robot, [4, 5], [[0.3], [0.4]])
            p.getLinkState(robot, 5, computeForwardKinematics=1)
            call = p.resetJointStatesMultiDof.__self__ if is_python else p.resetJointStatesMultiDof
            try:
                outcomes.append(call(robot, *given))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
            outcomes.append(p.getJointStates(robot, places))
            outcomes += [p.getLinkState(robot, 3, computeForwardKinematics=fresh) for fresh in (0, 1)]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_commands_of_fixed_joints_change_nothing(robot: int) -> None:
    joints = range(p.getNumJoints(robot))
    fixed = [k for k in joints if p.getJointInfo(robot, k)[2] == p.JOINT_FIXED]
    p.setJointMotorControlArray(robot, list(joints), p.POSITION_CONTROL, [0.3] * len(joints))
    p.stepSimulation()
    p.setJointMotorControl2(robot, 2, p.VELOCITY_CONTROL, targetVelocity=1, force=3)
    before = motors(robot)
    for _ in range(3):
        for joint in fixed:
            p.setJointMotorControl2(robot, joint, p.VELOCITY_CONTROL, targetVelocity=2, force=0)
            p.setJointMotorControl2(robot, joint, p.POSITION_CONTROL, 2, force=7)
            p.setJointMotorControlArray(robot, [joint], p.VELOCITY_CONTROL, [2], forces=[5])
            assert motors(robot) == before
    with pytest.raises(p.error, match="Joint index out-of-range"):
        p.setJointMotorControl2(robot, len(joints), p.VELOCITY_CONTROL, force=0)


def test_boxes_of_links_are_those_of_the_last_step_until_the_next(robot: int) -> None:
    """Also where contacts were detected meanwhile, at the present positions."""
    p.stepSimulation()
    boxes = [python("getAABB", robot, link) for link in range(5)]
    assert [p.getAABB(robot, link) for link in range(5)] == boxes
    p.resetJointState(robot, 2, 0.5)
    p.stepSimulation()
    boxes = [python("getAABB", robot, link) for link in range(5)]
    client: Any = CLIENTS[0]
    scene = client.scene
    scene.world.mark_moved()  # without the frames that scripts see
    scene.world.link_frames(keeps_last=True)
    assert scene.world.kept_frames is not None
    assert [p.getAABB(robot, link) for link in range(5)] == boxes
    assert [python("getAABB", robot, link) for link in range(5)] == boxes


def test_lines_are_those_of_the_python_function() -> None:
    a, b = [0, 0.5, 1], (1.0, 2, 3)
    calls: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
        ((a, b), {}),
        ((a, b, [1, 0, 0.5]), {"lineWidth": 2}),
        ((a, b), {"replaceItemUniqueId": 0}),
        ((a, b), {"replaceItemUniqueId": 77}),
        ((a, b, a, 3.0, 0.0, -1, -1, 1), {}),
        ((a, b), {"lifeTime": 100.0}),
        ((a, b), {"parentObjectUniqueId": 0, "parentLinkIndex": 1}),
        ((a, b), {"parentLinkIndex": "a"}),
        ((a, b, [1, 0]), {}),
        ((a, b, None), {}),
        ((np.array(a), b), {}),
        ((a, [1, 2, True]), {}),
        ((a, [1, 2, float("inf")]), {}),
        ((a, [1, 2]), {}),
        ((a, [1, 2, "a"]), {}),
        ((a, b), {"lineWidth": "2"}),
        ((a, b), {"replaceItemUniqueId": 0.5}),
        ((a,), {}),
    ]
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        for given, keywords in calls:
            call = p.addUserDebugLine.__self__ if is_python else p.addUserDebugLine
            try:
                outcomes.append(call(*given, **keywords))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        items: Any = CLIENTS[0].debug_items  # type: ignore[union-attr]
        assert items.has_expiring
        slider = p.addUserDebugParameter("slider", 0, 1, 0.5)
        remove = p.removeUserDebugItem.__self__ if is_python else p.removeUserDebugItem
        for number in (1, 1, 99, slider, "a", 2.0):
            try:
                outcomes.append(remove(number))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        outcomes += [items.revision, len(items.parameters)]
        outcomes += [(n, *line[:5], line.expires is None) for n, line in items.drawings()]
        p.disconnect()
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


def test_user_data_are_those_of_the_python_function() -> None:
    calls: list[tuple[Any, ...]] = [
        (0, "key", "value"),
        (0, "key", "other"),
        (0, "key", "\udc80"),
        (0, "key", "välue", -1, -1),
        (0, "key", "link", 1),
        (0, "key", "link", 1, 0),
        (0, "key", "again", True),
        (5, "key", "value"),
        (1, "key", "second"),
        (0, "key", b"value"),
        (0, 1, "value"),
        (0, "key", "value", 0.5),
        ("0", "key", "value"),
    ]
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        for _ in range(2):
            p.loadURDF(f"{getDataPath()}/cube_small.urdf")
        for _ in range(2):
            for given in calls:
                call = p.addUserData.__self__ if is_python else p.addUserData
                try:
                    outcomes.append(call(*given))
                except Exception as problem:
                    outcomes.append((type(problem), str(problem)))
                outcomes.append(dict(CLIENTS[0].user_data._values))  # type: ignore[union-attr]
            p.removeBody(1)
        p.disconnect()
    half = len(outcomes) // 2
    assert outcomes[:half] == outcomes[half:]


@pytest.mark.parametrize(
    "given",
    [
        {"rgbaColor": [1, 0.5, 0, 1]},
        {"rgbaColor": (0.1, 0.2, 0.3, 0.4)},
        {"rgbaColor": np.array([1.0, 0, 0, 1])},
        {"rgbaColor": [1, 0, 0]},
        {"rgbaColor": [1, 0, 0, True]},
        {"rgbaColor": [1, 0, 0, "1"]},
        {"rgbaColor": [1, 0, 0, 1], "shapeIndex": 0},
        {"rgbaColor": [1, 0, 0, 1], "specularColor": [1, 1, 1]},
        {"rgbaColor": [1, 0, 0, 1], "textureUniqueId": -1},
        {"rgbaColor": [np.float64(0.5), np.float32(0.25), 0, 1]},
        {"rgbaColor": np.array([1.0, 0, 0])},
        {"specularColor": [0.5, 0.25, 0.75]},
        {"specularColor": np.array([0.5, 0.25, -0.75])},
        {"specularColor": [0.5, 0.25]},
        {"specularColor": [0.5, 0.25, "1"]},
        {"specularColor": [0.5, 0.25, float("nan")]},
        {"textureUniqueId": 0},
        {"textureUniqueId": 7},
        {"textureUniqueId": 0.0},
        {"textureUniqueId": 0, "specularColor": (1, 0, 0), "rgbaColor": (1, 0, 0, 1)},
        {"rgbaColor": None},
        {"rgbaColor": 4},
        {},
    ],
)
def test_colours_are_those_of_the_python_function(given: dict[str, Any], tmp_path: Path) -> None:
    outcomes: list[Any] = []
    (tmp_path / "image.ppm").write_bytes(b"P6 2 1 255 " + bytes(range(6)))
    for is_python in (False, True):
        p.connect(p.DIRECT)
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf")
        assert p.loadTexture(str(tmp_path / "image.ppm")) == 0
        call = p.changeVisualShape.__self__ if is_python else p.changeVisualShape
        assert is_python or fast_commands.is_machine_code("changeVisualShape")
        for body, link in ((robot, -1), (robot, 2), (robot, 99), (robot, -2), (9, 0), (robot, 1.0), ("a", 0)):
            try:
                outcomes.append(call(body, link, **given))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        outcomes.append(p.getVisualShapeData(robot))
        shapes: Any = CLIENTS[0].scene.world.render_scene().shapes  # type: ignore[union-attr]
        for shape in shapes:
            texture = None if shape.texture is None else shape.texture.tolist()
            outcomes.append((shape.rgba, shape.use_mesh_colors, shape.specular, texture))
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_efforts_of_constraints_are_those_of_the_python_function(robot: int) -> None:
    name, zero = "getConstraintState", [0, 0, 0]
    p.setGravity(0, 0, -9.8)
    cubes = [p.loadURDF(f"{getDataPath()}/cube_small.urdf", [x, 2, 1]) for x in (0, 1, 2)]
    kinds = p.JOINT_FIXED, p.JOINT_PRISMATIC, p.JOINT_POINT2POINT
    made = [
        p.createConstraint(cube, -1, -1, -1, kind, [0.6, 0.8, 0], [0, 0, 0.02], [cube, 2, 1])
        for cube, kind in zip(cubes, kinds, strict=True)
    ]
    made.append(p.createConstraint(robot, 2, robot, 3, p.JOINT_GEAR, [0, 1, 0], zero, zero))
    p.changeConstraint(made[-1], gearRatio=-1, maxForce=100)
    assert [len(p.getConstraintState(k)) for k in made] == [6, 5, 3, 1]
    assert not any(any(p.getConstraintState(k)) for k in made)
    state = p.saveState()
    edits = (
        lambda: None,
        lambda: p.restoreState(state),
        lambda: p.createMultiBody(1.0),
        lambda: p.removeConstraint(p.createConstraint(cubes[0], -1, -1, -1, p.JOINT_FIXED, zero, zero, zero)),
        lambda: p.removeConstraint(made[1]),
        p.performCollisionDetection,
    )
    for edit in edits:
        edit()
        for steps in (0, 1, 3):
            for _ in range(steps):
                p.setJointMotorControl2(robot, 2, p.VELOCITY_CONTROL, targetVelocity=5, force=20)
                p.stepSimulation()
            for k in (*made, 99, -1, True, "a"):
                outcomes = []
                for call in (functools.partial(python, name), p.getConstraintState, p.getConstraintState):
                    try:
                        outcomes.append(call(k))
                    except Exception as problem:
                        outcomes.append((type(problem), str(problem)))
                assert outcomes[0] == outcomes[1] == outcomes[2]
    assert all(any(p.getConstraintState(k)) for k in (made[0], *made[2:]))
    assert set(CLIENTS[0].prepared["constraints"]) == {made[0], *made[2:]}  # type: ignore[union-attr]


@pytest.mark.parametrize("is_stale", [False, True])
def test_constraints_that_move_often_are_those_of_the_python_function(is_stale: bool) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        zero, robots = [0, 0, 0], [p.loadURDF(f"{getDataPath()}/r2d2.urdf", [x, 0, 1]) for x in (0, 2)]
        made = [
            p.createConstraint(robots[0], 2, -1, -1, p.JOINT_FIXED, zero, zero, [0, 0, 1]),
            p.createConstraint(robots[0], 3, robots[1], 13, p.JOINT_POINT2POINT, zero, zero, [-1, 0, 0]),
        ]
        call = p.changeConstraint.__self__ if is_python else p.changeConstraint
        for step in range(4):
            p.stepSimulation()
            made.append(p.createConstraint(robots[1], 1, -1, -1, p.JOINT_FIXED, zero, zero, [2, 0, 1]))
            if not is_stale:
                p.stepSimulation()
            for constraint in made:
                for k in range(4):
                    call(constraint, [0.1 * k, 0.2 * step, 1])
                    call(constraint, (0, 0.01 * step, 0.5 * k), [0, 0, 0.6, 0.8], maxForce=100 * k)
            p.removeConstraint(made.pop())
            for constraint in made:
                call(constraint, [0.1, 0.2, 1.1 + 0.01 * step])
            p.stepSimulation()
            outcomes += [p.getConstraintInfo(k) for k in made] + [p.getConstraintState(k) for k in made]
            outcomes += [p.getBasePositionAndOrientation(body) for body in robots]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


@pytest.mark.parametrize(
    "given",
    [
        {"jointChildPivot": [1, 2.1, 1]},
        {"jointChildPivot": (1.0, 2, 1.1), "jointChildFrameOrientation": [0, 0, 1, 3], "maxForce": 20},
        {"jointChildFrameOrientation": [0, 0, 0, 0]},
        {"jointChildFrameOrientation": np.array([0, 0.6, 0, 0.8])},
        {"jointChildFrameOrientation": [1e200, 0, 0, 1]},
        {"maxForce": 0},
        {"maxForce": -3},
        {"maxForce": float("inf")},
        {"maxForce": "1"},
        {"jointChildPivot": [1, 2]},
        {"jointChildPivot": [1, 2, float("nan")], "maxForce": 4},
        {"gearRatio": 2.0, "maxForce": 5},
        {"maxForce": 5, "erp": 0.1, "relativePositionTarget": 0.2},
        {"nothing": 1},
    ],
)
def test_changed_constraints_are_those_of_the_python_function(given: dict[str, Any]) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1])
        cubes = [p.loadURDF(f"{getDataPath()}/cube_small.urdf", [x, 2, 1]) for x in (0, 1)]
        zero = [0, 0, 0]
        made = [
            p.createConstraint(cubes[0], -1, -1, -1, p.JOINT_FIXED, zero, zero, [0, 2, 1]),
            p.createConstraint(cubes[0], -1, cubes[1], -1, p.JOINT_POINT2POINT, zero, zero, [-1, 0, 0]),
            p.createConstraint(robot, 2, robot, 3, p.JOINT_GEAR, [0, 1, 0], zero, zero),
        ]
        call = p.changeConstraint.__self__ if is_python else p.changeConstraint
        assert is_python or fast_commands.is_machine_code("changeConstraint")
        for _ in range(2):
            for constraint in (*made, 99, -1, True, 1.0, "a"):
                try:
                    outcomes.append(call(constraint, **given))
                except Exception as problem:
                    outcomes.append((type(problem), str(problem)))
            p.stepSimulation()
            outcomes += [p.getConstraintInfo(k) for k in made] + [p.getConstraintState(k) for k in made]
            outcomes += [p.getBasePositionAndOrientation(body) for body in (robot, *cubes)]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


_CREATED: list[tuple[Any, ...]] = [
    (0, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.02], (0, 2, 1)),
    (0, -1, 1, -1, p.JOINT_POINT2POINT, [0, 0, 0], (0.1, 0, 0.5), [-0.9, 0, 0], None, [0, 0, 0, 2]),
    (2, 3, 1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0.2, 0, 0.1], [0, 0, 0.6, 0.8], (0, 0, 0, 0)),
    (0, -1, 1, -1, p.JOINT_PRISMATIC, [0, 1, 0], [0, 0, 0], [0, 0, 0.1]),
    (0, -1, 1, -1, p.JOINT_FIXED, [0, 0], np.zeros(3), None, [0, 0, 1], None),
    (0, 0, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    (2, 2**70, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    (9, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    (0, -1, 1, 1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    (0, -1, -1, -1, 77, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    (0, -1, -1, -1, 2**70, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
    (0, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, float("nan")], [0, 0, 0]),
    (0, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, "1"], [0, 0, 0]),
    (0, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 1], [0, 0, 0], [0, 0, 0, float("inf")]),
    (0, -1.0, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0]),
]


def _reads(bodies: Any) -> list[Any]:
    """Return what scripts read of constraints and bodies before and after a step."""
    found: list[Any] = []
    for _ in range(2):
        found += [p.getNumConstraints(), [p.getConstraintUniqueId(k) for k in range(6)]]
        ids = [p.getConstraintUniqueId(k) for k in range(p.getNumConstraints())]
        found += [(p.getConstraintInfo(k), p.getConstraintState(k)) for k in ids]
        found += [p.getBasePositionAndOrientation(body) for body in bodies]
        p.stepSimulation()
    return found


def _edit_nothing(made: list[int]) -> None:
    pass


def _remove_all(made: list[int]) -> None:
    for constraint in made:
        p.removeConstraint(constraint)


def _remove_first(made: list[int]) -> None:
    for constraint in (made[:1], 99, True, made[0] if made else 0, 1.5):
        with pytest.raises(TypeError) if isinstance(constraint, list | float) else contextlib.nullcontext():
            p.removeConstraint(constraint)  # type: ignore[arg-type]


def _remove_body(made: list[int]) -> None:
    p.removeBody(1)


def _change_time_step(made: list[int]) -> None:
    p.setTimeStep(1 / 100)


def _push_and_save(made: list[int]) -> None:
    p.applyExternalForce(1, -1, [2, 0, 0], [0, 0, 0], p.LINK_FRAME)
    p.restoreState(p.saveState())


@pytest.mark.parametrize(
    "edit", [_edit_nothing, _remove_all, _remove_first, _remove_body, _change_time_step, _push_and_save]
)
@pytest.mark.parametrize("given", [*_CREATED, None], ids=range(len(_CREATED) + 1))
def test_created_constraints_are_those_of_the_python_function(given: Any, edit: Any) -> None:
    outcomes = []
    for is_python in (False, True):
        p.connect(p.DIRECT)
        p.setGravity(0, 0, -9.8)
        bodies = [p.loadURDF(f"{getDataPath()}/cube_small.urdf", [x, 2, 1]) for x in (0, 1)]
        bodies.append(p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1]))
        p.stepSimulation()
        call = p.createConstraint.__self__ if is_python else p.createConstraint
        assert is_python or fast_commands.is_machine_code("createConstraint")
        made: list[Any] = []
        for arguments in _CREATED[:3] if given is None else [given]:
            try:
                made.append(call(*arguments))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        if edit is not _remove_body or made:
            edit(made)
        outcomes += [made, *_reads(bodies[::2] if edit is _remove_body else bodies)]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_constraints_are_solved_in_the_order_in_which_they_were_created(robot: int) -> None:
    """Machine code asks for points and welds only; slides are built by the Python function."""
    zero = [0, 0, 0]
    cube = p.loadURDF(f"{getDataPath()}/cube_small.urdf", [1, 2, 1])
    for kind in (p.JOINT_POINT2POINT, p.JOINT_PRISMATIC, p.JOINT_FIXED):
        p.createConstraint(cube, -1, -1, -1, kind, [0, 0, 1], zero, [1, 2, 1])
    p.stepSimulation()
    world = CLIENTS[0].scene.world  # type: ignore[union-attr]
    assert [constraint.kind for constraint in world.constraints.all] == ["point", "slide", "weld"]


def test_a_constraint_that_is_removed_at_once_is_never_built(robot: int) -> None:
    zero = [0, 0, 0]
    cube = p.loadURDF(f"{getDataPath()}/cube_small.urdf", [1, 2, 1])
    p.stepSimulation()
    world = CLIENTS[0].scene.world  # type: ignore[union-attr]
    edits, revision = world.edits, world.revision
    for _ in range(3):
        p.removeConstraint(p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, zero, zero, [1, 2, 1]))
        assert p.getBasePositionAndOrientation(cube)[0][0] == 1.0
    p.stepSimulation()
    assert (world.edits, world.revision) == (edits, revision)
