"""Link states compared with PyBullet 3.2.7 and with the kinematics of a rotating arm."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p

CHAIN = """<robot name="chain">
  <link name="base"/>
  <link name="first"><inertial><origin xyz="0.3 0 0.1" rpy="0 0.4 0"/><mass value="1"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="second"><inertial><origin xyz="0.2 0.1 0"/><mass value="0.5"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="first"/><origin xyz="0 0 1"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="10" velocity="10"/></joint>
  <joint name="b" type="revolute"><parent link="first"/><child link="second"/>
    <origin xyz="0.6 0 0" rpy="0.2 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="10" velocity="10"/></joint>
</robot>"""


def load(p: Any, folder: Path) -> int:
    file = folder / "chain.urdf"
    file.write_text(CHAIN)
    body = p.loadURDF(str(file), [0.1, 0.2, 0.3], [0, 0, 0.6, 0.8], useFixedBase=True)
    p.resetJointState(body, 0, 0.5, 1.5)
    p.resetJointState(body, 1, -0.3, 0.7)
    return body


def record_link_states(p: Any, folder: Path) -> Any:
    body = load(p, folder)
    return [p.getLinkState(body, link, computeLinkVelocity=1, computeForwardKinematics=1) for link in (0, 1)]


def record_link_states_together(p: Any, folder: Path) -> Any:
    body = load(p, folder)
    return [
        p.getLinkStates(body, [1, 0], computeForwardKinematics=1),
        p.getLinkStates(body, [1, 0], computeLinkVelocity=1, computeForwardKinematics=1),
    ]


def record_frames_after_a_step(p: Any, folder: Path) -> Any:
    """Without computeForwardKinematics the frames are those before the position update."""
    body = load(p, folder)
    for joint in (0, 1):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=1.0, force=1000)
    p.stepSimulation()
    return [p.getLinkState(body, 1)[:6], p.getLinkState(body, 1, computeForwardKinematics=1)[:6]]


@pytest.mark.parametrize(
    ("scenario", "tolerance"),
    [
        (record_link_states, 3e-7),
        (record_link_states_together, 3e-7),
        (record_frames_after_a_step, 3e-6),
    ],
)
def test_states_are_pybullets(agrees: Any, scenario: Any, tolerance: float) -> None:
    agrees(scenario, tolerance)


@pytest.fixture
def turntable(client: int) -> int:
    """A link whose centre of mass is 0.4 m from a vertical axis through (1, 2, 0)."""
    return p.createMultiBody(
        0, -1, basePosition=[1, 2, 0], linkMasses=[1], linkCollisionShapeIndices=[-1],
        linkVisualShapeIndices=[-1], linkPositions=[[0, 0, 0.5]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0.4, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip


@pytest.mark.parametrize("angle", [0.0, 0.3, -1.2, pi / 2, 3.0])
def test_a_centre_of_mass_moves_on_a_circle(turntable: int, angle: float) -> None:
    speed = 2.0
    p.resetJointState(turntable, 0, angle, speed)
    state = p.getLinkState(turntable, 0, computeLinkVelocity=1, computeForwardKinematics=1)
    assert state[0] == pytest.approx((1 + 0.4 * cos(angle), 2 + 0.4 * sin(angle), 0.5))
    assert state[1] == pytest.approx((0, 0, sin(angle / 2), cos(angle / 2)))
    assert state[2:4] == ((0.4, 0, 0), (0, 0, 0, 1))
    assert state[4] == pytest.approx((1, 2, 0.5)), "the link frame stays on the axis"
    assert state[6] == pytest.approx((-0.4 * speed * sin(angle), 0.4 * speed * cos(angle), 0))
    assert state[7] == pytest.approx((0, 0, speed))


def test_link_frames_pass_through_32_bits(turntable: int) -> None:
    p.resetJointState(turntable, 0, 0.123456789)
    state = p.getLinkState(turntable, 0, computeForwardKinematics=1)
    for value in (*state[4], *state[5]):
        assert float(np.float32(value)) == value


def test_states_of_many_are_those_of_one(turntable: int) -> None:
    p.resetJointState(turntable, 0, 0.7, 0.1)
    assert p.getLinkStates(turntable, [0, 0]) == (p.getLinkState(turntable, 0),) * 2
    assert p.getLinkStates(turntable, [0], 1, 1) == (p.getLinkState(turntable, 0, 1, 1),)


def test_links_beyond_the_last_are_none(turntable: int) -> None:
    assert p.getLinkState(turntable, 1) is None
    assert p.getLinkStates(turntable, [0, 5])[1] is None
    assert p.getLinkStates(turntable, []) == ()


@pytest.mark.parametrize(
    ("body", "link", "message"),
    [
        (0, -1, "getLinkState failed; invalid linkIndex"),
        (-1, 0, "getLinkState failed; invalid bodyUniqueId"),
        (9, 0, "getLinkState failed."),
    ],
)
def test_wrong_links_raise(turntable: int, body: int, link: int, message: str) -> None:
    with pytest.raises(p.error) as caught:
        p.getLinkState(body, link)
    assert str(caught.value) == message
    assert caught.value.__notes__, "a remedy follows"
