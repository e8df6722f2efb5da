"""Robots with motors solved row by row; the numbers of the arm are real PyBullet 3.2.7's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.sim.stepping.sequential.solution_order import quicksort

PART = """<link name="l{k}"><inertial><origin xyz="0.05 0 0.1"/><mass value="{mass}"/>
<inertia ixx="{i}" iyy="{i}" izz="{i}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j{k}" type="revolute"><parent link="{parent}"/><child link="l{k}"/><origin xyz="0 0 0.2"/>
<axis xyz="{axis}"/><limit lower="-2" upper="{upper}" effort="100" velocity="10"/></joint>"""
PARTS = (
    ("base", "0 0 1", 3, 0.02, 2),
    ("l0", "0 1 0", 2, 0.02, 2),
    ("l1", "0 0 1", 2, 0.01, 2),
    ("l2", "0 1 0", 1, 0.004, 0.3),
    ("l3", "0 0 1", 0.5, 0.001, 2),
)
BASE = """<robot name="arm"><link name="base"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
SPEEDS = {
    1: [12.53139, 1.430472, -18.144892, -1.525188, 15.847336],
    9: [9.510414, 5.374688, -14.904582, -0.446905, 6.821628],
    39: [0.404858, 0.226718, 0.07586, -0.010942, 0.305975],
    59: [0.049454, 0.027407, 0.009419, -9e-05, 0.039591],
}
"""Velocities of the joints after steps of an arm whose axes are nearly parallel and whose motors saturate."""


@pytest.fixture
def arm(client: int, tmp_path: Path) -> int:
    """An arm of five joints, driven to a posture by weak and strong motors."""
    parts = [
        PART.format(k=k, parent=parent, axis=axis, mass=mass, i=i, upper=upper)
        for k, (parent, axis, mass, i, upper) in enumerate(PARTS)
    ]
    (tmp_path / "arm.urdf").write_text(BASE + "".join(parts) + "</robot>")
    p.setGravity(0, 0, -9.81)
    body = p.loadURDF(str(tmp_path / "arm.urdf"), useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
    for joint, angle in enumerate((0.1, 0.05, -0.2, 0.1, 0.3)):
        p.resetJointState(body, joint, angle)
    return body


def _drive(arm: int) -> None:
    goals, forces = (1.0, 0.4, -1.0, 0.5, 1.0), (80, 80, 8, 8, 4)
    for joint, (goal, force) in enumerate(zip(goals, forces, strict=True)):
        p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, targetPosition=goal, force=force)
    p.stepSimulation()


def test_saturated_motors_move_as_after_fifty_rounds(arm: int) -> None:
    for step in range(60):
        _drive(arm)
        if step in SPEEDS:
            found = [p.getJointState(arm, joint)[1] for joint in range(5)]
            np.testing.assert_allclose(found, SPEEDS[step], atol=2e-5)


def test_a_free_body_beside_a_driven_robot_falls(arm: int) -> None:
    ball = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[5, 0, 9])
    p.changeDynamics(ball, -1, linearDamping=0.0)
    for _ in range(24):
        _drive(arm)
    assert p.getBaseVelocity(ball)[0][2] == pytest.approx(-9.81 * 24 / 240)


def test_a_cube_that_slides_beside_a_driven_robot_stops_as_friction_has_it(arm: int) -> None:
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    cube = p.createMultiBody(2.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [9, 0, 0.1])
    p.changeDynamics(ground, -1, lateralFriction=0.8)
    p.changeDynamics(cube, -1, lateralFriction=0.5, linearDamping=0.0, angularDamping=0.0)
    for _ in range(24):
        _drive(arm)
    start = p.getBasePositionAndOrientation(cube)[0][0]
    p.resetBaseVelocity(cube, [1.5, 0, 0])
    for _ in range(240):
        _drive(arm)
    (x, y, z), _ = p.getBasePositionAndOrientation(cube)
    deceleration, dt = 0.4 * 9.81, 1 / 240
    steps = int(1.5 / (deceleration * dt))  # a symplectic step moves by the velocity at its end
    distance = dt * sum(1.5 - deceleration * dt * (k + 1) for k in range(steps))
    assert x - start == pytest.approx(distance, rel=0.01)
    assert (y, z) == pytest.approx((0, 0.1), abs=5e-4)
    assert sum(point[9] for point in p.getContactPoints(cube, ground)) == pytest.approx(2 * 9.81, rel=1e-3)


def test_a_robot_on_wheels_keeps_its_weight_on_the_ground(client: int, tmp_path: Path) -> None:
    wheel = """<link name="w{k}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0"
    ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
    <joint name="j{k}" type="continuous"><parent link="base"/><child link="w{k}"/><origin xyz="{x} {y} 0"/>
    <axis xyz="0 1 0"/></joint>"""
    places = ((0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2))
    wheels = "".join(wheel.format(k=k, x=x, y=y) for k, (x, y) in enumerate(places))
    (tmp_path / "cart.urdf").write_text(BASE.replace('"1"/>', '"6"/>', 1) + wheels + "</robot>")
    p.setGravity(0, 0, -10)
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    cart = p.loadURDF(str(tmp_path / "cart.urdf"), [0, 0, 0.1])
    for _ in range(240):
        for joint in range(4):
            p.setJointMotorControl2(cart, joint, p.VELOCITY_CONTROL, targetVelocity=5.0, force=5)
        p.stepSimulation()
    assert sum(point[9] for point in p.getContactPoints(cart, ground)) == pytest.approx(100, rel=0.01)
    velocity = p.getBaseVelocity(cart)[0]
    np.testing.assert_allclose(velocity, (0.5, 0, 0), atol=0.005)


def test_equals_swap_places_in_the_quicksort() -> None:
    items = [(0, k, 0) for k in range(4)]
    quicksort(items)
    assert [dof for _, dof, _ in items] == [2, 3, 0, 1]  # by hand: two swaps, then one in each half
    items = [(2, 0, 0), (0, 1, 0), (1, 2, 1), (0, 3, 0)]
    quicksort(items)
    assert [key for key, _, _ in items] == [0, 0, 1, 2]


_LIGHT_ARM = """<robot name="arm"><link name="base"/>
<link name="a">{inertial}</link>
<link name="b">{inertial}</link>
<joint name="one" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<joint name="two" type="continuous"><parent link="a"/><child link="b"/><origin xyz="0 0 0.2"/>
<axis xyz="0 1 0"/></joint></robot>"""
_LIGHT = """<inertial><origin xyz="0 0 0.1"/><mass value="0.2"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.0005"/></inertial>"""


def test_velocities_are_bounded_before_motors_act(client: int, tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(_LIGHT_ARM.format(inertial=_LIGHT))
    p.setTimeStep(0.001)
    p.setPhysicsEngineParameter(numSolverIterations=10)
    arm = p.loadURDF(str(file), useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
    p.setJointMotorControl2(arm, 0, p.VELOCITY_CONTROL, force=0)
    for _ in range(60):
        p.setJointMotorControl2(arm, 0, p.TORQUE_CONTROL, force=60.0)
        p.setJointMotorControl2(arm, 1, p.POSITION_CONTROL, 0.5, force=20.0)
        p.stepSimulation()
    states = p.getJointStates(arm, [0, 1])
    # PyBullet 3.2.7's; 60 Nm turn the arm beyond its 100 rad/s in a step
    (first, first_speed), (second, second_speed) = (state[:2] for state in states)
    assert (first, second) == pytest.approx((3.9776860017520517, 0.1270064030677437), abs=1e-7)
    assert (first_speed, second_speed) == pytest.approx((91.96858838903796, -16.821179703092646), abs=1e-6)
