"""Motor commands in machine code do what their Python functions do, also with bounds that change."""

from __future__ import annotations

import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from entry_robots import ARM, INERTIAL

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet import calling_forms
from roboyard.pybullet.bullet_rules.motor_commands import MotorCommands
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands, motor_entries, old_motor_entries

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert motor_entries.MOTORS.address()
    assert old_motor_entries.OLD.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_motors()
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(inertial=INERTIAL))
    return path


def motors(number: int, robot: int) -> list[Any]:
    client: Any = CLIENTS[number]
    scene = client.scene
    scene.flush_motors()
    own, record = scene.world.motors.of(scene.bodies[robot].body), scene.bodies[robot]
    world = scene.world
    dry = [] if world.is_stale else world.live_model.dof_frictionloss.tolist()
    arrays = [own.motors.tolist(), own.targets.tolist(), own.bounds.tolist()]
    return [*arrays, dry, sorted(record.motors_off), list(record.applied), list(record.motored)]


def test_commands_with_changing_bounds_are_those_of_the_python_functions(arm: Path) -> None:
    draw = random.Random(3)
    numbers = [p.connect(p.DIRECT), p.connect(p.DIRECT)]
    for number in numbers:
        p.setGravity(0, 0, -9.8, physicsClientId=number)
        assert p.loadURDF(str(arm), useFixedBase=True, physicsClientId=number) == 0

    def both(name: str, *given: Any, **keywords: Any) -> None:
        getattr(p, name)(*given, **keywords)
        COMMANDS[name].function(CLIENTS[1], *given, **keywords)

    def command() -> None:
        mode = draw.choice([p.POSITION_CONTROL, p.POSITION_CONTROL, p.VELOCITY_CONTROL, p.TORQUE_CONTROL])
        force = draw.choice([3, 5.0, np.float64(2.5), 0, 0.0, 7, 8, np.float32(4)])
        place = draw.choice([0.1, -3, np.float64(0.4), 9.0])
        form = draw.randrange(9)
        joint = draw.choice([0, 1, 2, np.int64(1)])
        if form < 2:
            gains = draw.choice([{}, {"positionGain": 0.3}, {"velocityGain": 0.5, "maxVelocity": 2.0}])
            speed = draw.choice([{}, {"targetVelocity": 0.5}])
            if mode == p.POSITION_CONTROL and form == 0:
                both("setJointMotorControl2", 0, joint, mode, place, force=force, **gains, **speed)
            else:
                both("setJointMotorControl2", 0, joint, mode, force=force, **gains, **speed)
        elif form < 4:
            joints: Any = draw.choice([[0, 1], range(3), [1], (1, 0), [1, 1]])
            lists: dict[str, Any] = {"forces": [draw.choice([force, 6.0]) for _ in joints]}
            if mode == p.POSITION_CONTROL:
                lists["targetPositions"] = [place] * len(joints)
            both("setJointMotorControlArray", 0, joints, mode, **lists)
        elif form == 4:
            both("setJointMotorControlMultiDof", 0, joint, p.POSITION_CONTROL, [place], force=[force])
        elif form == 5:
            lists = {"forces": [[force], [draw.choice([force, 2.0])]]}
            both("setJointMotorControlMultiDofArray", 0, [0, 1], p.POSITION_CONTROL, [[0.1], [0.2]], **lists)
        elif form == 6:
            both(
                "setJointMotorControlMultiDof",
                0,
                joint,
                p.TORQUE_CONTROL,
                force=draw.choice([[force], [1, 2]]),
            )
        elif form == 7:
            lists = {"forces": draw.choice([[[force], (2.0,)], [np.array([0.1])], [[1.0], [1.0, 2.0]]])}
            both(
                "setJointMotorControlMultiDofArray",
                0,
                draw.choice([[0, 2], (1, 0)]),
                p.TORQUE_CONTROL,
                **lists,
            )
        else:
            old = {p.TORQUE_CONTROL: (force,)}.get(mode) or draw.choice(
                [(place,), (place, force), (place, 2, 1)]
            )
            old = draw.choice([old, (place, 0.1, force, 0.2, 0.9)])
            p.setJointMotorControl(0, joint, mode, *old)
            calling_forms.FIRST_CLIENT["setJointMotorControl"][0](CLIENTS[1], 0, joint, mode, *old)

    def change() -> None:
        kind, step = draw.randrange(4), draw.choice([0.004, 0.01])
        for number in numbers:
            if kind == 0:
                p.setTimeStep(step, physicsClientId=number)
            elif kind == 1:
                p.createMultiBody(1.0, basePosition=[2, 0, 0], physicsClientId=number)
            else:
                p.setPhysicsEngineParameter(numSubSteps=2 * (kind - 2), physicsClientId=number)

    for turn in range(900):
        command()
        assert motors(0, 0) == motors(1, 0), turn
        if turn % 3 == 2:
            for number in numbers:
                p.stepSimulation(physicsClientId=number)
            states = [p.getJointStates(0, [0, 1, 2], physicsClientId=number) for number in numbers]
            assert states[0] == states[1], turn
        if turn % 23 == 22:
            change()


def test_machine_code_writes_the_bounds(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(str(arm), useFixedBase=True)
    for force in (2.0, 3.0):
        p.setJointMotorControl2(robot, 0, p.POSITION_CONTROL, 0.3, force=force)
        p.setJointMotorControl2(robot, 1, p.VELOCITY_CONTROL, force=0)
        p.stepSimulation()
    p.setJointMotorControl2(robot, 0, p.POSITION_CONTROL, 0.3, force=4.0)  # prepared after the step
    p.setJointMotorControl2(robot, 1, p.TORQUE_CONTROL, force=np.float64(0.1))
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python functions read
    p.setJointMotorControl2(robot, 0, p.POSITION_CONTROL, 0.3, force=6.0)
    p.setJointMotorControl2(robot, 1, p.VELOCITY_CONTROL, force=0)
    p.setJointMotorControl2(robot, 1, p.TORQUE_CONTROL, force=0.2)
    keywords = {"jointIndex": 0, "controlMode": p.VELOCITY_CONTROL, "force": np.float64(5)}
    p.setJointMotorControl2(bodyUniqueId=robot, **keywords)
    p.setJointMotorControlArray(robot, [0, 1], p.POSITION_CONTROL, [0.1, 0.2], forces=[4.5, 0.0])
    p.setJointMotorControlMultiDof(robot, 1, p.TORQUE_CONTROL, force=[0.4])
    p.setJointMotorControlMultiDofArray(robot, [2, 1], p.TORQUE_CONTROL, forces=[[0.3], [0.5]])
    p.setJointMotorControl(robot, 1, p.TORQUE_CONTROL, 0.6)
    p.setJointMotorControl(robot, 0, p.VELOCITY_CONTROL, 0.1, 4.5)
    monkeypatch.undo()
    client.scene.world.wrenches.find()
    scene = client.scene
    own = scene.world.motors.of(scene.bodies[robot].body)
    np.testing.assert_array_equal(own.bounds, [[0.0, 4.5 / 240], [0.0, 0.0]])
    assert own.motors[0].tolist() == [1.0, 0.0, 0.1, 1.0, 0.0]
    np.testing.assert_allclose(scene.world.live_model.dof_frictionloss, [4.5, 0.0], rtol=1e-15)
    np.testing.assert_allclose(scene.world.live_data.qfrc_applied, [0.0, 1.8], rtol=1e-15)


def test_machine_code_notes_motors_that_are_switched(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(str(arm), useFixedBase=True)
    for _ in range(2):
        p.setJointMotorControl2(robot, 0, p.VELOCITY_CONTROL, targetVelocity=1.0, force=2)
        p.stepSimulation()
    p.setJointMotorControl2(robot, 0, p.VELOCITY_CONTROL, targetVelocity=1.0, force=2)  # prepared
    client: Any = CLIENTS[0]
    torque = p.getJointState(robot, 0)[3]
    bodies = client.scene.bodies
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python functions read
    p.setJointMotorControl2(robot, 0, p.VELOCITY_CONTROL, force=0)
    off = bodies[robot].motors_off.copy()
    p.setJointMotorControlArray(robot, [0, 2], p.VELOCITY_CONTROL, forces=[3, 1])
    monkeypatch.undo()
    assert off == {0}
    assert not bodies[robot].motors_off
    assert torque != 0.0
    assert bodies[robot].applied[0] == torque  # of its last step
    assert bodies[robot].motored[0]


def test_a_robot_of_which_only_fixed_joints_are_commanded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(inertial=INERTIAL))
    numbers = [p.connect(p.DIRECT), p.connect(p.DIRECT)]
    for number in numbers:
        p.setGravity(0, 0, -9.8, physicsClientId=number)
        p.loadURDF(str(path), useFixedBase=True, physicsClientId=number)
    kinds = [p.getJointInfo(0, joint)[2] for joint in range(p.getNumJoints(0))]
    fixed = kinds.index(p.JOINT_FIXED)
    assert p.JOINT_REVOLUTE in kinds
    given = 0, fixed, p.POSITION_CONTROL, 0.3
    for _ in range(3):
        p.setJointMotorControl2(*given, force=5)
        COMMANDS["setJointMotorControl2"].function(CLIENTS[1], *given, force=5)
        for number in numbers:
            p.stepSimulation(physicsClientId=number)
    assert motors(0, 0) == motors(1, 0)
    states = [p.getJointStates(0, range(len(kinds)), physicsClientId=number) for number in numbers]
    assert states[0] == states[1]

    def refuse(*_: Any) -> None:
        raise AssertionError("a function of Python is called")

    monkeypatch.setattr(MotorCommands, "set", refuse)
    p.setJointMotorControl2(*given, force=7)
    monkeypatch.undo()
    with pytest.raises(p.error, match="out-of-range"):
        p.setJointMotorControl2(0, 99, p.POSITION_CONTROL, 0.3, force=7)


def test_old_forms_take_what_pybullet_takes(arm: Path) -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(str(arm), useFixedBase=True)
    for given in ((robot, 0), (robot, 0, p.TORQUE_CONTROL, 1, 2), (robot, 0, 0, 1, 2, 3, 4), tuple(range(9))):
        with pytest.raises(p.error, match=r"^Error parsing arguments in setJointControl"):
            p.setJointMotorControl(*given)
    with pytest.raises(TypeError):
        p.setJointMotorControl(robot, 0, p.TORQUE_CONTROL, force=1)
    with pytest.raises(TypeError):
        p.setJointMotorControl(robot, 0, p.TORQUE_CONTROL, 1, physicsClientId=0)
    with pytest.raises(p.error, match=r"^Joint index out-of-range"):
        p.setJointMotorControl(robot, 7, p.TORQUE_CONTROL, 1)
    p.disconnect()
    with pytest.raises(p.error, match=r"^Not connected to physics server"):
        p.setJointMotorControl(robot, 0, p.TORQUE_CONTROL, 1)


def test_an_arm_with_changing_bounds_moves_as_in_pybullet(arm: Path) -> None:
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    robot = p.loadURDF(str(arm), useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
    for step in range(240):
        p.setJointMotorControl2(robot, 0, p.POSITION_CONTROL, 0.5, force=0.5 + 0.01 * (step % 50))
        p.setJointMotorControlArray(robot, [1], p.POSITION_CONTROL, [-0.8], forces=[0.2 + 0.02 * (step % 7)])
        p.stepSimulation()
    found = [number for state in p.getJointStates(robot, [0, 1]) for number in state[:2]]
    assert found == pytest.approx(RECORDED, abs=1e-6)


RECORDED = [0.7412236296925281, -3.1630806046697435, -5.109218178532287, 9.104331525972611]
"""Positions and velocities in PyBullet 3.2.7."""


def test_old_names_of_arguments_need_no_python_function(arm: Path) -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(str(arm), useFixedBase=True)

    def command(**names: Any) -> list[str]:
        called: list[str] = []
        sys.setprofile(
            lambda frame, event, _: called.append(frame.f_code.co_name) if event == "call" else None
        )
        try:
            p.setJointMotorControl2(
                jointIndex=0, controlMode=p.POSITION_CONTROL, targetPosition=0.2, force=5, **names
            )
            p.setJointMotorControlArray(jointIndices=[0], controlMode=p.TORQUE_CONTROL, forces=[0.5], **names)
        finally:
            sys.setprofile(None)
        return called

    for _ in range(3):
        command(bodyUniqueId=robot)
    expected = command(bodyUniqueId=robot)
    assert command(bodyIndex=robot) == expected == []
    before = motors(0, robot)
    command(bodyIndex=robot)
    assert motors(0, robot) == before
    with pytest.raises(p.error):
        p.setJointMotorControl2(bodyIndex=7, jointIndex=0, controlMode=p.POSITION_CONTROL)
    with pytest.raises(TypeError):
        p.setJointMotorControl2(jointIndex=0, controlMode=p.POSITION_CONTROL, body=robot)
