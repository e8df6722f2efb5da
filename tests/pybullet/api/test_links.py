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


SIGNED = {
    ((0, 0, 0.6, -0.8), 2.5): (
        (0, 0, -0.6, 0.8), (-0.1844, -0.4790, 0.1214, 0.8496), (0.5690, -0.1903, 0.4560, 0.6573),
    ),
    ((0, 0.96, 0, -0.28), 0.0): ((0, 0.96, 0, -0.28), (0.64, 0.36, 0.48, -0.48), (0, -0.6, 0, 0.8)),
    ((-0.96, 0, 0.28, 0), 2.5): (
        (0.96, 0, -0.28, 0), (-0.4443, 0.6217, 0.6440, -0.0357), (-0.2951, 0.8882, -0.1110, 0.3340),
    ),
    ((0.48, -0.8, 0.36, 0), 0.0): (
        (-0.48, 0.8, -0.36, 0), (0.2832, 0.8448, 0.1664, -0.4224), (-0.168, 0.64, -0.576, -0.48),
    ),
    ((0.48, -0.8, 0.36, 0), -3.0): (
        (-0.48, 0.8, -0.36, 0), (-0.0966, 0.4238, -0.1650, 0.8853), (0.6503, 0.1223, -0.4381, 0.6085),
    ),
}  # fmt: skip
"""Orientation of a base and angle of its joint to the quaternions that PyBullet 3.2.7 shows of the base, of
the link's inertial frame and of the link frame."""


@pytest.mark.parametrize(("given", "shown"), SIGNED.items())
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_quaternions_have_the_sign_that_is_read_from_a_matrix(
    client: int, mass: float, given: Any, shown: Any
) -> None:
    body = p.createMultiBody(
        mass, -1, linkMasses=[1], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[[0, 0.6, 0, 0.8]],
        linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0.8, 0, 0, -0.6]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    turn, angle = given
    p.resetBasePositionAndOrientation(body, [0, 0, 0], turn)
    p.resetJointState(body, 0, angle)
    state = p.getLinkState(body, 0, computeForwardKinematics=1)
    for together in (state, p.getLinkStates(body, [0], 0, 1)[0], p.getLinkState(body, 0, 1, 1)):
        found = p.getBasePositionAndOrientation(body)[1], together[1], together[5]
        assert np.array(found) == pytest.approx(np.array(shown), abs=1e-4)
    assert state[3] == pytest.approx((-0.8, 0, 0, 0.6))
    assert p.getDynamicsInfo(body, 0)[4] == state[3]


def test_quaternions_of_shapes_have_that_sign(client: int) -> None:
    shape = {"halfExtents": [0.1, 0.1, 0.1]}
    turn = [0.6, 0, 0, -0.8]
    body = p.createMultiBody(
        1,
        p.createCollisionShape(p.GEOM_BOX, collisionFrameOrientation=turn, **shape),
        p.createVisualShape(p.GEOM_BOX, visualFrameOrientation=turn, **shape),
    )
    for rows in (p.getVisualShapeData(body), p.getCollisionShapeData(body, -1)):
        assert rows[0][6] == pytest.approx((-0.6, 0, 0, 0.8))
