"""Numbers that are not finite are refused where they are given, and leave the world as it was."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import roboyard.pybullet as p

NAN, INF = float("nan"), float("inf")
ARM = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="9" velocity="2"/></joint></robot>"""
Refused = Callable[[int, int, Path, float], object]
BOTH: dict[str, Refused] = {
    "mass of a body": lambda arm, ball, file, x: p.createMultiBody(x),
    "place of a body": lambda arm, ball, file, x: p.createMultiBody(1, basePosition=[x, 0, 0]),
    "turn of a body": lambda arm, ball, file, x: p.createMultiBody(1, baseOrientation=[0, 0, x, 1]),
    "place of a robot": lambda arm, ball, file, x: p.loadURDF(str(file), [0, x, 0]),
    "turn of a robot": lambda arm, ball, file, x: p.loadURDF(str(file), [0, 0, 0], [x, 0, 0, 1]),
    "scale": lambda arm, ball, file, x: p.loadURDF(str(file), globalScaling=abs(x)),
    "pivot": lambda arm, ball, file, x: p.createConstraint(
        ball, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, x], [0, 0, 1]
    ),
    "frame": lambda arm, ball, file, x: p.createConstraint(
        ball, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, x, 1]
    ),
    "joint": lambda arm, ball, file, x: p.resetJointState(arm, 0, x),
    "joint velocity": lambda arm, ball, file, x: p.resetJointState(arm, 0, 0, x),
    "joints": lambda arm, ball, file, x: p.resetJointStateMultiDof(arm, 0, [x]),
    "spring": lambda arm, ball, file, x: p.setJointMotorControl2(
        arm, 0, p.PD_CONTROL, targetPosition=x, positionGain=1, velocityGain=1
    ),
    "mass": lambda arm, ball, file, x: p.changeDynamics(ball, -1, mass=x),
    "inertia": lambda arm, ball, file, x: p.changeDynamics(ball, -1, localInertiaDiagonal=[1, 1, x]),
    "friction": lambda arm, ball, file, x: p.changeDynamics(ball, -1, lateralFriction=x),
    "drag": lambda arm, ball, file, x: p.changeDynamics(ball, -1, linearDamping=x),
}
NOT_A_NUMBER: dict[str, Refused] = {
    "force": lambda arm, ball, file, x: p.setJointMotorControl2(
        arm, 0, p.POSITION_CONTROL, targetPosition=0.1, force=x
    ),
    "forces": lambda arm, ball, file, x: p.setJointMotorControlArray(
        arm, [0], p.VELOCITY_CONTROL, targetVelocities=[0.1], forces=[x]
    ),
    "forces of many": lambda arm, ball, file, x: p.setJointMotorControlMultiDof(
        arm, 0, p.POSITION_CONTROL, targetPosition=[0.1], force=[x]
    ),
}
CASES = [(name, value) for name in BOTH for value in (NAN, INF)] + [(name, NAN) for name in NOT_A_NUMBER]


@pytest.fixture
def bodies(tmp_path: Path) -> Iterator[tuple[int, int, Path]]:
    number = p.connect(p.DIRECT)
    file = tmp_path / "arm.urdf"
    file.write_text(ARM)
    arm = p.loadURDF(str(file), useFixedBase=1)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=[1, 0, 1])
    yield arm, ball, file
    p.disconnect(number)


@pytest.mark.parametrize(("name", "value"), CASES)
def test_what_is_not_finite_is_refused_and_the_world_goes_on(
    bodies: tuple[int, int, Path], name: str, value: float
) -> None:
    arm, ball, file = bodies
    count = p.getNumBodies()
    with pytest.raises(p.error):
        {**BOTH, **NOT_A_NUMBER}[name](arm, ball, file, value)
    for _ in range(3):
        p.stepSimulation()
    assert p.getNumBodies() == count
    assert p.getNumConstraints() == 0
    p.changeDynamics(ball, -1, mass=2.0, linearDamping=0.1)
    assert all(map(math.isfinite, p.getBasePositionAndOrientation(ball)[0]))
    assert math.isfinite(p.getJointState(arm, 0)[0])
