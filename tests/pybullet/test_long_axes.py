"""Joint axes that are no unit vectors, and massless parts between others; the numbers are PyBullet 3.2.7's.

Bullet turns a joint by its velocity, and counts that as many times larger as its axis is long where it
computes velocities of links and forces.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

LINK = """<link name="{name}"><inertial><origin xyz="0.1 0.05 0.2"/><mass value="1"/>
<inertia ixx="0.02" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="j" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0.2 0.3"/>
<axis xyz="{axis}"/><limit lower="-3" upper="3" effort="100" velocity="100"/></joint>"""
EXPECTED = {
    (1, 1, 0): (
        [0.33678102, 3.40824824],
        [-0.00396703, 0.04770635, 0.00525563, -0.52425695, -0.81882712, 0.05778762],
        [0.36755739, -0.41005434, -0.51356953, 2.88221617, 2.59118529, 0.06605471],
    ),
    (0, 0.5, 0): (
        [0.4226401, 13.67050696],
        [-0.00324159, 0.09693957, 0.16308613, 0.8744571, -3.21016198, 0.40467392],
        [0.12877736, -0.07849621, -0.60910446, 0.850021, 3.6248744, 0.45336324],
    ),
}
"""By axis: position and velocity of the joint, velocities of the base, and of the link."""


@pytest.mark.parametrize("axis", EXPECTED)
def test_a_joint_about_an_axis_of_another_length(
    client: int, tmp_path: Path, axis: tuple[float, ...]
) -> None:
    links = LINK.format(name="a") + LINK.format(name="b")
    joint = JOINT.format(axis=" ".join(map(str, axis)))
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{links}{joint}</robot>', encoding="utf-8")
    p.setGravity(0, 0, -10)
    body = p.loadURDF(str(tmp_path / "r.urdf"), [0, 0, 1], flags=p.URDF_USE_INERTIA_FROM_FILE)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    p.resetJointState(body, 0, 0.3, 2)
    for _ in range(3):
        p.setJointMotorControl2(body, 0, p.TORQUE_CONTROL, force=5)
        p.stepSimulation()
    of_joint, of_base, of_link = EXPECTED[axis]
    state = p.getLinkState(body, 0, computeLinkVelocity=True, computeForwardKinematics=True)
    assert p.getJointInfo(body, 0)[13] == pytest.approx(axis)
    assert p.getJointState(body, 0)[:2] == pytest.approx(of_joint, abs=2e-8)
    assert np.concatenate(p.getBaseVelocity(body)) == pytest.approx(np.array(of_base), abs=2e-8)
    assert np.concatenate(state[6:8]) == pytest.approx(np.array(of_link), abs=2e-8)


def test_a_leg_on_massless_sliders(client: int, tmp_path: Path) -> None:
    (tmp_path / "leg.xml").write_text(
        """<mujoco><worldbody><body name="a" pos="0 0 1"><joint type="slide" axis="1 0 0"/>
<joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0.1 0.02 0 0.4" size="0.05"/>
<body name="b" pos="0 0 0.1"><joint type="hinge" axis="0 -1 1"/>
<geom type="capsule" fromto="0 0 0 0.1 0 -0.3" size="0.04"/></body></body></worldbody></mujoco>""",
        encoding="utf-8",
    )
    p.setGravity(0, 0, -10)
    [body] = p.loadMJCF(str(tmp_path / "leg.xml"))
    joints = (0, 1, 2, 4)
    p.setJointMotorControlArray(body, joints, p.VELOCITY_CONTROL, forces=[0] * 4)
    for _ in range(20):
        p.setJointMotorControlArray(body, joints, p.TORQUE_CONTROL, forces=[5, 20, -1, 0.5])
        p.stepSimulation()
    expected = [
        [0.0133352843, 0.3110441722],
        [-0.0209366414, -0.4738992247],
        [-0.0462074043, -1.0835086133],
        [-0.0569423319, -1.3374495926],
    ]
    found = [p.getJointState(body, joint)[:2] for joint in joints]
    assert np.array(found) == pytest.approx(np.array(expected), abs=1e-8)
