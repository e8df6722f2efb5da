"""Commands for many joints or links do what the same command does one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import roboyard.pybullet as p
import roboyard.pybullet_data as data


@pytest.fixture
def robot(client: int) -> int:
    """R2D2: hinges, a slider and fixed joints, on a plane, each joint moving."""
    p.setAdditionalSearchPath(data.getDataPath())
    p.setGravity(0, 0, -9.81)
    p.loadURDF("plane.urdf")
    body = p.loadURDF("r2d2.urdf", [0, 0, 0.5])
    rng = np.random.default_rng(5)
    for joint in movable(body):
        p.resetJointState(body, joint, rng.uniform(-0.2, 0.2), rng.uniform(-1, 1))
    p.resetBaseVelocity(body, [0.3, -0.2, 0.1], [0.5, 0.1, -0.4])
    return body


def movable(body: int) -> list[int]:
    kinds = (p.JOINT_REVOLUTE, p.JOINT_PRISMATIC)
    return [j for j in range(p.getNumJoints(body)) if p.getJointInfo(body, j)[2] in kinds]


def test_link_states_are_those_of_single_links(robot: int) -> None:
    everything = list(range(p.getNumJoints(robot)))
    for _ in range(3):
        for velocity in (0, 1):
            for fresh in (0, 1):
                together = p.getLinkStates(robot, everything, velocity, fresh)
                assert together == tuple(p.getLinkState(robot, k, velocity, fresh) for k in everything)
                assert together == p.getLinkStates(robot, tuple(everything), velocity, fresh)
        p.stepSimulation()


def test_link_state_frames_fit_together(robot: int) -> None:
    for link in range(p.getNumJoints(robot)):
        centre, turn, local, local_turn, origin, frame = p.getLinkState(robot, link, 0, 1)
        rotation = Rotation.from_quat(frame)
        np.testing.assert_allclose(centre, origin + rotation.apply(local), atol=1e-6)
        wanted = rotation * Rotation.from_quat(local_turn)
        assert (wanted.inv() * Rotation.from_quat(turn)).magnitude() < 1e-6
        assert all(float(np.float32(v)) == v for v in (*origin, *frame))


def test_link_velocities_are_how_frames_move(robot: int) -> None:
    dt = 1e-5
    p.resetBaseVelocity(robot, [0, 0, 0], [0, 0, 0])
    links = list(range(p.getNumJoints(robot)))
    before = p.getLinkStates(robot, links, 1, 1)
    for joint in movable(robot):
        position, speed, *_ = p.getJointState(robot, joint)
        p.resetJointState(robot, joint, position + dt * speed, speed)
    moved = 0.0
    for old, new in zip(before, p.getLinkStates(robot, links, 0, 1), strict=True):
        np.testing.assert_allclose(np.subtract(new[0], old[0]) / dt, old[6], atol=1e-4)
        turned = (Rotation.from_quat(new[1]) * Rotation.from_quat(old[1]).inv()).as_rotvec()
        np.testing.assert_allclose(turned / dt, old[7], atol=1e-4)
        moved = max(moved, np.linalg.norm(old[6]))
    assert moved > 0.01


def test_link_states_follow_edits_of_the_world(robot: int) -> None:
    links = [3, 1]
    p.getLinkStates(robot, links)
    p.loadURDF("r2d2.urdf", [2, 0, 0.5])
    p.resetBasePositionAndOrientation(robot, [0, 1, 2], [0, 0, 0, 1])
    assert p.getLinkStates(robot, links) == tuple(p.getLinkState(robot, k) for k in links)
    assert p.getLinkStates(robot, [1, 99]) == (p.getLinkState(robot, 1), None)


def test_joint_states_are_those_of_single_joints(robot: int) -> None:
    everything = list(range(p.getNumJoints(robot)))
    wheels = movable(robot)[:4]

    def check() -> None:
        for joints in (everything, wheels, wheels[::-1]):
            assert p.getJointStates(robot, joints) == tuple(p.getJointState(robot, j) for j in joints)

    check()
    p.stepSimulation()
    check()
    assert any(state[3] for state in p.getJointStates(robot, wheels))
    p.setJointMotorControl2(robot, wheels[1], p.VELOCITY_CONTROL, force=0)
    check()
    p.stepSimulation()
    check()
    p.enableJointForceTorqueSensor(robot, wheels[0])
    p.stepSimulation()
    check()
    assert any(p.getJointStates(robot, wheels)[0][2])


@pytest.mark.parametrize("mode", [p.POSITION_CONTROL, p.VELOCITY_CONTROL])
def test_motor_commands_for_many_are_single_ones(client: int, mode: int) -> None:
    def run(one_by_one: bool) -> list[float]:
        p.resetSimulation()
        p.setAdditionalSearchPath(data.getDataPath())
        p.setTimeStep(1 / 240)
        body = p.loadURDF("r2d2.urdf", [0, 0, 1], useFixedBase=True)
        joints = movable(body)
        rng = np.random.default_rng(1)
        seen: list[float] = []
        for step in range(40):
            if step == 20:
                p.setTimeStep(1 / 500)
            if step == 30:  # a limp joint in between, and back
                p.setJointMotorControl2(body, joints[0], p.VELOCITY_CONTROL, force=0)
            forces = [5.0 + step // 8] * len(joints)
            targets, speeds = rng.uniform(-0.5, 0.5, (2, len(joints))).tolist()
            if one_by_one:
                for joint, target, speed, force in zip(joints, targets, speeds, forces, strict=True):
                    p.setJointMotorControl2(
                        body, joint, mode, targetPosition=target, targetVelocity=speed, force=force
                    )
            else:
                p.setJointMotorControlArray(
                    body, joints, mode, targetPositions=targets, targetVelocities=speeds, forces=forces
                )
            if step == 12:  # the later command holds, whichever form it has
                p.setJointMotorControl2(body, joints[1], mode, targetPosition=0.1, force=3)
            p.stepSimulation()
            seen += [v for state in p.getJointStates(body, joints) for v in (state[0], state[1], state[3])]
        return seen

    assert run(one_by_one=True) == run(one_by_one=False)


def test_joints_of_many_freedoms_are_read_as_single_ones(robot: int) -> None:
    joints, everything = movable(robot), list(range(p.getNumJoints(robot)))
    for _ in range(3):
        for given in (joints, everything, tuple(joints)):
            for _ in range(2):  # the second time from a group that is kept
                together = p.getJointStatesMultiDof(robot, given)
                assert together == tuple(p.getJointStateMultiDof(robot, j) for j in given)
        singles = [p.getJointState(robot, j) for j in joints]
        many = p.getJointStatesMultiDof(robot, joints)
        assert [(q[0], v[0], r, t[0]) for q, v, r, t in many] == singles
        p.stepSimulation()


@pytest.mark.parametrize("wrap", [lambda q: [q], lambda q: (q,), lambda q: np.array([q])])
def test_joints_are_reset_together_as_one_by_one(robot: int, wrap: Callable[[float], Any]) -> None:
    joints = movable(robot)
    wanted = np.linspace(-0.3, 0.2, len(joints)).tolist()
    p.resetJointStatesMultiDof(robot, joints, [wrap(q) for q in wanted])
    found = [p.getJointState(robot, j)[:2] for j in joints]
    for joint, q in zip(joints, wanted, strict=True):
        p.resetJointState(robot, joint, 9.0, 9.0)
        p.resetJointStateMultiDof(robot, joint, wrap(q))
    assert [p.getJointState(robot, j)[:2] for j in joints] == found == [(q, 0.0) for q in wanted]


def test_motors_of_many_freedoms_are_those_of_one(robot: int) -> None:
    joints = movable(robot)
    goals = np.linspace(-0.2, 0.1, len(joints)).tolist()
    state, ends = p.saveState(), []

    def plain() -> None:
        p.setJointMotorControlArray(robot, joints, p.POSITION_CONTROL, goals, forces=[5.0] * len(joints))

    def together() -> None:
        p.setJointMotorControlMultiDofArray(
            robot, joints, p.POSITION_CONTROL, [[q] for q in goals], forces=[[5.0]] * len(joints)
        )

    def single() -> None:
        for joint, q in zip(joints, goals, strict=True):
            p.setJointMotorControlMultiDof(robot, joint, p.POSITION_CONTROL, [q], force=[5.0])

    for set_motors in (plain, together, single):
        p.restoreState(state)
        for _ in range(10):
            set_motors()
            p.stepSimulation()
        ends.append(p.getJointStates(robot, joints))
    assert ends[0] == ends[1] == ends[2]


def test_boxes_that_overlap_are_those_of_single_links(robot: int) -> None:
    for low, high in (([-1, -1, 0.2], [1, 1, 0.4]), ([0.1, 0, 0], [0.2, 1, 3]), ([4, 4, 0.5], [5, 5, 1])):
        expected = set()
        for body in range(p.getNumBodies()):
            for link in range(-1, p.getNumJoints(body)):
                if p.getCollisionShapeData(body, link) or body == 0:
                    lower, upper = np.array(p.getAABB(body, link))
                    if (lower <= np.add(high, 0.02)).all() and (upper >= np.subtract(low, 0.02)).all():
                        expected.add((body, link))
        assert set(p.getOverlappingObjects(low, high) or ()) == expected


def test_a_box_grows_with_the_margin_of_a_hull(robot: int) -> None:
    hull = p.createCollisionShape(p.GEOM_MESH, vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    body = p.createMultiBody(1, hull)
    before = np.array(p.getAABB(body))
    p.changeDynamics(body, -1, collisionMargin=0.05)
    grown = p.getDynamicsInfo(body, -1)[11] - 0.001
    np.testing.assert_allclose(np.subtract(p.getAABB(body), before), [[-grown] * 3, [grown] * 3], atol=1e-9)


@pytest.mark.parametrize("reads", [1, 40])
def test_boxes_of_links_are_where_they_were_before_the_last_step(client: int, reads: int) -> None:
    """As in PyBullet 3.2.7, where the base's box has moved and a link's has not, until its state is asked."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    body = p.createMultiBody(
        1.0,
        box,
        basePosition=[0, 0, 5],
        linkMasses=[1.0],
        linkCollisionShapeIndices=[box],
        linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0.5]],
        linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE],
        linkJointAxis=[[0, 0, 1]],
    )
    p.setGravity(0, 0, -9.81)
    dt = 1 / 240
    fallen = 0.0
    for step in range(1, 6):
        p.stepSimulation()
        before, fallen = fallen, fallen + 9.81 * dt * dt * step
        for _ in range(reads):
            assert p.getAABB(body, -1)[0][2] == pytest.approx(4.9 - fallen, abs=1e-4)
            assert p.getAABB(body, 0)[0][2] == pytest.approx(5.4 - before, abs=1e-5)
    p.getLinkState(body, 0, computeForwardKinematics=1)
    assert p.getAABB(body, 0)[0][2] == pytest.approx(5.4 - fallen, abs=1e-4)
    p.stepSimulation()
    p.resetBasePositionAndOrientation(body, [0, 0, 1], [0, 0, 0, 1])
    assert p.getAABB(body, 0)[0][2] == pytest.approx(1.4, abs=1e-9)
