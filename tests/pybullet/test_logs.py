"""State logs whose layouts PyBullet 3.2.7 writes so."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

import roboyard.pybullet as p
import roboyard.pybullet_data as data

ENDS = [("front", "left", "R"), ("front", "left", "L"), ("back", "left", "R"), ("back", "left", "L")]
ENDS += [("front", "right", "L"), ("front", "right", "R"), ("back", "right", "L"), ("back", "right", "R")]


def _records(path: Path) -> tuple[bytes, bytes, list[tuple]]:
    names, types, rest = path.read_bytes().split(b"\n", 2)
    size = struct.calcsize("<" + types.decode()) + 2
    assert len(rest) % size == 0
    rows = [rest[k : k + size] for k in range(0, len(rest), size)]
    assert all(row[:2] == b"\xaa\xbb" for row in rows)
    return names, types, [struct.unpack("<" + types.decode(), row[2:]) for row in rows]


def _minitaur(folder: Path) -> Path:
    """A base with eight hinges named as the Minitaur's motors, in another order than its log's."""
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    text = f'<robot name="m"><link name="base">{inertial}</link>'
    for number, (end, side, leg) in enumerate(reversed(ENDS)):
        text += f'<link name="l{number}">{inertial}</link>'
        text += f'<joint name="motor_{end}_{side}{leg}_joint" type="continuous"><parent link="base"/>'
        text += f'<child link="l{number}"/><axis xyz="0 1 0"/></joint>'
    file = folder / "minitaur.urdf"
    file.write_text(text + "</robot>")
    return file


def test_the_log_of_a_minitaur(client: int, tmp_path: Path) -> None:
    robot = p.loadURDF(str(_minitaur(tmp_path)))
    for joint in range(8):
        p.resetJointState(robot, joint, 0.1 * joint)
    path = tmp_path / "minitaur.bin"
    log = p.startStateLogging(p.STATE_LOGGING_MINITAUR, str(path), [robot])
    p.stepSimulation()
    p.stepSimulation()
    p.stopStateLogging(log)
    names, types, rows = _records(path)
    assert names == b"t,r,p,y,q0,q1,q2,q3,q4,q5,q6,q7,u0,u1,u2,u3,u4,u5,u6,u7,dx,mo"
    assert types == b"IffffffffffffffffffffB"
    assert [row[0] for row in rows] == [0, 1]
    assert rows[0][4:12] == pytest.approx([0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.0], abs=1e-4)
    assert rows[0][-1] == 6


def test_robots_and_kinds_that_no_log_knows(client: int, tmp_path: Path) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    cart = p.loadURDF("cartpole.urdf")
    file = str(tmp_path / "log")
    assert p.startStateLogging(p.STATE_LOGGING_MINITAUR, file, [cart]) is None
    assert p.startStateLogging(p.STATE_LOGGING_MINITAUR, file) is None
    assert p.startStateLogging(p.STATE_LOGGING_CUSTOM_TIMER, file) is None
    assert p.startStateLogging(p.STATE_LOGGING_GENERIC_ROBOT, file) == 0


@pytest.mark.parametrize(("flags", "logged"), [(1, 0.0), (2, 3.0), (3, 3.0)])
def test_torques_of_scripts_and_motors(client: int, tmp_path: Path, flags: int, logged: float) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    cart = p.loadURDF("cartpole.urdf")
    p.setJointMotorControl2(cart, 0, p.VELOCITY_CONTROL, force=0)
    path = tmp_path / "robot.bin"
    log = p.startStateLogging(p.STATE_LOGGING_GENERIC_ROBOT, str(path), [cart], maxLogDof=2, logFlags=flags)
    p.setJointMotorControl2(cart, 0, p.TORQUE_CONTROL, force=3)
    p.stepSimulation()
    p.stepSimulation()
    p.stopStateLogging(log)
    names, _, rows = _records(path)
    assert names.endswith(b"q0,q1,u0,u1,t0,t1")
    assert [row[-2] for row in rows] == pytest.approx([logged, 0.0])


def test_a_contact_log_keeps_bullets_order(client: int, tmp_path: Path) -> None:
    p.setGravity(0, 0, -10)
    size = {"halfExtents": [1, 1, 1]}
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, **size), basePosition=[0, 0, -1])
    box = p.createMultiBody(1, p.createCollisionShape(p.GEOM_BOX, **size), basePosition=[0, 0, 1])
    for _ in range(10):
        p.stepSimulation()
    path = tmp_path / "contacts.bin"
    log = p.startStateLogging(p.STATE_LOGGING_CONTACT_POINTS, str(path), bodyUniqueIdA=box)
    p.stepSimulation()
    p.stopStateLogging(log)
    _, types, rows = _records(path)
    assert types == b"IfIiiiifffffffffff"
    assert {row[3:7] for row in rows} == {(ground, box, -1, -1)}
    assert {round(row[15], 6) for row in rows} == {-1.0}
    assert sum(row[-1] for row in rows) == pytest.approx(10, rel=0.01)
