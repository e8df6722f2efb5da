"""Forces and torques in joints, against numbers recorded from PyBullet 3.2.7."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p

REVOLUTE, MIXED = [0, 0, 0], [0, 1, 4]
RECORDED = {
    ("revolute", 0): [
        [-6.109852, -44.569282, 29.193798, 31.634368, -1.691554, 0.891386],
        [-3.974595, -45.965393, 24.38103, -2.29827, -0.69019, 0.274474],
        [-2.756993, -43.858001, 21.046005, 3.207218, 0.55877, -0.000662],
    ],
    ("revolute", 2): [
        [-4.152736, -10.810378, -12.452843, -3.627876, 1.743781, 0.216208],
        [0.243662, -6.968067, -18.001785, -0.348403, 1.873365, -0.76333],
        [4.583731, -0.93021, -18.706329, -1.420968, -0.603313, -0.2149],
    ],
    ("mixed", 0): [
        [17.864742, 2.509786, 17.658, 1.301978, 3.969547, -0.050196],
        [0.0, 1.513678, 11.4777, 0.532627, 4.006275, -2.710637],
        [16.025099, 1.047931, 7.9461, 0.0, 0.0, -0.767165],
    ],
    ("mixed", 2): [
        [2.650924, 0.015677, 2.956216, -0.796497, 0.956692, -0.000314],
        [0.0, 4.773648, 2.247789, -0.004777, 1.585519, -1.308933],
        [10.7432, 2.079797, 1.866196, 0.22746, -0.761733, -0.162425],
    ],
}
"""Of three joints, by their types and the mass of the base, after five steps."""
DAMPED = [
    (0.3202234401, 4.7803080838),
    (0.3395790597, 4.577734975),
    (0.3581341404, 4.3908246489),
    (0.3759502524, 4.2182488633),
]
"""Angle and speed of a hinge after each of four steps."""


@pytest.mark.parametrize(("types", "base"), RECORDED)
def test_reactions_of_moving_joints(client: int, types: str, base: float) -> None:
    """Fixed and floating, with drag; a motor turns the second joint, or pushes along it."""
    p.setGravity(0, 0, -9.81)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.2])
    body = p.createMultiBody(
        base, shape, -1, [0, 0, 1], [0.1, 0.2, 0.3, 0.9273618495495703],
        linkMasses=[0.7, 0.4, 0.9], linkCollisionShapeIndices=[shape] * 3, linkVisualShapeIndices=[-1] * 3,
        linkPositions=[[0, 0.1, 0.25]] * 3, linkOrientations=[[0, 0, 0, 1]] * 3,
        linkInertialFramePositions=[[0.02, 0, 0.05]] * 3, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 3,
        linkParentIndices=[0, 1, 2], linkJointTypes=REVOLUTE if types == "revolute" else MIXED,
        linkJointAxis=[[0, 0, 1], [1, 0, 0], [0, 1, 0]],
    )  # fmt: skip
    for joint in range(3):
        p.enableJointForceTorqueSensor(body, joint, 1)
    p.setJointMotorControl2(body, 1, p.POSITION_CONTROL, targetPosition=0.5, force=20)
    if base:
        p.resetBaseVelocity(body, [0.3, 0.2, 0.1], [1, 2, 3])
    for _ in range(5):
        p.stepSimulation()
    found = [p.getJointState(body, joint)[2] for joint in range(3)]
    np.testing.assert_allclose(found, RECORDED[types, base], atol=2e-6)


def test_a_limit_is_not_in_the_reaction_along_its_joint(client: int, tmp_path: Path) -> None:
    """A link rests on the lower limit of its prismatic joint: its weight is across the axis only."""
    file = tmp_path / "slide.urdf"
    file.write_text(
        """<robot name="slide"><link name="a"/><link name="b"><inertial><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0.6 0 0.8"/>
<limit lower="0" upper="1" effort="0" velocity="9"/></joint></robot>"""
    )
    p.setGravity(0, 0, -10)
    body = p.loadURDF(str(file), useFixedBase=True)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    p.enableJointForceTorqueSensor(body, 0, 1)
    for _ in range(240):
        p.stepSimulation()
    axis, weight = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.0, 20.0])
    assert p.getJointState(body, 0)[2][:3] == pytest.approx(weight - (weight @ axis) * axis, abs=1e-2)


def test_joint_damping_is_of_the_speed_before_all_substeps(client: int, tmp_path: Path) -> None:
    file = tmp_path / "damped.urdf"
    file.write_text(
        """<robot name="r"><link name="a"/><link name="b"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<dynamics damping="0.8"/></joint></robot>"""
    )
    p.setGravity(0, 0, -10)
    p.setPhysicsEngineParameter(numSubSteps=3)
    body = p.loadURDF(str(file), useFixedBase=True)
    p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
    p.resetJointState(body, 0, 0.3, 5.0)
    found = []
    for _ in range(4):
        p.stepSimulation()
        found.append(p.getJointState(body, 0)[:2])
    np.testing.assert_allclose(found, DAMPED, atol=1e-8)


def test_a_deep_contact_pushes_a_link_at_its_own_point(client: int) -> None:
    """Two spheres are 0.1 m in the ground and slide: friction acts at their lowest points."""
    p.setGravity(0, 0, -9.81)
    ground = p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 1])
    p.createMultiBody(0, ground, basePosition=[0, 0, -1])
    foot = p.createCollisionShape(p.GEOM_SPHERE, radius=0.08)
    body = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [0, 0, 0.28],
        linkMasses=[0.7, 0.4], linkCollisionShapeIndices=[foot] * 2, linkVisualShapeIndices=[-1] * 2,
        linkPositions=[[0.2, 0.1, -0.3], [-0.2, 0.05, -0.3]], linkOrientations=[[0, 0, 0, 1]] * 2,
        linkInertialFramePositions=[[0, 0, 0]] * 2, linkInertialFrameOrientations=[[0, 0, 0, 1]] * 2,
        linkParentIndices=[0, 0], linkJointTypes=[p.JOINT_FIXED, p.JOINT_REVOLUTE],
        linkJointAxis=[[0, 0, 1], [0, 1, 0]],
    )  # fmt: skip
    p.resetBaseVelocity(body, [0.5, 0.2, 0])
    for joint in range(2):
        p.enableJointForceTorqueSensor(body, joint, 1)
    p.stepSimulation()
    found = [state[2] for state in p.getJointStates(body, [0, 1])]
    recorded = [
        [68.972586, 64.544557, -337.430159, 7.636359, -11.080666, 0.064185],
        [21.842629, 26.295838, -122.07398, 3.975157, 0.0, 0.036677],
    ]
    np.testing.assert_allclose(found, recorded, atol=2e-5)
