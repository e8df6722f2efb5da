"""Bodies, joints, motors, contacts and queries: PyBullet's rules and closed forms."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import roboyard.pybullet as p
import roboyard.pybullet_data as data

ROD = """<robot name="rod"><link name="world"/><link name="arm">
<inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
</link><joint name="pivot" type="{kind}"><parent link="world"/><child link="arm"/><origin xyz="0 0 3"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="0.5" effort="7" velocity="9"/>
<dynamics damping="{damping}" friction="0.2"/></joint></robot>"""

OFFSET = """<robot name="offset"><link name="base">
<inertial><origin xyz="0.1 -0.2 0.3" rpy="0 0 0.5"/><mass value="2"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
<collision><geometry><box size="0.2 0.3 0.4"/></geometry></collision></link>
<link name="tip"><inertial><origin xyz="0 0 0.25" rpy="0.2 0 0"/><mass value="0.5"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.015"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="tip"/>
<origin xyz="0.05 0 0.2" rpy="0 0.3 0"/>
<axis xyz="0 1 0"/><limit lower="-1.5" upper="1.5" effort="20" velocity="3"/></joint></robot>"""


@pytest.fixture
def rod(client: int, tmp_path: Path) -> int:
    return load(tmp_path, ROD.format(kind="continuous", damping=0))


def load(folder: Path, text: str, **options: object) -> int:
    path = folder / f"robot{len(list(folder.iterdir()))}.urdf"
    path.write_text(text)
    return p.loadURDF(str(path), **options)


def box(
    half: tuple[float, float, float], mass: float, position: tuple[float, float, float], **dynamics: float
) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half)
    body = p.createMultiBody(mass, shape, basePosition=position)
    if dynamics:
        p.changeDynamics(body, -1, **dynamics)
    return body


def steps(count: int) -> None:
    for _ in range(count):
        p.stepSimulation()


def free(body: int) -> None:
    """No motors and no drag."""
    for joint in range(p.getNumJoints(body)):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    p.changeDynamics(body, -1, linearDamping=0, angularDamping=0)


# ------------------------------------------------------------------------------------------- ids and frames


def test_ids_freed_last_come_back_first(client: int) -> None:
    bodies = [box((0.1, 0.1, 0.1), 1, (i, 0, 0)) for i in range(6)]
    assert bodies == list(range(6))
    p.removeBody(1)
    assert [p.getBodyUniqueId(i) for i in range(p.getNumBodies())] == [0, 5, 2, 3, 4]
    p.removeBody(3)
    p.removeBody(77)
    assert [p.getBodyUniqueId(i) for i in range(p.getNumBodies())] == [0, 5, 2, 4]
    assert [box((0.1, 0.1, 0.1), 1, (i, 0, 0)) for i in range(3)] == [3, 1, 6]
    assert (p.getBodyUniqueId(-1), p.getBodyUniqueId(50)) == (-1, -1)
    assert p.getBodyInfo(6) == (b"link0", b"")


def test_reset_keeps_the_time_step_and_forgets_the_rest(client: int) -> None:
    box((0.1, 0.1, 0.1), 1, (0, 0, 0))
    p.addUserData(0, "key", "value")
    state = p.saveState()
    p.setGravity(1, 2, 3)
    p.setPhysicsEngineParameter(numSolverIterations=9, numSubSteps=3)
    p.setTimeStep(0.02)
    p.setAdditionalSearchPath(data.getDataPath())
    p.resetSimulation()
    found = p.getPhysicsEngineParameters()
    assert (found["fixedTimeStep"], found["numSubSteps"], found["numSolverIterations"]) == (0.02, 3, 50)
    assert found["gravityAccelerationZ"] == 0.0
    assert p.getNumBodies() == 0
    assert p.getUserData(0) is None
    with pytest.raises(p.error, match=r"(?m)^Couldn't restore state\.$"):
        p.restoreState(state)
    assert p.loadURDF("plane.urdf") == 0
    assert p.createCollisionShape(p.GEOM_SPHERE, radius=1) == 0


def test_user_data_belongs_to_bodies(client: int) -> None:
    for i in range(2):
        box((0.1, 0.1, 0.1), 1, (i, 0, 0))
    assert [p.addUserData(0, "k", "v"), p.addUserData(0, "k", "w", -1, 3), p.addUserData(1, "k", "x")] == [
        0,
        1,
        2,
    ]
    assert p.addUserData(0, "k", "vv") == 0
    assert (p.getUserData(0), p.getUserDataId(0, "k"), p.getUserDataId(0, "q")) == (b"vv", 0, -1)
    assert [p.getUserDataInfo(0, i) for i in range(2)] == [(0, b"k", 0, -1, -1), (1, b"k", 0, -1, 3)]
    p.removeBody(0)
    assert p.getNumUserData(0) == 0
    assert p.getUserData(2) == b"x"
    with pytest.raises(p.error, match=r"(?m)^Error in addUserData command\.$"):
        p.addUserData(0, "k", "v")


def test_poses_are_those_of_the_inertial_frame(client: int, tmp_path: Path) -> None:
    start = Rotation.from_euler("xyz", [0.1, -0.4, 1.0])
    body = load(tmp_path, OFFSET, basePosition=[1, 2, 3], baseOrientation=start.as_quat())
    position, orientation = p.getBasePositionAndOrientation(body)
    np.testing.assert_allclose(position, np.array([1, 2, 3]) + start.apply([0.1, -0.2, 0.3]), atol=1e-12)
    wanted = start * Rotation.from_euler("z", 0.5)
    assert (Rotation.from_quat(orientation).inv() * wanted).magnitude() < 1e-9
    p.resetJointState(body, 0, 0.7, 0.3)
    p.resetBaseVelocity(body, [1, 0, 0], [0, 0, 2])
    p.resetBasePositionAndOrientation(body, [0, 0, 1], [0, 0, 0, 2])
    np.testing.assert_allclose(p.getBasePositionAndOrientation(body)[0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(p.getBasePositionAndOrientation(body)[1], [0, 0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(p.getBaseVelocity(body), 0.0, atol=1e-12)
    assert p.getJointState(body, 0)[:2] == (0.7, 0.3)
    state = p.getLinkState(body, 0, 1, 1)
    link = Rotation.from_quat(state[5])
    np.testing.assert_allclose(state[0], np.array(state[4]) + link.apply([0, 0, 0.25]), atol=1e-6)
    np.testing.assert_allclose(state[2], [0, 0, 0.25])
    base = Rotation.from_euler("z", -0.5)
    hinge = np.array([0, 0, 1]) + base.apply([0.05 - 0.1, 0.2, 0.2 - 0.3])
    np.testing.assert_allclose(state[4], hinge, atol=1e-6)
    axis = base.apply(Rotation.from_euler("y", 0.3).apply([0, 1, 0]))
    np.testing.assert_allclose(state[7], 0.3 * axis, atol=1e-9)
    np.testing.assert_allclose(state[6], np.cross(0.3 * axis, np.array(state[0]) - hinge), atol=1e-6)


def test_base_velocity_is_that_of_the_centre_of_mass(client: int, tmp_path: Path) -> None:
    body = load(tmp_path, OFFSET, baseOrientation=[0, 0, 0.6, 0.8])
    p.resetBaseVelocity(body, [1, 2, 3], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(p.getBaseVelocity(body), [[1, 2, 3], [0.1, 0.2, 0.3]], atol=1e-12)
    p.resetBaseVelocity(body, angularVelocity=[0, 0, 5])
    np.testing.assert_allclose(p.getBaseVelocity(body), [[1, 2, 3], [0, 0, 5]], atol=1e-12)


def test_link_frames_lag_a_step_until_asked_for_fresh_ones(rod: int) -> None:
    p.setGravity(0, 0, -9.81)
    free(rod)
    p.resetJointState(rod, 0, 0.5, 1.0)
    before = p.getLinkState(rod, 0)[0]
    p.stepSimulation()
    assert p.getLinkState(rod, 0)[0] == before
    q = p.getJointState(rod, 0)[0]
    np.testing.assert_allclose(
        p.getLinkState(rod, 0, computeForwardKinematics=1)[0], [-0.5 * sin(q), 0, 3 - 0.5 * cos(q)], atol=1e-9
    )
    assert p.getLinkState(rod, 5) is None


def test_reading_velocities_leaves_link_frames_a_step_behind(rod: int) -> None:
    p.setGravity(0, 0, -9.81)
    free(rod)
    p.resetJointState(rod, 0, 0.5, 4.0)
    before = p.getLinkState(rod, 0)
    p.stepSimulation()
    q, speed = p.getJointState(rod, 0)[:2]
    state = p.getLinkState(rod, 0, computeLinkVelocity=1)
    assert state[:6] == before[:6] == p.getLinkState(rod, 0) == p.getLinkStates(rod, [0])[0]
    # Bullet keeps velocities in link axes, and turns them with the frame it shows: at 0.5 rad, not at q
    np.testing.assert_allclose(state[6], [-0.5 * speed * cos(0.5), 0, 0.5 * speed * sin(0.5)], atol=1e-9)
    p.performCollisionDetection()
    assert p.getLinkState(rod, 0) == before[:6]
    fresh = p.getLinkState(rod, 0, computeLinkVelocity=1, computeForwardKinematics=1)
    np.testing.assert_allclose(fresh[6], [-0.5 * speed * cos(q), 0, 0.5 * speed * sin(q)], atol=1e-9)


@pytest.mark.parametrize(
    ("fixed", "turn"),
    [
        (False, (-0.040538951, -0.0822201175, 0.0718985302, 0.993190338)),
        (True, (0, 0, 0.247403959, 0.968912422)),
    ],
)
def test_the_frame_of_a_fixed_base_is_not_that_of_its_principal_axes(
    client: int, tmp_path: Path, fixed: bool, turn: tuple[float, ...]
) -> None:
    """PyBullet 3.2.7 gives a base that a script fixes neither mass nor inertia."""
    inertia = '<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.004" ixz="-0.003" iyz="0.002"/>'
    inertial = f'<inertial><origin xyz="0.1 0.2 0.3" rpy="0 0 0.5"/><mass value="2"/>{inertia}</inertial>'
    text = f'<robot name="base"><link name="base">{inertial}</link></robot>'
    flags = p.URDF_USE_INERTIA_FROM_FILE
    body = load(tmp_path, text, basePosition=[0, 0, 1], useFixedBase=fixed, flags=flags)
    position, orientation = p.getBasePositionAndOrientation(body)
    assert position == pytest.approx((0.1, 0.2, 1.3), abs=1e-12)
    assert orientation == pytest.approx(turn, abs=1e-8)
    assert p.getDynamicsInfo(body, -1)[4] == pytest.approx(turn, abs=1e-8)


def test_inertia_comes_from_shapes_unless_the_file_is_asked_for(client: int, tmp_path: Path) -> None:
    body = load(tmp_path, OFFSET)
    info = p.getDynamicsInfo(body, -1)
    turn = np.abs(Rotation.from_euler("z", -0.5).as_matrix())
    half = turn @ [0.1, 0.15, 0.2] + 0.001
    x, y, z = 4 * half**2
    np.testing.assert_allclose(info[2], np.array([y + z, x + z, x + y]) * 2 / 12, rtol=1e-9)
    assert (info[0], info[1], info[10]) == (2.0, 0.5, 2)
    tip = p.getDynamicsInfo(body, 0)[2]
    np.testing.assert_allclose(tip, 0.5 / 12 * 2 * 0.002**2, rtol=1e-9)
    from_file = load(tmp_path, OFFSET, flags=p.URDF_USE_INERTIA_FROM_FILE)
    np.testing.assert_allclose(p.getDynamicsInfo(from_file, -1)[2], [0.02, 0.03, 0.04], rtol=1e-12)
    fixed = load(tmp_path, OFFSET, useFixedBase=True)
    assert p.getDynamicsInfo(fixed, -1)[0] == 0.0


# ------------------------------------------------------------------------------------------------- dynamics


def test_a_box_falls_with_bullets_drag(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    body = box((0.5, 0.5, 0.5), 1, (0, 0, 100))
    p.resetBaseVelocity(body, [3, -1, 2], [0, 0, 0])
    v, dt, k = np.array([3.0, -1.0, 2.0]), 1 / 240, 0.04
    for _ in range(240):
        v = v + dt * (np.array([0, 0, -9.81]) - v * (k + k * np.linalg.norm(v)))
        p.stepSimulation()
    np.testing.assert_allclose(p.getBaseVelocity(body)[0], v, atol=1e-6)
    np.testing.assert_allclose(v, [2.40160, -0.80053, -7.06465], atol=1e-5)


def test_a_motor_closes_a_tenth_of_the_error_in_each_step(rod: int) -> None:
    p.setJointMotorControl2(rod, 0, p.POSITION_CONTROL, targetPosition=0.4)
    q = 0.0
    for _ in range(20):
        p.stepSimulation()
        q += 0.1 * (0.4 - q)
        assert p.getJointState(rod, 0)[0] == pytest.approx(q, abs=1e-3)


def test_a_motor_reaches_its_velocity_under_load(rod: int) -> None:
    p.setGravity(0, 0, -9.81)
    p.resetJointState(rod, 0, 0.4)  # 2 kg at 0.5 m: a load of 3.8 N m, where the inertia is 0.5 kg m²
    p.setJointMotorControl2(rod, 0, p.VELOCITY_CONTROL, targetVelocity=0.0, force=1000)
    p.stepSimulation()
    assert abs(p.getJointState(rod, 0)[1]) < 1e-5


def test_velocity_gain_is_the_share_of_the_velocity_error(rod: int) -> None:
    p.changeDynamics(rod, -1, linearDamping=0, angularDamping=0)
    p.setJointMotorControl2(rod, 0, p.VELOCITY_CONTROL, targetVelocity=1.0, velocityGain=0.1, force=1000)
    found = []
    for _ in range(3):
        p.stepSimulation()
        found.append(p.getJointState(rod, 0)[1])
    np.testing.assert_allclose(found, [0.1, 0.19, 0.271], atol=1e-3)


def test_the_first_motor_holds_and_reports_its_torque(rod: int) -> None:
    p.setGravity(0, 0, -9.81)
    p.resetJointState(rod, 0, pi / 2)
    steps(50)
    assert p.getJointState(rod, 0)[0] == pytest.approx(pi / 2, abs=2e-3)
    held = p.getJointState(rod, 0)[3]
    assert abs(held) == pytest.approx(2 * 9.81 * 0.5, rel=1e-2)
    p.setJointMotorControl2(rod, 0, p.VELOCITY_CONTROL, force=0)
    steps(10)
    assert p.getJointState(rod, 0)[3] == held
    assert p.getJointState(rod, 0)[0] != pytest.approx(pi / 2, abs=2e-3)


def test_torques_act_for_one_step_and_spring_dampers_for_all(rod: int) -> None:
    free(rod)
    inertia = 2 * 0.5**2 + p.getDynamicsInfo(rod, 0)[2][1]
    p.setJointMotorControl2(rod, 0, p.TORQUE_CONTROL, force=1.5)
    steps(1)
    speed = p.getJointState(rod, 0)[1]
    assert speed == pytest.approx(1.5 / inertia / 240, rel=1e-6)
    steps(1)
    assert p.getJointState(rod, 0)[1] == pytest.approx(speed, rel=1e-6)
    p.setJointMotorControl2(
        rod, 0, p.PD_CONTROL, targetPosition=0.3, positionGain=20, velocityGain=5, force=1000
    )
    steps(2000)
    np.testing.assert_allclose(p.getJointState(rod, 0)[:2], [0.3, 0.0], atol=1e-4)


def test_limits_hold_and_targets_beyond_them_are_cut(client: int, tmp_path: Path) -> None:
    body = load(tmp_path, ROD.format(kind="revolute", damping=0))
    assert p.getJointInfo(body, 0)[6:12] == (0.0, 0.2, -1.0, 0.5, 7.0, 9.0)
    p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, targetPosition=2.0)
    steps(240)
    assert p.getJointState(body, 0)[0] == pytest.approx(0.5, abs=1e-3)
    free(body)
    p.setGravity(9.81, 0, 0)
    steps(480)
    assert p.getJointState(body, 0)[0] == pytest.approx(-1.0, abs=2e-3)


def test_array_commands_check_their_lengths(rod: int) -> None:
    p.setJointMotorControlArray(rod, [0], p.POSITION_CONTROL, targetPositions=[0.2], forces=[50])
    with pytest.raises(
        p.error, match=r"(?m)^number of target positions should match the number of joint indices$"
    ):
        p.setJointMotorControlArray(rod, [0], p.POSITION_CONTROL, targetPositions=[0.2, 0.3])
    p.setJointMotorControl2(bodyIndex=rod, jointIndex=0, controlMode=p.VELOCITY_CONTROL, force=1)
    with pytest.raises(TypeError, match="jointIndex"):
        p.setJointMotorControl2(bodyIndex=rod, controlMode=p.VELOCITY_CONTROL)
    p.setJointMotorControl(rod, 0, p.POSITION_CONTROL, 0.1, 500.0)
    steps(100)
    assert p.getJointState(rod, 0)[0] == pytest.approx(0.1, abs=1e-3)


def test_forces_in_link_axes_act_from_the_centre_of_mass(client: int) -> None:
    body = box((0.1, 0.2, 0.3), 2.0, (0, 0, 5), linearDamping=0, angularDamping=0)
    p.resetBasePositionAndOrientation(body, [0, 0, 5], p.getQuaternionFromEuler([0, 0, pi / 2]))
    p.applyExternalForce(body, -1, [240, 0, 0], [0, 0.1, 0], p.LINK_FRAME)
    p.stepSimulation()
    linear, angular = p.getBaseVelocity(body)
    np.testing.assert_allclose(linear, [0, 0.5, 0], atol=1e-9)
    moment = 2.0 / 12 * (0.2**2 + 0.4**2)
    np.testing.assert_allclose(angular, [0, 0, -0.1 / moment], atol=1e-9)
    with pytest.raises(p.error, match=r"(?m)^flag has to be either WORLD_FRAME or LINK_FRAME$"):
        p.applyExternalForce(body, -1, [1, 0, 0], [0, 0, 0], 77)


def test_states_are_restored_exactly(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    body = box((0.1, 0.1, 0.1), 1, (0, 0, 0.3))
    steps(20)
    state = p.saveState()
    steps(60)
    first = p.getBasePositionAndOrientation(body)
    p.restoreState(state)
    steps(60)
    np.testing.assert_allclose(p.getBasePositionAndOrientation(body)[0], first[0], atol=1e-9)


def test_inverse_dynamics_jacobian_and_mass_matrix_of_a_rod(rod: int) -> None:
    p.setGravity(0, 0, -9.81)
    inertia = 2 * 0.5**2 + p.getDynamicsInfo(rod, 0)[2][1]
    assert p.calculateMassMatrix(rod, [0.4])[0][0] == pytest.approx(inertia, rel=1e-9)
    (torque,) = p.calculateInverseDynamics(rod, [0.4], [0.0], [2.0])
    assert torque == pytest.approx(2 * inertia + 2 * 9.81 * 0.5 * sin(0.4), rel=1e-9)
    linear, angular = p.calculateJacobian(rod, 0, [0, 0, -1], [0.4], [0.0], [0.0])
    np.testing.assert_allclose(np.ravel(linear), [-cos(0.4), 0, sin(0.4)], atol=1e-12)
    np.testing.assert_allclose(np.ravel(angular), [0, 1, 0], atol=1e-12)
    with pytest.raises(p.error, match="need to match the number of DoF"):
        p.calculateJacobian(rod, 0, [0, 0, 0], [0.4, 0.5], [0.0], [0.0])


def test_a_floating_base_adds_its_angular_and_linear_velocity(client: int, tmp_path: Path) -> None:
    body = load(tmp_path, OFFSET)
    matrix = np.array(p.calculateMassMatrix(body, [0.2]))
    assert matrix.shape == (7, 7)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-12)
    np.testing.assert_allclose(matrix[3:6, 3:6], 2.5 * np.eye(3), atol=1e-9)
    p.setGravity(0, 0, -9.81)
    efforts = p.calculateInverseDynamics(body, [0, 0, 1, 0, 0, 0, 1, 0.2], [0] * 7, [0] * 7)
    np.testing.assert_allclose(efforts[:3], [0, 0, 2.5 * 9.81], atol=1e-9)


# -------------------------------------------------------------------------------------------------- queries


def test_a_resting_box_reports_its_weight_at_its_corners(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    body = box((0.1, 0.2, 0.05), 3.0, (0, 0, 0.0501))
    steps(240)
    contacts = p.getContactPoints(body, ground)
    assert len(contacts) == 4
    assert all(c[1:5] == (body, ground, -1, -1) and len(c) == 14 for c in contacts)
    assert sum(c[9] for c in contacts) == pytest.approx(3 * 9.81, rel=1e-2)
    assert all(c[7] == pytest.approx((0, 0, 1), abs=1e-3) for c in contacts)
    swapped = p.getContactPoints(ground, body)
    assert all(c[1:3] == (ground, body) and c[7] == pytest.approx((0, 0, -1), abs=1e-3) for c in swapped)
    assert p.getContactPoints(body, linkIndexA=0) == ()
    assert p.getContactPoints(99) == ()


def test_filters_let_bodies_through(client: int) -> None:
    p.setGravity(0, 0, -9.81)
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    a, b, c = (box((0.1, 0.1, 0.1), 1, (i, 0, 0.15)) for i in range(3))
    p.setCollisionFilterPair(ground, a, -1, -1, 0)
    p.setCollisionFilterGroupMask(b, -1, 0, 0)
    steps(120)
    heights = [p.getBasePositionAndOrientation(body)[0][2] for body in (a, b, c)]
    assert heights[0] < -0.5
    assert heights[1] < -0.5
    assert heights[2] == pytest.approx(0.1, abs=1e-3)


def test_rays_boxes_and_nearest_points(client: int) -> None:
    a = box((0.5, 0.5, 0.5), 1, (0, 0, 1))
    b = box((0.5, 0.5, 0.5), 1, (1.3, 0, 1))
    (hit,) = p.rayTest([0.1, 0, 5], [0.1, 0, -5])
    assert hit[:2] == (a, -1)
    np.testing.assert_allclose([hit[2], *hit[3], *hit[4]], [0.35, 0.1, 0, 1.5, 0, 0, 1], atol=1e-6)
    assert p.rayTest([9, 9, 5], [9, 9, -5]) == ((-1, -1, 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),)
    (second,) = p.rayTest([-5, 0, 1], [5, 0, 1], reportHitNumber=1)
    assert second[0] == a, "counted from the one made last"
    assert second[3][0] == pytest.approx(-0.5, abs=1e-3)
    np.testing.assert_allclose(p.getAABB(a), [(-0.5, -0.5, 0.5), (0.5, 0.5, 1.5)], atol=1e-9)
    assert p.getOverlappingObjects([0.4, -1, 0], [0.9, 1, 2]) == ((b, -1), (a, -1))
    assert p.getOverlappingObjects([50, 50, 50], [51, 51, 51]) is None
    (near,) = p.getClosestPoints(a, b, 1.0)
    assert near[8] == pytest.approx(0.3, abs=1e-6)
    assert near[7] == pytest.approx((-1, 0, 0), abs=1e-6)
    assert p.getClosestPoints(a, b, 0.2) == ()
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.2)
    (probe,) = p.getClosestPoints(a, -1, 5.0, collisionShapeB=ball, collisionShapePositionB=[0, 0, 3.0])
    assert probe[8] == pytest.approx(1.3, abs=1e-6)
    assert p.getNumBodies() == 2


def test_pictures_show_bodies_and_links(client: int, tmp_path: Path) -> None:
    load(tmp_path, OFFSET)
    body = box((0.5, 0.5, 0.5), 0, (0, 0, 0))
    view = p.computeViewMatrix([4, 0, 0], [0, 0, 0], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(60, 1.0, 0.1, 20)
    width, height, rgba, depth, ids = p.getCameraImage(41, 31, view, projection)
    assert (width, height, rgba.shape, rgba.dtype) == (41, 31, (31, 41, 4), np.uint8)
    assert (depth.dtype, ids.dtype) == (np.float32, np.int32)
    assert ids[15, 20] == body
    assert (ids[0, 0], depth[0, 0]) == (-1, 1.0)
    metres = 20 * 0.1 / (20 - 19.9 * float(depth[15, 20]))
    assert metres == pytest.approx(3.5, abs=1e-2)
    flagged = p.getCameraImage(41, 31, view, projection, flags=p.ER_SEGMENTATION_MASK_OBJECT_AND_LINKINDEX)[4]
    assert flagged[15, 20] == body
    with pytest.raises(p.error, match=r"(?m)^Error parsing view or projection matrix\.$"):
        p.getCameraImage(10, 10, [1, 2, 3], projection)


def test_debug_lines_appear_in_pictures_and_follow_their_body(client: int) -> None:
    body = box((0.1, 0.1, 0.1), 1, (0, 0, 1))
    view = p.computeViewMatrix([4, 0, 1], [0, 0, 1], [0, 0, 1])
    projection = p.computeProjectionMatrixFOV(40, 1.0, 0.1, 20)

    def reds() -> int:
        rgba = p.getCameraImage(64, 64, view, projection)[2]
        return int(((rgba[..., 0] > 150) & (rgba[..., 1] < 90)).sum())

    assert reds() == 0
    p.addUserDebugLine([0, -0.5, 0.3], [0, 0.5, 0.3], [1, 0, 0], lineWidth=2, parentObjectUniqueId=body)
    assert reds() > 15
    p.resetBasePositionAndOrientation(body, [0, 0, 50], [0, 0, 0, 1])
    assert reds() == 0


def test_shape_tables_repeat_what_was_made(client: int) -> None:
    shape = p.createCollisionShape(p.GEOM_CAPSULE, radius=0.1, height=0.4)
    look = p.createVisualShape(p.GEOM_CYLINDER, radius=0.2, length=0.3, rgbaColor=[1, 0, 0, 1])
    body = p.createMultiBody(1, shape, look, baseInertialFramePosition=[0, 0, 0.1])
    (row,) = p.getCollisionShapeData(body, -1)
    assert row[:5] == (body, -1, p.GEOM_CAPSULE, (0.4, 0.1, 0.0), b"")
    np.testing.assert_allclose(row[5], [0, 0, -0.1])
    (seen,) = p.getVisualShapeData(body)
    assert seen[:5] == (body, -1, p.GEOM_CYLINDER, (0.3, 0.2, 0.0), b"")
    assert seen[7] == (1.0, 0.0, 0.0, 1.0)
    p.changeVisualShape(body, -1, rgbaColor=[0, 1, 0, 0.5])
    assert p.getVisualShapeData(body)[0][7] == (0.0, 1.0, 0.0, 0.5)
    assert p.getVisualShapeData(99) == ()
    field = p.createCollisionShape(
        p.GEOM_HEIGHTFIELD,
        meshScale=[1, 2, 3],
        heightfieldData=[0, 1, 2, 3, 4, 5],
        numHeightfieldRows=3,
        numHeightfieldColumns=2,
    )
    ground = p.createMultiBody(0, field)
    np.testing.assert_allclose(p.getVisualShapeData(ground)[0][6], [0, 0, 0, 1], atol=1e-12)
    assert p.getCollisionShapeData(ground, -1) == (), "as PyBullet, which lists no terrain"
    ends = [p.rayTest([x, y, 50], [x, y, -50])[0][3][2] for x, y in ((-0.999, -0.999), (0.999, 0.999))]
    np.testing.assert_allclose(ends, [-7.5, 7.5], atol=0.02)


def test_inverse_kinematics_reaches(client: int) -> None:
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.02)
    zeros, units = [[0, 0, 0]] * 3, [[0, 0, 0, 1]] * 3
    arm = p.createMultiBody(
        0, shape, -1, [1, 2, 0.5], p.getQuaternionFromEuler([0, 0, 1.0]), linkMasses=[1, 1, 1],
        linkCollisionShapeIndices=[shape] * 3, linkVisualShapeIndices=[-1] * 3,
        linkPositions=[[0, 0, 0.1], [0.4, 0, 0], [0.4, 0, 0]], linkOrientations=units,
        linkInertialFramePositions=zeros, linkInertialFrameOrientations=units, linkParentIndices=[0, 1, 2],
        linkJointTypes=[p.JOINT_REVOLUTE] * 3, linkJointAxis=[[0, 0, 1], [0, 1, 0], [0, 1, 0]],
    )  # fmt: skip
    for joint, q in enumerate((0.2, -0.3, 0.5)):
        p.resetJointState(arm, joint, q)
    goal = p.getLinkState(arm, 2, computeForwardKinematics=1)[4]
    for joint, q in enumerate((0.0, -0.1, 0.3)):
        p.resetJointState(arm, joint, q)
    found = p.calculateInverseKinematics(arm, 2, goal, maxNumIterations=500, residualThreshold=1e-6)
    assert p.getJointState(arm, 1)[0] == -0.1
    for joint, q in enumerate(found):
        p.resetJointState(arm, joint, q)
    np.testing.assert_allclose(p.getLinkState(arm, 2, computeForwardKinematics=1)[4], goal, atol=2e-3)


# --------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: p.getBasePositionAndOrientation(99), "GetBasePositionAndOrientation failed."),
        (lambda: p.getBaseVelocity(99), "getBaseVelocity failed."),
        (lambda: p.getJointInfo(0, 99), "GetJointInfo failed."),
        (lambda: p.getJointInfo(99, 0), "GetJointInfo failed."),
        (lambda: p.getJointState(0, 99), "getJointState failed (2)."),
        (lambda: p.getJointState(99, 0), "getJointState failed."),
        (lambda: p.getJointStates(0, [99]), "Joint index out-of-range."),
        (lambda: p.getLinkState(0, -1), "getLinkState failed; invalid linkIndex"),
        (lambda: p.getDynamicsInfo(99, -1), "getDynamicsInfo failed; invalid return status"),
        (lambda: p.getBodyInfo(99), "Couldn't get body info"),
        (lambda: p.getAABB(99), "getAABB failed."),
        (lambda: p.loadURDF("none.urdf"), "Cannot load URDF file."),
        (lambda: p.loadURDF("none.urdf", [0, 0]), "Cannot convert basePosition."),
        (lambda: p.createCollisionShape(77), "createCollisionShape failed."),
        (lambda: p.createCollisionShape(p.GEOM_MESH, fileName="none.obj"), "createCollisionShape failed."),
        (lambda: p.createVisualShape(77), "createVisualShape failed."),
        (lambda: p.createMultiBody(1, linkMasses=[1]), "All link arrays need to be same size."),
        (lambda: p.loadTexture("none.png"), "Error loading texture"),
        (lambda: p.restoreState(7), "Couldn't restore state."),
        (lambda: p.setJointMotorControl2(0, 99, p.POSITION_CONTROL), "Joint index out-of-range."),
        (lambda: p.resetJointState(99, 0, 0), "Joint index out-of-range."),
        (
            lambda: p.resetBasePositionAndOrientation(0, [1, 2], [0, 0, 0, 1]),
            "position needs a 3 coordinates [x,y,z].",
        ),
        (lambda: p.resetBaseVelocity(0), "expected at least linearVelocity and/or angularVelocity."),
        (
            lambda: p.changeDynamics(0, -1, contactStiffness=3),
            "Both contactStiffness and contactDamping needs to be set together.",
        ),
    ],
)
def test_messages_are_pybullets(rod: int, call: object, message: str) -> None:
    with pytest.raises(p.error) as caught:
        call()
    assert str(caught.value) == message


def test_unknown_ids_are_ignored_where_pybullet_ignores_them(rod: int) -> None:
    p.removeBody(99)
    p.changeDynamics(99, -1, mass=3)
    p.resetBaseVelocity(99, [1, 2, 3])
    p.applyExternalForce(99, -1, [1, 2, 3], [0, 0, 0], p.WORLD_FRAME)
    p.setCollisionFilterPair(99, 98, -1, -1, 0)
    assert p.getNumJoints(99) == 0
    assert p.createMultiBody(1, 99) == 1
    assert p.createVisualShape(p.GEOM_MESH, fileName="none.obj") == 0


def test_a_file_in_the_search_path_is_found_after_the_working_folder(
    client: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        (folder / "same.urdf").write_text(f'<robot name="{folder.name}"><link name="base"/></robot>')
    (there / "other.urdf").write_text('<robot name="other"><link name="base"/></robot>')
    monkeypatch.chdir(here)
    with pytest.raises(p.error) as caught:
        p.loadURDF("other.urdf")
    assert "setAdditionalSearchPath" in caught.value.__notes__[0]
    p.setAdditionalSearchPath(str(there))
    assert [p.getBodyInfo(p.loadURDF(name))[1] for name in ("same.urdf", "other.urdf")] == [b"here", b"other"]


def test_old_forms_of_load(client: int) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    a = p.loadURDF("cube.urdf", 1, 2, 3)
    b = p.loadURDF("cube.urdf", 1, 2, 3, 0, 0, sqrt(0.5), sqrt(0.5))
    c = p.loadURDF("cube.urdf", startPosX=1, startPosY=2, startPosZ=3)
    for body in (a, b, c):
        assert p.getBasePositionAndOrientation(body)[0] == (1.0, 2.0, 3.0)
    assert p.getEulerFromQuaternion(p.getBasePositionAndOrientation(b)[1])[2] == pytest.approx(pi / 2)
    with pytest.raises(TypeError):
        p.loadURDF("cube.urdf", 1, 2)
    with pytest.raises(TypeError):
        p.loadURDF()


def test_a_moment_goes_to_disk_and_back(client: int, tmp_path: Path) -> None:
    p.setGravity(0, 0, -9.81)
    load(tmp_path, OFFSET, basePosition=[0, 0, 5])
    p.resetJointState(0, 0, 0.4, 0.7)
    p.resetBaseVelocity(0, [1, 0, 0], [0, 1, 0])
    file = str(tmp_path / "moment.bullet")
    p.saveBullet(file)
    before = p.getBasePositionAndOrientation(0), p.getBaseVelocity(0), p.getJointState(0, 0)[:2]
    steps(30)
    p.restoreState(fileName=file)
    after = p.getBasePositionAndOrientation(0), p.getBaseVelocity(0), p.getJointState(0, 0)[:2]
    for one, other in zip(before[0] + before[1], after[0] + after[1], strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert before[2] == after[2]
    box((0.1, 0.1, 0.1), 1, (3, 0, 0))
    for name in (file, str(tmp_path / "none.bullet"), __file__):
        with pytest.raises(p.error, match=r"(?m)^Couldn't restore state\.$"):
            p.restoreState(fileName=name)


def test_a_mesh_files_picture_shows_through_the_urdfs_colour(client: int, tmp_path: Path) -> None:
    from PIL import Image

    Image.fromarray(np.array([[[255, 0, 0], [0, 0, 255]]], dtype=np.uint8)).save(tmp_path / "two.png")
    (tmp_path / "floor.mtl").write_text("newmtl m\nKd 0.6 0.6 0.6\nmap_Kd two.png\n")
    (tmp_path / "floor.obj").write_text(
        "mtllib floor.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        "usemtl m\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    (tmp_path / "floor.urdf").write_text(
        '<robot name="floor"><link name="a"><visual><geometry><mesh filename="floor.obj"/></geometry>'
        '<material name="white"><color rgba="1 1 1 1"/></material></visual></link></robot>'
    )
    body = p.loadURDF(str(tmp_path / "floor.urdf"))
    view = p.computeViewMatrix([0, 0, 2], [0, 0, 0], [0, 1, 0])
    projection = p.computeProjectionMatrixFOV(40, 1, 0.1, 10)

    def sides() -> np.ndarray:
        picture = p.getCameraImage(40, 40, view, projection)[2][..., :3].astype(float)
        return np.array([picture[20, 5], picture[20, 35]])

    (left_r, _, left_b), (right_r, _, right_b) = sides()
    assert left_r > left_b + 100
    assert right_b > right_r + 100
    p.changeVisualShape(body, -1, rgbaColor=[0, 0, 1, 1])
    (left_r, _, _), (_, _, right_b) = sides()
    assert left_r < 30
    assert right_b > 100


def test_bodies_made_between_steps_are_as_bodies_made_at_once(client: int):
    """Later ones need no compile of the world; what a script sees of them is the same."""

    def make(step: bool) -> list[int]:
        p.resetSimulation()
        p.setGravity(0, 0, 0 if step else -10)
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
        box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        bodies = []
        for k in range(16):
            frame = [0.02, 0, 0] if k % 3 == 0 else [0, 0, 0]
            shape, place = (box, ball)[k % 2], [0.4 * (k % 4), 0.4 * (k // 4), 0.2]
            bodies.append(p.createMultiBody(1 + k, shape, -1, place, baseInertialFramePosition=frame))
            p.changeDynamics(bodies[-1], -1, lateralFriction=0.1 * k, restitution=0.05 * k)
            if step:
                p.stepSimulation()
        p.setGravity(0, 0, -10)
        return bodies

    def states(bodies: list[int]) -> np.ndarray:
        for _ in range(60):
            p.stepSimulation()
        found = [np.hstack(p.getBasePositionAndOrientation(b) + p.getBaseVelocity(b)) for b in bodies]
        touching = [len(p.getContactPoints(b, 0)) for b in bodies]
        return np.column_stack([np.array(found), touching])

    at_once = states(make(step=False))
    one_by_one = make(step=True)
    assert p.getNumBodies() == 17
    assert p.getAABB(one_by_one[-1])[1][2] == pytest.approx(0.3, abs=0.01)
    np.testing.assert_allclose(states(one_by_one), at_once, atol=1e-7)


def test_a_fixed_base_is_put_where_it_was_before(client: int) -> None:
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    body, ball = p.createMultiBody(0, box), p.createMultiBody(1, box)
    first, second, turn = (1.0, 2.0, 3.0), (4.0, 5.0, 6.0), (0.0, 0.0, 0.0, 1.0)
    saved = p.saveState()
    for place in (first, first, second, first, second):
        p.resetBasePositionAndOrientation(body, place, turn)
        assert p.getBasePositionAndOrientation(body) == (place, turn)
    p.restoreState(saved)
    p.resetBasePositionAndOrientation(body, second, turn)
    assert p.getBasePositionAndOrientation(body) == (second, turn)
    for _ in range(2):  # a floating one falls in between
        p.resetBasePositionAndOrientation(ball, first, turn)
        p.setGravity(0, 0, -10)
        p.stepSimulation()
        p.resetBasePositionAndOrientation(ball, first, turn)
        assert p.getBasePositionAndOrientation(ball)[0] == first
        assert p.getBaseVelocity(ball)[0] == (0, 0, 0)
    p.resetBaseVelocity(ball, [1, 2, 3], [4, 5, 6])
    p.resetBaseVelocity(ball, [0, 0, 0], [0, 0, 0])
    assert p.getBaseVelocity(ball) == ((0, 0, 0), (0, 0, 0))


def test_time_steps_that_are_not_positive_advance_nothing_as_in_pybullet(client: int) -> None:
    p.setTimeStep(0)
    p.setGravity(0, 0, -10)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [0, 0, 1])
    p.stepSimulation()
    p.setTimeStep(-0.01)
    p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0] == (0.0, 0.0, 1.0)
    assert p.getBaseVelocity(ball)[0] == (0.0, 0.0, 0.0)
    p.setPhysicsEngineParameter(fixedTimeStep=0.01)
    p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0] == pytest.approx((0.0, 0.0, 0.999))
    p.setTimeStep(0)
    p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0] == pytest.approx((0.0, 0.0, 0.999))


def test_velocities_are_bounded_at_the_centre_of_mass(client: int) -> None:
    """A body beside its frame: none of the six components is above 100; numbers of PyBullet 3.2.7."""
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.05, 0.2])
    body = p.createMultiBody(
        1, shape, -1, [0, 0, 1], [0.1, 0.2, 0.3, 0.9273618], baseInertialFramePosition=[0.05, -0.02, 0.03]
    )
    p.resetBaseVelocity(body, [-30, 90, 99], [120, -130, 40])
    for _ in range(4):
        p.applyExternalTorque(body, -1, [20, 10, 5], p.WORLD_FRAME)
        p.stepSimulation()
    position, turn = p.getBasePositionAndOrientation(body)
    linear, angular = p.getBaseVelocity(body)
    assert position == pytest.approx((-0.412231, 1.429319, 2.564552), abs=2e-6)
    assert turn == pytest.approx((-0.123534, 0.645075, -0.567877, -0.496118), abs=2e-6)
    assert linear == pytest.approx((-27.41735, 82.25205, 90.477255), abs=5e-6)
    assert angular == pytest.approx((62.805295, -91.884925, 0.437779), abs=5e-6)


def test_a_state_is_restored_where_a_body_was_replaced_by_one_like_it(client: int) -> None:
    """As in PyBullet, which counts bodies; others are still an error."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    p.setGravity(0, 0, -9.8)
    body = p.createMultiBody(1, box, -1, [0, 0, 1])

    def marker() -> int:
        return p.createMultiBody(0, -1, p.createVisualShape(p.GEOM_SPHERE, radius=0.1), [1, 0, 0])

    first = marker()
    state = p.saveState()
    p.removeBody(first)
    second = marker()
    for _ in range(20):
        p.stepSimulation()
    p.restoreState(state)
    assert p.getBasePositionAndOrientation(body)[0] == (0, 0, 1)
    assert p.getBaseVelocity(body)[0] == (0, 0, 0)
    p.stepSimulation()
    third = marker()
    with pytest.raises(p.error, match="restore"):
        p.restoreState(state)
    p.removeBody(second)
    p.removeBody(third)
    with pytest.raises(p.error, match="restore"):
        p.restoreState(state)
    p.createMultiBody(1, box, -1, [3, 0, 1])
    with pytest.raises(p.error, match="restore"):
        p.restoreState(state)


def test_meshes_are_looked_for_below_the_folders_above_a_robot(client: int, tmp_path: Path) -> None:
    """As PyBullet does, the nearest folder first; not farther than three folders up."""
    mesh = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    robots = tmp_path / "a" / "b" / "robots"
    for folder in (robots / "arm" / "sensor", robots / "sensor" / "body", tmp_path / "far"):
        folder.mkdir(parents=True)
    (robots / "sensor" / "body" / "m.obj").write_text(mesh)
    (tmp_path / "far" / "m.obj").write_text(mesh)
    for name, is_there in (("../sensor/body/m.obj", True), ("far/m.obj", False)):
        shape = f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'
        file = robots / "arm" / "sensor" / f"{is_there}.urdf"
        file.write_text(f'<robot name="r"><link name="l">{shape}</link></robot>')
        if is_there:
            robot = p.loadURDF(str(file))
            assert p.getCollisionShapeData(robot, -1)[0][2] == p.GEOM_MESH
        else:
            with pytest.raises(p.error):
                p.loadURDF(str(file))


def test_a_body_falls_as_in_pybullet_to_the_last_bits(client: int) -> None:
    """Its damping of 0.04 is a number of single precision; recorded with PyBullet 3.2.7."""
    p.setGravity(0, 0, -10)
    body = p.createMultiBody(
        0.3, p.createCollisionShape(p.GEOM_SPHERE, radius=0.01), basePosition=[0, 0, 0.032]
    )
    for _ in range(11):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(body)[0][2] == pytest.approx(0.020549486807763393, abs=1e-16)
    assert p.getBaseVelocity(body)[0][2] == pytest.approx(-0.4578403743713884, abs=1e-15)
