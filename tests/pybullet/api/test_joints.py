"""Joint info, joint states and resetting them, compared with PyBullet 3.2.7 and with closed forms."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sqrt
from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p

ARM = """<robot name="arm">
  <link name="base"><inertial><origin xyz="0.1 0 0" rpy="0 0 0.5"/><mass value="3"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
  <link name="upper"><inertial><origin xyz="0 0 0.2" rpy="0.3 0 0"/><mass value="2"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><origin xyz="0 0 0.2"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>
  <link name="lower"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision></link>
  <link name="tool"/>
  <link name="wheel"><inertial><mass value="0.5"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="socket"><inertial><mass value="0.5"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0.2 0.1" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="2" effort="30" velocity="4"/><dynamics damping="0.2" friction="0.1"/></joint>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="lower"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="0" upper="0.3" effort="50" velocity="1"/></joint>
  <joint name="flange" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0 0 0.1"/></joint>
  <joint name="spin" type="continuous"><parent link="base"/><child link="wheel"/>
    <origin xyz="-0.2 0 0" rpy="1.57 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="socket_joint" type="spherical"><parent link="base"/><child link="socket"/>
    <origin xyz="0 0 -0.2"/></joint>
</robot>"""


def load(p: Any, folder: Path, **options: Any) -> int:
    file = folder / "arm.urdf"
    file.write_text(ARM)
    return p.loadURDF(str(file), **options)


def message_of(call: Callable[[], Any]) -> list[str]:
    """Type and text of the error that a call raises."""
    try:
        return ["no error", repr(call())]
    except Exception as problem:
        return [type(problem).__name__, str(problem)]


def record_joint_info(p: Any, folder: Path) -> Any:
    body = load(p, folder, useFixedBase=True)
    return [p.getNumJoints(body), [p.getJointInfo(body, joint) for joint in range(5)]]


def record_joint_info_in_link_order(p: Any, folder: Path) -> Any:
    body = load(p, folder, flags=p.URDF_MAINTAIN_LINK_ORDER)
    return [p.getJointInfo(body, joint) for joint in range(p.getNumJoints(body))]


def record_joint_info_without_fixed_joints(p: Any, folder: Path) -> Any:
    body = load(p, folder, flags=p.URDF_MERGE_FIXED_LINKS)
    return [p.getJointInfo(body, joint) for joint in range(p.getNumJoints(body))]


def record_joint_info_at_twice_the_size(p: Any, folder: Path) -> Any:
    body = load(p, folder, globalScaling=2.0)
    return [p.getJointInfo(body, joint) for joint in range(p.getNumJoints(body))]


def record_first_states(p: Any, folder: Path) -> Any:
    body = load(p, folder, useFixedBase=True)
    return [p.getJointStates(body, [0, 1, 2, 3]), p.getJointStatesMultiDof(body, [0, 1, 2, 3, 4])]


def record_reset_states(p: Any, folder: Path) -> Any:
    body = load(p, folder, useFixedBase=True)
    p.resetJointState(body, 0, 0.7, 0.2)
    p.resetJointState(body, 1, 5.0)
    p.resetJointState(body, 3, -9.0, targetVelocity=-1)
    p.resetJointStateMultiDof(body, 4, [0, 0, 3, 4], [1, 2, 3])
    return p.getJointStatesMultiDof(body, range(5))


def record_reset_of_many(p: Any, folder: Path) -> Any:
    body = load(p, folder, useFixedBase=True)
    p.resetJointStatesMultiDof(body, [0, 4], [[0.3], [0, 0.6, 0, 0.8]], [[0.5], [0, 0, 1]])
    first = p.getJointStatesMultiDof(body, [0, 4])
    p.resetJointStatesMultiDof(body, [0, 4], [[0.1], [0, 0, 0, 1]])
    return [first, p.getJointStatesMultiDof(body, [0, 4])]


def record_states_after_a_step(p: Any, folder: Path) -> Any:
    body = load(p, folder, useFixedBase=True)
    p.setGravity(0, 0, -10)
    for joint in (0, 1, 3):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, targetVelocity=0.3, force=500)
    p.stepSimulation()
    return [state[:2] for state in p.getJointStates(body, [0, 1, 3])]


def record_wrong_joints(p: Any, folder: Path) -> Any:
    body = load(p, folder)
    return [
        message_of(lambda: p.getJointInfo(body, 5)),
        message_of(lambda: p.getJointInfo(body, -1)),
        message_of(lambda: p.getJointInfo(7, 0)),
        message_of(lambda: p.getJointState(body, 5)),
        message_of(lambda: p.getJointState(body, -1)),
        message_of(lambda: p.getJointState(7, 0)),
        message_of(lambda: p.getJointStates(body, [0, 9])),
        message_of(lambda: p.getJointStateMultiDof(body, 9)),
        message_of(lambda: p.resetJointState(body, 9, 0.0)),
        message_of(lambda: p.resetJointState(body, -1, 0.0)),
        message_of(lambda: p.enableJointForceTorqueSensor(body, 9)),
        p.getNumJoints(7),
    ]


@pytest.mark.parametrize(
    "scenario",
    [
        record_joint_info,
        record_joint_info_in_link_order,
        record_joint_info_without_fixed_joints,
        record_joint_info_at_twice_the_size,
        record_first_states,
        record_reset_states,
        record_reset_of_many,
        record_wrong_joints,
    ],
)
def test_tables_and_states_are_pybullets(agrees: Any, scenario: Any) -> None:
    agrees(scenario, 2e-7)


def test_velocities_of_motors_after_a_step_are_pybullets(agrees: Any) -> None:
    agrees(record_states_after_a_step, 2e-4)


@pytest.fixture
def arm(client: int, tmp_path: Path) -> int:
    return load(p, tmp_path, useFixedBase=True)


@pytest.mark.parametrize(
    ("kind", "count"),  # recorded with PyBullet 3.2.7
    [("spherical", -1), ("planar", -2), ("floating", 1), ("continuous", 2), ("fixed", 1), ("prismatic", 2)],
)
@pytest.mark.parametrize("is_fixed", [False, True])
def test_degrees_of_freedom_are_those_of_hinges_and_slides(
    client: int, tmp_path: Path, kind: str, count: int, is_fixed: bool
) -> None:
    mass = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    links = "".join(f'<link name="{name}">{mass}</link>' for name in "abc")
    joints = "".join(
        f'<joint name="{one}{two}" type="{t}"><parent link="{one}"/><child link="{two}"/>{limit}</joint>'
        for one, two, t in (("a", "b", "continuous"), ("b", "c", kind))
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{links}{joints}</robot>')
    assert p.computeDofCount(p.loadURDF(str(tmp_path / "r.urdf"), useFixedBase=is_fixed)) == count
    assert p.computeDofCount(7) == 0


def test_an_empty_list_of_joints_gives_none(arm: int) -> None:
    assert p.getJointStates(arm, []) is None
    assert p.getJointStatesMultiDof(arm, []) is None


def test_a_quaternion_is_normalised(arm: int) -> None:
    p.resetJointStateMultiDof(arm, 4, [0, 0, 2, 2])
    assert p.getJointStateMultiDof(arm, 4)[0] == pytest.approx((0, 0, sqrt(0.5), sqrt(0.5)))


def test_positions_of_another_length_are_ignored(arm: int) -> None:
    p.resetJointStateMultiDof(arm, 4, [0, 0, 1, 0])
    p.resetJointStateMultiDof(arm, 4, [1.0], [1, 2])
    assert p.getJointStateMultiDof(arm, 4)[:2] == ((0, 0, 1, 0), (0, 0, 0))


@pytest.mark.parametrize(
    ("values", "velocities", "given"), [([[1]], None, 1), ([[1], [2], [3]], None, 3), ([[1], [2]], [[1]], 1)]
)
def test_lists_of_values_have_the_length_of_the_joints(
    arm: int, values: Any, velocities: Any, given: int
) -> None:
    with pytest.raises(p.error, match="needs to match number of indices") as caught:
        p.resetJointStatesMultiDof(arm, [0, 1], values, velocities)
    assert caught.value.__notes__ == [f"expected 2, got {given}"]


def test_an_empty_position_and_velocity_is_an_error(arm: int) -> None:
    with pytest.raises(p.error, match="Expected an position and/or velocity list"):
        p.resetJointStateMultiDof(arm, 0, [])


def test_a_fixed_joint_has_no_position(arm: int) -> None:
    assert p.getJointState(arm, 2) == (0.0, 0.0, (0.0,) * 6, 0.0)
    assert p.getJointStateMultiDof(arm, 2) == ((), (), (0.0,) * 6, ())
    p.resetJointState(arm, 2, 1.0)
    assert p.getJointState(arm, 2)[0] == 0.0


def test_a_sensor_of_a_hanging_link_carries_its_weight(client: int, tmp_path: Path) -> None:
    body = load(p, tmp_path, useFixedBase=True)
    p.setGravity(0, 0, -10)
    p.enableJointForceTorqueSensor(body, 4)
    p.stepSimulation()
    force = p.getJointStateMultiDof(body, 4)[2][:3]
    assert force == pytest.approx((0, 0, 5.0), abs=0.05), "0.5 kg hang below the base"
    p.enableJointForceTorqueSensor(body, 4, 0)
    assert p.getJointStateMultiDof(body, 4)[2] == (0.0,) * 6


def test_reactions_are_about_the_centre_of_mass(client: int) -> None:
    """The wrench that holds a beam at one end has no moment about its centre of mass."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5, 0.05, 0.05])
    beam = p.createMultiBody(
        0, -1, linkMasses=[2.0], linkCollisionShapeIndices=[box], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0.5, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0], linkJointTypes=[p.JOINT_FIXED],
        linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    p.setGravity(0, 0, -10)
    p.enableJointForceTorqueSensor(beam, 0)
    p.stepSimulation()
    reaction = p.getJointState(beam, 0)[2]
    assert reaction[:3] == pytest.approx((0, 0, 20), abs=1e-3)
    assert reaction[3:] == pytest.approx((0, 0, 0), abs=1e-3)


def test_motors_report_the_torque_that_holds_a_pendulum(client: int) -> None:
    """Held at an angle a from hanging, a rod of length 2 l needs the torque m g l sin a."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.02, 0.02, 0.5])
    rod = p.createMultiBody(
        0, -1, linkMasses=[1.5], linkCollisionShapeIndices=[box], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, -0.5]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]],
    )  # fmt: skip
    p.setGravity(0, 0, -9.81)
    p.resetJointState(rod, 0, pi / 6)
    p.setJointMotorControl2(rod, 0, p.VELOCITY_CONTROL, force=100)
    for _ in range(10):
        p.stepSimulation()
    assert p.getJointState(rod, 0)[3] == pytest.approx(1.5 * 9.81 * 0.5 * 0.5, rel=1e-3)


def record_efforts_of_divided_steps(p: Any, folder: Path) -> Any:
    """With substeps, PyBullet reports the last one's impulses over the time of the whole step."""
    p.setGravity(0, 0, -10)
    p.setPhysicsEngineParameter(fixedTimeStep=1 / 60, numSubSteps=4)
    floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 1]), -1, [0, 0, -1])
    p.changeDynamics(floor, -1, lateralFriction=1.0)
    ball = p.createMultiBody(2.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, [1, 0, 0.1])
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 0.02, 0.02])
    arm = p.createMultiBody(
        0, -1, -1, [0, 0, 1], linkMasses=[1.0], linkCollisionShapeIndices=[shape],
        linkVisualShapeIndices=[-1], linkPositions=[[0.2, 0, 0]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0.1, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]],
    )  # fmt: skip
    p.enableJointForceTorqueSensor(arm, 0, 1)
    p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, 0.3, force=50)
    for _ in range(120):
        p.stepSimulation()
    state = p.getJointState(arm, 0)
    pushing = sum(point[9] for point in p.getContactPoints(ball))
    return [state[0], state[2][0], state[2][2], state[3], pushing]


def test_efforts_of_divided_steps(agrees: Callable[..., None]) -> None:
    agrees(record_efforts_of_divided_steps, 2e-3)
