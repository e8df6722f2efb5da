"""Bodies that met are solved as a group, whose rounds end for itself; numbers of PyBullet 3.2.7."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard import pybullet as p

START = (-0.145041703, 0.093981073, 0.02)
RESTING = {
    0: (-8.3629e-05, -4.5753e-05, -0.004994652, 0.003007093, -0.004089268, -7.217e-05),
    2: (-1.1435e-05, 2.3306e-05, -2.9763e-05, -0.000613953, -0.000541449, -0.000100545),
    5: (-1.7028e-05, 1.0903e-05, -1.631e-05, 2.702e-06, -0.00081866, -9.6921e-05),
}
"""Velocities after some steps of a cube that is set on a table."""

SLIDING = {
    1: (0.29308147, 0.19424457, -0.0034279339, 0.00060385617, -0.17113238, 2.4256483),
    3: (0.28378587, 0.18844765, 0.00089472744, -0.46233796, 0.49482504, 2.4019663),
    9: (0.25981525, 0.17150215, 0.00053173817, 0.049820889, -0.017989615, 2.2612693),
    39: (0.13897373, 0.08969421, 6.3579181e-05, 0.0022765965, -0.00069749235, 0.9566151),
}
"""Velocities after some steps of a cube that slides on a table and spins."""


def _box(half: list[float], mass: float, position: tuple[float, ...]) -> int:
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half)
    return p.createMultiBody(mass, shape, basePosition=position)


def _cube_on_table(position: tuple[float, ...] = START) -> int:
    p.setTimeStep(1 / 500)
    p.setGravity(0, 0, -9.81)
    _box([0.55, 0.35, 0.2], 0, (-0.3, 0, -0.2))
    return _box([0.02] * 3, 1, position)


def _velocity(body: int) -> np.ndarray:
    return np.ravel(p.getBaseVelocity(body)).astype(float)


@pytest.mark.parametrize("links", [0, 5])
def test_an_arm_at_work_leaves_a_cube_its_own_rounds(client: int, links: int) -> None:
    """The cube is done after a few rounds; if it had the arm's, it would turn by less than 1e-6 rad/s."""
    cube = _cube_on_table()
    if links:
        arm = p.createMultiBody(
            0, -1, -1, [0, 0, 1], linkMasses=[1] * links, linkCollisionShapeIndices=[-1] * links,
            linkVisualShapeIndices=[-1] * links, linkPositions=[[0, 0, 0.2]] * links,
            linkOrientations=[[0, 0, 0, 1]] * links, linkInertialFramePositions=[[0, 0, 0.1]] * links,
            linkInertialFrameOrientations=[[0, 0, 0, 1]] * links, linkParentIndices=list(range(links)),
            linkJointTypes=[p.JOINT_REVOLUTE] * links, linkJointAxis=[[0, 1, 0]] * links,
        )  # fmt: skip
        for joint in range(links):
            p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, targetPosition=0.3, force=1000)
    for step in range(6):
        p.stepSimulation()
        if step in RESTING:
            np.testing.assert_allclose(_velocity(cube), RESTING[step], atol=1e-8)


@pytest.mark.parametrize(("gap", "turning"), [(0.038, -0.001437472), (0.042, -8.1629e-05)])
def test_cubes_are_a_group_while_their_boxes_meet(client: int, gap: float, turning: float) -> None:
    """Boxes are 2 cm wider than shapes on each side: the second cube adds rounds to the first."""
    cube = _cube_on_table()
    other = _box([0.02] * 3, 1, (START[0] + 0.04 + gap, START[1], 0.0205))
    p.resetBaseVelocity(other, [0, 0, 0], [0, 20, 0])
    for _ in range(2):
        p.stepSimulation()
    assert _velocity(cube)[3] == pytest.approx(turning, abs=1e-7)


def test_a_sliding_cube_that_spins_follows_pybullet(client: int) -> None:
    """Its corners leave their points behind in each step, and new points replace those of the same step."""
    p.setTimeStep(1 / 500)
    p.setGravity(0, 0, -9.81)
    _box([0.55, 0.35, 0.2], 0, (0, 0, -0.2))
    cube = _box([0.02] * 3, 1, (0.03, 0.04, 0.02))
    p.resetBaseVelocity(cube, [0.3, 0.2, 0], [1, 2, 3])
    for step in range(40):
        p.stepSimulation()
        if step in SLIDING:
            np.testing.assert_allclose(_velocity(cube), SLIDING[step], atol=1e-6)


def _limbs(parents: list[int], positions: list[list[float]], **given: list) -> int:
    """Return a fixed base with links of small spheres, each with its own joint."""
    ball, n = p.createCollisionShape(p.GEOM_SPHERE, radius=0.01), len(parents)
    return p.createMultiBody(
        0, -1, -1, [0, 0, 1], linkCollisionShapeIndices=[ball] * n, linkVisualShapeIndices=[-1] * n,
        linkPositions=positions, linkOrientations=[[0, 0, 0, 1]] * n,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * n, linkParentIndices=parents, **given,
    )  # fmt: skip


def test_the_limbs_of_a_robot_on_a_fixed_base_are_one_group(client: int) -> None:
    """The second limb is solved as long as the first one; alone it would be done at 5e-4 rad/s."""
    p.setGravity(0, 0, -9.81)
    p.setTimeStep(0.1)
    robot = _limbs(
        [0, 1, 2, 0, 4, 5],
        [[0.03, 0.08, 0.06], [-0.05, -0.04, 0.07], [-0.1, 0.06, 0.06], [-0.01, -0.04, -0.04],
         [-0.05, -0.01, 0], [0.01, 0.1, 0.06]],
        linkInertialFramePositions=[[0.01, 0.05, -0.03], [-0.03, 0.01, -0.05], [-0.05, 0, 0],
                                    [0.04, 0.01, 0], [0, -0.03, -0.05], [-0.03, 0.02, -0.03]],
        linkMasses=[0.05, 0.05, 0.1, 0.1, 0.1, 0.1], linkJointTypes=[p.JOINT_REVOLUTE] * 6,
        linkJointAxis=[[1, 0, 0], [0, 0, 1], [0, 0, 1]] * 2,
    )  # fmt: skip
    p.stepSimulation()
    speeds = [p.getJointState(robot, joint)[1] for joint in range(6)]
    assert speeds == pytest.approx([-0.0270116123, -0.0230339183, 0, 0, 0, 0], abs=1e-7)


@pytest.mark.parametrize(
    ("shift", "wanted"), [(0.0, (0.0833297672, 0.083320598)), (0.01, (0.0464644953, 0.138617585))]
)
def test_a_gear_between_fingers_of_an_arm_needs_as_many_rounds_as_in_pybullet(
    client: int, shift: float, wanted: tuple[float, float]
) -> None:
    """Bullet does not allow for what the joints of a gear do to each other through the arm."""
    p.setGravity(0, 0, -9.81)
    p.setPhysicsEngineParameter(numSolverIterations=4)
    n = 3
    arm = p.createMultiBody(
        0, -1, -1, [0, 0, 1], linkMasses=[1, 0.3, 0.2], linkCollisionShapeIndices=[-1] * n,
        linkVisualShapeIndices=[-1] * n, linkPositions=[[0, 0, 0.1], [0.1, 0.05, 0.2], [-0.1, 0.05, 0.2]],
        linkOrientations=[[0, 0, 0, 1]] * n, linkInertialFramePositions=[[0.05, 0.02, -0.1]] * n,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * n, linkParentIndices=[0, 1, 1],
        linkJointTypes=[p.JOINT_REVOLUTE, p.JOINT_PRISMATIC, p.JOINT_PRISMATIC],
        linkJointAxis=[[0, 1, 0], [1, 0, 0], [1, 0, 0]],
    )  # fmt: skip
    gear = p.createConstraint(arm, 1, arm, 2, p.JOINT_GEAR, [1, 0, 0], [0, 0, 0], [0, 0, 0])
    p.changeConstraint(gear, gearRatio=-1, maxForce=50, erp=0.2)
    p.resetJointState(arm, 1, shift)
    p.setJointMotorControl2(arm, 1, p.VELOCITY_CONTROL, targetVelocity=0.2, force=5)
    p.setJointMotorControl2(arm, 2, p.VELOCITY_CONTROL, targetVelocity=0, force=0)
    for _ in range(2):
        p.stepSimulation()
    assert [p.getJointState(arm, joint)[1] for joint in (1, 2)] == pytest.approx(wanted, abs=1e-9)
