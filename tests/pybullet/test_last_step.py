"""Results of the last step after the world has changed; the counts were recorded with PyBullet 3.2.7."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import roboyard.pybullet as p

ARM = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 0.2"/><mass value="2"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<origin xyz="0 0 1"/><limit lower="-2" upper="2" effort="100" velocity="10"/></joint></robot>"""


def cube(x: float, z: float = 0.1) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)
    return p.createMultiBody(1.0, shape, basePosition=[x, 0, z])


@pytest.fixture
def world(client: int, tmp_path: Path) -> tuple[int, int, list[int]]:
    """An arm that holds itself, the ground, and four cubes (1 kg) that rest on it."""
    p.setGravity(0, 0, -10)
    (tmp_path / "arm.urdf").write_text(ARM)
    arm = p.loadURDF(str(tmp_path / "arm.urdf"), [0, 2, 0], useFixedBase=True)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[8, 8, 0.5])
    ground = p.createMultiBody(0, shape, basePosition=[0, 0, -0.5])
    cubes = [cube(0.5 * k) for k in range(4)]
    p.resetJointState(arm, 0, 0.5)
    p.enableJointForceTorqueSensor(arm, 0)
    p.setJointMotorControl2(arm, 0, p.POSITION_CONTROL, targetPosition=0.5)
    for _ in range(60):
        p.stepSimulation()
    return arm, ground, cubes


def counts(ground: int, cubes: list[int]) -> list[int]:
    return [len(p.getContactPoints(one, ground)) for one in cubes]


EDITS: list[Callable[[int, list[int]], object]] = [
    lambda _arm, _cubes: cube(9.0),
    lambda _arm, _cubes: p.createConstraint(2, -1, -1, -1, p.JOINT_FIXED, [0] * 3, [0] * 3, [0, 0, 0.1]),
    lambda _arm, _cubes: p.removeBody(cube(9.0)),
    lambda arm, _cubes: p.changeDynamics(arm, 0, jointDamping=0.3),
    lambda _arm, cubes: p.changeDynamics(cubes[0], -1, mass=3.0),
    lambda _arm, cubes: p.resetBasePositionAndOrientation(cubes[0], [5, 5, 5], [0, 0, 0, 1]),
    lambda _arm, _cubes: p.createMultiBody(
        1.0, linkMasses=[1.0], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 1]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]], basePosition=[20, 0, 5],
    ),
]  # fmt: skip


@pytest.mark.parametrize("edit", EDITS)
def test_contacts_and_efforts_outlive_edits(
    world: tuple[int, int, list[int]], edit: Callable[[int, list[int]], object]
) -> None:
    arm, ground, cubes = world
    effort, reaction = p.getJointState(arm, 0)[3], p.getJointState(arm, 0)[2]
    forces = [point[9] for point in p.getContactPoints(cubes[1], ground)]
    assert sum(forces) == pytest.approx(10.0, rel=1e-3)  # the cube's weight
    edit(arm, cubes)
    assert p.getJointState(arm, 0)[3] == effort != 0.0
    assert p.getJointStates(arm, [0])[0][3] == effort
    assert p.getJointState(arm, 0)[2] == reaction != (0.0,) * 6
    assert counts(ground, cubes) == [4, 4, 4, 4]
    assert [point[9] for point in p.getContactPoints(cubes[1], ground)] == forces
    p.stepSimulation()
    assert sum(point[9] for point in p.getContactPoints(cubes[1], ground)) == pytest.approx(10.0, rel=1e-3)
    assert counts(ground, cubes)[1:] == [4, 4, 4]


def test_removed_bodies_and_filtered_links_lose_their_contacts(world: tuple[int, int, list[int]]) -> None:
    _, ground, cubes = world
    p.setCollisionFilterPair(cubes[0], cubes[1], -1, -1, 0)
    assert counts(ground, cubes) == [0, 0, 4, 4]
    p.stepSimulation()
    p.setCollisionFilterGroupMask(cubes[2], -1, 1, 1)
    assert counts(ground, cubes) == [4, 4, 0, 4]
    p.stepSimulation()
    p.setCollisionFilterPair(cubes[3], ground, -1, -1, 1)
    assert counts(ground, cubes) == [0, 0, 0, 0]
    p.stepSimulation()
    p.removeBody(cubes.pop())
    assert counts(ground, cubes) == [4, 4, 4]
    assert len(p.getContactPoints()) == 12


def test_saved_states_have_contacts(world: tuple[int, int, list[int]]) -> None:
    _, ground, cubes = world
    resting = p.saveState()
    forces = [point[9] for point in p.getContactPoints(cubes[0], ground)]
    p.resetBasePositionAndOrientation(cubes[0], [0, 0, 1], [0, 0, 0, 1])
    p.stepSimulation()
    assert counts(ground, cubes) == [0, 4, 4, 4]
    lifted = p.saveState()
    p.restoreState(resting)
    assert [point[9] for point in p.getContactPoints(cubes[0], ground)] == forces
    p.restoreState(lifted)
    assert counts(ground, cubes) == [0, 4, 4, 4]
    p.stepSimulation()
    assert counts(ground, cubes) == [0, 4, 4, 4]


def test_states_without_contacts_leave_those_that_are_there(client: int) -> None:
    p.setGravity(0, 0, -10)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[8, 8, 0.5])
    ground, one = p.createMultiBody(0, shape, basePosition=[0, 0, -0.5]), cube(0.0)
    lifted = p.saveState()
    for _ in range(20):
        p.stepSimulation()
    p.resetBasePositionAndOrientation(one, [0, 0, 1], [0, 0, 0, 1])
    p.restoreState(lifted)
    assert counts(ground, [one]) == [4]


def test_collisions_are_detected_anew(world: tuple[int, int, list[int]]) -> None:
    _, ground, cubes = world
    cube(9.0)
    p.resetBasePositionAndOrientation(cubes[0], [5, 5, 5], [0, 0, 0, 1])
    p.performCollisionDetection()
    assert counts(ground, cubes) == [0, 4, 4, 4]
    p.resetSimulation()
    assert p.getContactPoints() == ()
