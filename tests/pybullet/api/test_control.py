"""Motor commands, compared with PyBullet 3.2.7 and with the law of its motor constraint."""

from __future__ import annotations

from collections.abc import Callable
from math import sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

ROD = """<robot name="rod"><link name="base"/>
  <link name="rod"><inertial><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><geometry><box size="0.2 0.2 1"/></geometry></collision></link>
  <joint name="turn" type="{kind}"><parent link="base"/><child link="rod"/><axis xyz="0 0 1"/>
    <limit lower="{lower}" upper="{upper}" effort="1000" velocity="100"/></joint></robot>"""
DT = 1 / 240


def rod(p: Any, folder: Path, kind: str = "revolute", lower: float = -9, upper: float = 9) -> int:
    file = folder / f"{kind}_{lower}_{upper}.urdf"
    file.write_text(ROD.format(kind=kind, lower=lower, upper=upper))
    body = p.loadURDF(str(file), useFixedBase=True)
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)
    return body


def message_of(call: Callable[[], Any]) -> list[str]:
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def states(p: Any, body: int, steps: int) -> list[list[float]]:
    """Position and velocity after each step."""
    found = []
    for _ in range(steps):
        p.stepSimulation()
        found.append([float(value) for value in p.getJointState(body, 0)[:2]])
    return found


def record_position_control(p: Any, folder: Path) -> Any:
    found = {}
    for name, options in {
        "default": {},
        "gains": {"positionGain": 0.3, "velocityGain": 0.5},
        "velocity target": {"targetVelocity": 1.0, "velocityGain": 0.3},
        "slow": {"maxVelocity": 0.5},
        "weak": {"force": 2.0},
    }.items():
        body = rod(p, folder)
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=1.0, **({"force": 500} | options))
        found[name] = states(p, body, 6)
        p.resetSimulation()
    return found


def record_velocity_control(p: Any, folder: Path) -> Any:
    found = {}
    for kind in ("revolute", "prismatic"):
        for gain in (1.0, 0.2):
            body = rod(p, folder, kind)
            p.setJointMotorControl2(
                body, 0, p.VELOCITY_CONTROL, targetVelocity=2.0, force=500, velocityGain=gain
            )
            found[f"{kind} {gain}"] = states(p, body, 6)
            p.resetSimulation()
    return found


def record_torque_control(p: Any, folder: Path) -> Any:
    body = rod(p, folder)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    found = []
    for torque in (1.0, 0.0, -2.0, 0.5):
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=torque)
        found += states(p, body, 2)
    return found


def record_pd_control(p: Any, folder: Path) -> Any:
    body = rod(p, folder)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    p.setJointMotorControl2(
        body, 0, p.PD_CONTROL, targetPosition=1.0, positionGain=3.0, velocityGain=0.4, force=100
    )
    return states(p, body, 12)


def record_wrong_commands(p: Any, folder: Path) -> Any:
    body = rod(p, folder)
    return [
        message_of(lambda: p.setJointMotorControl2(body, 5, p.POSITION_CONTROL)),
        message_of(lambda: p.setJointMotorControl2(body, -1, p.POSITION_CONTROL)),
        message_of(lambda: p.setJointMotorControl2(9, 0, p.POSITION_CONTROL)),
        message_of(lambda: p.setJointMotorControl2(body, 0, 77)),
        message_of(lambda: p.setJointMotorControlArray(body, [0], 77)),
        message_of(
            lambda: p.setJointMotorControlArray(body, [0], p.POSITION_CONTROL, targetPositions=[1, 2])
        ),
        message_of(lambda: p.setJointMotorControlArray(body, [0], p.VELOCITY_CONTROL, targetVelocities=[])),
        message_of(lambda: p.setJointMotorControlArray(body, [0], p.POSITION_CONTROL, forces=[1, 2])),
        message_of(lambda: p.setJointMotorControlArray(body, [0], p.POSITION_CONTROL, positionGains=[1, 2])),
        message_of(lambda: p.setJointMotorControlArray(body, [0], p.POSITION_CONTROL, velocityGains=[1, 2])),
        message_of(lambda: p.setJointMotorControlArray(body, [3], p.POSITION_CONTROL)),
        message_of(lambda: p.setJointMotorControlMultiDof(body, 0, p.VELOCITY_CONTROL)),
        message_of(lambda: p.setJointMotorControl(body, 0)),
    ]


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_position_control, 2e-3),
        (record_velocity_control, 1e-3),
        (record_torque_control, 1e-4),
        (record_pd_control, 1e-3),
        (record_wrong_commands, 0),
    ],
)
def test_motions_and_errors_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


@pytest.fixture
def body(client: int, tmp_path: Path) -> int:
    return rod(p, tmp_path)


def inertia(body: int) -> float:
    return p.getDynamicsInfo(body, 0)[2][2]


@pytest.mark.parametrize("gain", [0.1, 0.3, 0.6])
def test_position_control_closes_a_share_of_the_error_in_a_step(body: int, gain: float) -> None:
    p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=0.6, force=1e5, positionGain=gain)
    p.stepSimulation()
    assert p.getJointState(body, 0)[0] == pytest.approx(gain * 0.6, rel=2e-3)


def test_a_weak_motor_accelerates_by_its_force(body: int) -> None:
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, targetVelocity=100, force=0.3)
    for _ in range(10):
        p.stepSimulation()
    assert p.getJointState(body, 0)[1] == pytest.approx(10 * DT * 0.3 / inertia(body), rel=1e-3)
    assert p.getJointState(body, 0)[3] == pytest.approx(0.3, rel=1e-6)


def test_a_torque_acts_for_one_step(body: int) -> None:
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=0.5)
    speeds = [speed for _, speed in states(p, body, 3)]
    assert speeds == pytest.approx([0.5 * DT / inertia(body)] * 3, rel=1e-6)


def test_the_default_motor_holds_a_joint(body: int) -> None:
    p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=50)
    p.stepSimulation()
    assert abs(p.getJointState(body, 0)[1]) < 1e-2, "its largest impulse is 1 N m s, a force of 240 N m"


def test_a_target_beyond_a_limit_stops_there(client: int, tmp_path: Path) -> None:
    body = rod(p, tmp_path, lower=-0.2, upper=0.3)
    for target, end in ((2.0, 0.3), (-2.0, -0.2)):
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=target, force=100)
        for _ in range(120):
            p.stepSimulation()
        assert p.getJointState(body, 0)[0] == pytest.approx(end, abs=1e-3)


def test_a_motor_keeps_its_target_when_the_joint_is_reset(body: int) -> None:
    p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=0.4, force=1e4)
    p.resetJointState(body, 0, -1.0)
    for _ in range(150):
        p.stepSimulation()
    assert p.getJointState(body, 0)[0] == pytest.approx(0.4, abs=1e-4)


def test_motors_follow_a_slow_sine(body: int) -> None:
    worst = 0.0
    for step in range(240):
        target = 0.5 * sin(step * DT)
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, target, force=1e4, positionGain=1.0)
        p.stepSimulation()
        worst = max(worst, abs(p.getJointState(body, 0)[0] - target))
    assert worst < 1e-3


@pytest.mark.parametrize(
    ("arguments", "position", "velocity"),
    [
        (("POSITION_CONTROL", 0.5), 0.05, None),
        (("POSITION_CONTROL", 0.5, 1e4), 0.05, None),
        (("POSITION_CONTROL", 0.5, 1e4, 0.4), 0.2, None),
        (("VELOCITY_CONTROL", 1.0, 1e4), None, 1.0),
        (("VELOCITY_CONTROL", 1.0, 1e4, 0.5), None, 0.5),
        (("POSITION_CONTROL", 0.5, 0.0, 1e4, 0.2, 1.0), 0.1, None),
    ],
)
def test_the_oldest_form(body: int, arguments: Any, position: float | None, velocity: float | None) -> None:
    mode, *rest = arguments
    p.setJointMotorControl(body, 0, getattr(p, mode), *rest)
    p.stepSimulation()
    state = p.getJointState(body, 0)
    if position is not None:
        assert state[0] == pytest.approx(position, rel=5e-3)
    if velocity is not None:
        assert state[1] == pytest.approx(velocity, rel=5e-3)


def test_the_oldest_form_refuses_other_counts(body: int) -> None:
    for arguments in ((), (body, 0, 2), (body, 0, 2, 1, 2, 3, 4), (body, 0, p.TORQUE_CONTROL, 1, 2)):
        with pytest.raises(p.error, match="Error parsing arguments"):
            p.setJointMotorControl(*arguments)


def test_old_names_of_arguments(body: int) -> None:
    p.setJointMotorControl2(bodyIndex=body, jointIndex=0, controlMode=p.VELOCITY_CONTROL, targetVelocity=1)
    p.stepSimulation()
    assert p.getJointState(body, 0)[1] == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("mode", ["POSITION_CONTROL", "VELOCITY_CONTROL"])
def test_arrays_command_as_lists_and_single_calls_do(client: int, tmp_path: Path, mode: str) -> None:
    def moved(command: Callable[..., None]) -> list[float]:
        p.resetSimulation()
        body = rod(p, tmp_path)
        for step in range(30):
            command(body, getattr(p, mode), 0.3 + 0.01 * step, 0.1 * step, 50.0 + step, 0.2, 0.7)
            p.stepSimulation()
        return [*p.getJointState(body, 0)[:2]]

    def each(body: int, mode: int, goal: float, speed: float, force: float, kp: float, kd: float) -> None:
        p.setJointMotorControl2(body, 0, mode, goal, speed, force, kp, kd)

    def together(convert: Callable[..., Any]) -> Callable[..., None]:
        def command(body: int, mode: int, *numbers: float) -> None:
            p.setJointMotorControlArray(body, convert([0]), mode, *(convert([x]) for x in numbers))

        return command

    wanted = moved(each)
    assert abs(wanted[0]) > 0.01
    assert moved(together(list)) == wanted
    assert moved(together(np.array)) == wanted
