"""Welds, ball joints, slides and gears between bodies, against statics and kinematics worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.connections import CLIENTS

_WHEEL = """<link name="{0}"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<joint name="joint_{0}" type="continuous"><parent link="world"/><child link="{0}"/>
<axis xyz="0 0 1"/><origin xyz="{1} 0 0"/></joint>"""
THREE_WHEELS = "".join(_WHEEL.format(name, 3 * place) for place, name in enumerate("abc"))


@pytest.fixture
def box(client: int) -> int:
    p.setGravity(0, 0, -10)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    return p.createMultiBody(1.0, shape, basePosition=[1.0, 0.0, 1.0])


@pytest.fixture
def wheels(client: int, tmp_path) -> int:
    (tmp_path / "wheels.urdf").write_text(f'<robot name="wheels"><link name="world"/>{THREE_WHEELS}</robot>')
    body = p.loadURDF(str(tmp_path / "wheels.urdf"), useFixedBase=1)
    for joint in range(3):
        p.setJointMotorControl2(body, joint, p.VELOCITY_CONTROL, force=0)
    return body


def _steps(count: int) -> None:
    for _ in range(count):
        p.stepSimulation()


def _gear(body: int, a: int, b: int, **changes: float) -> int:
    made = p.createConstraint(body, a, body, b, p.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0])
    p.changeConstraint(made, maxForce=1e4, **changes)
    return made


def test_a_weld_to_the_world_carries_the_weight(box: int) -> None:
    weld = p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [1, 0, 1])
    assert weld == 1
    _steps(100)
    position, turn = p.getBasePositionAndOrientation(box)
    assert np.allclose(position, [1, 0, 1], atol=2e-4)
    assert np.allclose(turn, [0, 0, 0, 1], atol=1e-5)
    assert np.allclose(p.getConstraintState(weld), [0, 0, 10, 0, 0, 0], atol=1e-2)


def test_a_weld_weaker_than_the_weight_gives_way(box: int) -> None:
    weld = p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [1, 0, 1])
    p.changeConstraint(weld, maxForce=4)
    p.changeDynamics(box, -1, linearDamping=0, angularDamping=0)
    _steps(48)
    assert p.getBaseVelocity(box)[0][2] == pytest.approx(-(10 - 4) * 0.2, rel=0.02)
    assert p.getConstraintState(weld)[2] == pytest.approx(4, rel=0.01)


def test_the_frame_of_a_weld_can_be_moved(box: int) -> None:
    weld = p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [1, 0, 1])
    quarter = p.getQuaternionFromEuler([0, 0, np.pi / 2])
    p.changeConstraint(weld, [1.2, 0, 1.5], jointChildFrameOrientation=quarter, maxForce=200)
    _steps(240)
    position, turn = p.getBasePositionAndOrientation(box)
    assert np.allclose(position, [1.2, 0, 1.5], atol=2e-3)
    assert abs(np.dot(turn, quarter)) == pytest.approx(1, abs=1e-4)


def test_a_point_lets_turn(box: int) -> None:
    point = p.createConstraint(box, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0.5], [1, 0, 1.5])
    p.changeDynamics(box, -1, linearDamping=0, angularDamping=0)
    p.resetBaseVelocity(box, [0.1, 0, 0], [0, -0.2, 0])
    farthest = 0.0
    for _ in range(240):
        p.stepSimulation()
        position, turn = p.getBasePositionAndOrientation(box)
        hook, _ = p.multiplyTransforms(position, turn, [0, 0, 0.5], [0, 0, 0, 1])
        assert np.allclose(hook, [1, 0, 1.5], atol=2e-3)
        farthest = max(farthest, abs(position[0] - 1))
    inertia = p.getDynamicsInfo(box, -1)[2][1]
    period_over_2_pi = np.sqrt((inertia + 0.25) / (10 * 0.5))
    assert farthest == pytest.approx(0.1 * period_over_2_pi, rel=0.03)
    assert len(p.getConstraintState(point)) == 3


def test_a_slide_moves_along_its_axis_only(box: int) -> None:
    slide = p.createConstraint(
        box, -1, -1, -1, p.JOINT_PRISMATIC, [0, 0, 1], [0, 0, 0], [1, 0, 1], [0, 0, 0, 1], [0, 0, 0, 1]
    )
    p.changeDynamics(box, -1, linearDamping=0, angularDamping=0)
    p.resetBaseVelocity(box, [1, 2, 0], [0, 1, 0])
    _steps(48)
    position, _ = p.getBasePositionAndOrientation(box)
    linear, angular = p.getBaseVelocity(box)
    assert np.allclose(linear, [0, 0, -2], atol=0.05)
    assert np.allclose(angular, 0, atol=0.05)
    assert np.allclose(position[:2], [1, 0], atol=0.01)
    assert len(p.getConstraintState(slide)) == 5


def test_a_slide_is_carried_round_by_the_body_it_slides_on(wheels: int, box: int) -> None:
    p.setGravity(0, 0, 0)
    p.resetBasePositionAndOrientation(box, [0, 0.6, 0], [0, 0, 0, 1])
    p.createConstraint(wheels, 0, box, -1, p.JOINT_PRISMATIC, [0, 1, 0], [0, 0, 0], [0, 0, 0])
    p.setJointMotorControl2(wheels, 0, p.VELOCITY_CONTROL, targetVelocity=1, force=1e4)
    _steps(120)
    angle = p.getJointState(wheels, 0)[0]
    position, turn = p.getBasePositionAndOrientation(box)
    along = np.dot(position[:2], [np.cos(angle), np.sin(angle)])
    assert along == pytest.approx(0.01372, abs=1e-4), "as in PyBullet 3.2.7, which lags behind the turn"
    assert p.getEulerFromQuaternion(turn)[2] == pytest.approx(angle, abs=0.01)
    assert np.linalg.norm(position[:2]) > 0.6, "a body on a circle moves outwards"


def test_a_gear_of_minus_one_turns_both_wheels_alike(wheels: int) -> None:
    _gear(wheels, 0, 1, gearRatio=-1)
    p.setJointMotorControl2(wheels, 0, p.VELOCITY_CONTROL, targetVelocity=2, force=1e4)
    _steps(60)
    assert p.getJointState(wheels, 1)[1] == pytest.approx(2, abs=1e-3)


def test_a_gear_holds_positions_where_erp_is_given(wheels: int) -> None:
    gear = _gear(wheels, 0, 1, gearRatio=2, relativePositionTarget=0.5, erp=0.3)
    _steps(240)
    a, b = (p.getJointState(wheels, joint)[0] for joint in (0, 1))
    assert a + 2 * b == pytest.approx(0.5, abs=1e-3)
    assert p.getConstraintInfo(gear)[10:] == (1e4, 2.0, 0, 0.5, 0.3)


def test_a_third_joint_replaces_the_standstill_of_a_gear(wheels: int) -> None:
    _gear(wheels, 0, 1, gearRatio=1, gearAuxLink=2)
    p.setJointMotorControl2(wheels, 2, p.VELOCITY_CONTROL, targetVelocity=3, force=1e4)
    p.setJointMotorControl2(wheels, 0, p.VELOCITY_CONTROL, targetVelocity=1, force=1e4)
    _steps(60)
    assert p.getJointState(wheels, 1)[1] == pytest.approx(2, abs=1e-2)


def test_constraints_are_listed_and_go_with_their_bodies(box: int) -> None:
    other = p.createMultiBody(1.0, basePosition=[0, 0, 3])
    first = p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0.1], [1, 0, 1])
    second = p.createConstraint(box, -1, other, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 1], [0, 0, -1])
    third = p.createConstraint(other, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 3])
    assert [first, second, third] == [1, 2, 3]
    assert p.getConstraintInfo(first) == (
        *(box, -1, -1, -1, p.JOINT_FIXED, (0.0, 0.0, 0.0), (0.0, 0.0, 0.1), (1.0, 0.0, 1.0)),
        *((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), 500.0, 0.0, 0, 0.0, 0.0),
    )
    p.removeConstraint(first)
    p.removeConstraint(99)
    p.changeConstraint(99, maxForce=1)
    assert [p.getConstraintUniqueId(i) for i in range(-1, 3)] == [-1, 3, 2, -1]  # as in PyBullet
    p.removeBody(box)
    assert p.getNumConstraints() == 1
    _steps(3)
    p.resetSimulation()
    assert p.getNumConstraints() == 0


def test_the_last_constraint_takes_the_place_of_one_that_is_removed(box: int) -> None:
    """Orders of PyBullet 3.2.7."""
    other = p.createMultiBody(1.0, basePosition=[3, 0, 1])
    for body in (box, other, box, other, other, box):
        p.createConstraint(body, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    p.removeConstraint(2)
    assert [p.getConstraintUniqueId(i) for i in range(6)] == [1, 6, 3, 4, 5, -1]
    p.removeBody(box)
    assert [p.getConstraintUniqueId(i) for i in range(3)] == [5, 4, -1]


def test_orientations_are_reported_as_they_were_given(box: int) -> None:
    turns = [0, 0, 1, 1], [0, 0, 0, 0]
    made = p.createConstraint(
        box, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [1, 0, 1], *turns
    )  # fmt: skip
    assert p.getConstraintInfo(made)[8:10] == ((0.0, 0.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0))
    p.changeConstraint(made, jointChildFrameOrientation=[0, 0, 2, 0])
    assert p.getConstraintInfo(made)[9] == (0.0, 0.0, 2.0, 0.0)


def test_a_bound_that_is_not_set_is_an_impulse_whatever_the_time_step(client: int) -> None:
    """500 N s in a step take 50 m/s from 10 kg, which fall with Bullet's largest velocity, 100 m/s."""
    p.setGravity(0, 0, -240000)
    box = p.createMultiBody(10.0, basePosition=[0, 0, 1])
    p.createConstraint(box, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    for time_step in (1 / 240, 1 / 480):
        p.setTimeStep(time_step)
        p.resetBasePositionAndOrientation(box, [0, 0, 1], [0, 0, 0, 1])
        p.stepSimulation()
        assert p.getBaseVelocity(box)[0] == pytest.approx((0, 0, -50), abs=1e-9)


@pytest.mark.parametrize("unknown", [0, 7, -1])
def test_unknown_constraints(client: int, unknown: int) -> None:
    with pytest.raises(p.error, match="Couldn't get user constraint info"):
        p.getConstraintInfo(unknown)
    with pytest.raises(p.error, match=r"Couldn't getConstraintState\."):
        p.getConstraintState(unknown)


def test_what_cannot_be_held(wheels: int) -> None:
    with pytest.raises(p.error, match=r"createConstraint failed\."):
        p.createConstraint(55, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 0])
    with pytest.raises(p.error, match=r"createConstraint failed\.") as caught:
        p.createConstraint(wheels, -1, wheels, 0, p.JOINT_GEAR, [0, 0, 0], [0, 0, 0], [0, 0, 0])
    assert "gears couple joints" in caught.value.__notes__[0]


def test_a_state_is_restored_though_constraints_came_and_went(client: int) -> None:
    p.setGravity(0, 0, -10)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    body = p.createMultiBody(1, box, basePosition=[0, 0, 1])

    def fall() -> tuple[float, ...]:
        for _ in range(5):
            p.stepSimulation()
        return p.getBasePositionAndOrientation(body)[0]

    free = p.saveState()
    fallen = fall()
    held = p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    p.restoreState(free)
    assert p.getBasePositionAndOrientation(body)[0] == (0, 0, 1)
    assert fall() == pytest.approx((0, 0, 1), abs=1e-4), "the constraint stays"
    tied = p.saveState()
    p.removeConstraint(held)
    p.restoreState(tied)
    assert fall()[2] < 0.9999, "and does not come back"
    p.restoreState(free)
    assert fall() == pytest.approx(fallen, abs=1e-12)


def test_a_gear_keeps_its_place_in_the_order_of_solution_when_it_changes(client: int) -> None:
    """Few rounds, so that the order shows: speeds of PyBullet 3.2.7."""
    p.setPhysicsEngineParameter(numSolverIterations=3)
    box, three = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.1]), range(3)
    arm = p.createMultiBody(
        baseCollisionShapeIndex=box,
        basePosition=[0, 0, 1],
        linkMasses=[1, 0.5, 0.25],
        linkCollisionShapeIndices=[box] * 3,
        linkVisualShapeIndices=[-1] * 3,
        linkPositions=[[0, 0, 0.3]] * 3,
        linkOrientations=[[0, 0, 0, 1]] * 3,
        linkInertialFramePositions=[[0, 0, 0.05]] * 3,
        linkInertialFrameOrientations=[[0, 0, 0, 1]] * 3,
        linkParentIndices=[0, 1, 2],
        linkJointTypes=[p.JOINT_REVOLUTE] * 3,
        linkJointAxis=[[0, 1, 0]] * 3,
    )
    for joint, speed in enumerate((1.0, -0.5, 2.0)):
        p.setJointMotorControl2(arm, joint, p.VELOCITY_CONTROL, targetVelocity=speed, force=2.0)
    first, second = (
        p.createConstraint(arm, a, arm, a + 1, p.JOINT_GEAR, [0, 1, 0], [0, 0, 0], [0, 0, 0]) for a in (0, 1)
    )
    for gear in (first, second):
        p.changeConstraint(gear, maxForce=50.0)
    _steps(2)
    for changes, count, wanted in (
        ({"gearRatio": -2.0}, 1, [0.09984324307146869, 0.20951949659370528, 0.11183908845669288]),
        (
            {"gearRatio": 0.5, "relativePositionTarget": 0.1, "erp": 0.2},
            5,
            [1.0165248891232372, -0.5396825217655217, 0.9282351407311795],
        ),
    ):
        p.changeConstraint(first, **changes)
        _steps(count)
        speeds = [p.getJointState(arm, joint)[1] for joint in three]
        assert speeds == pytest.approx(wanted, abs=1e-9)


def test_steps_after_the_last_constraint_is_removed_are_those_of_a_world_without(client: int) -> None:
    """Its rows remain, but MuJoCo makes none, as in a world that never had any."""
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    cube = p.createMultiBody(1.0, box, -1, [0, 0, 1])
    p.setGravity(0, 0, -10)
    speed = []
    for is_held in (False, True):
        p.resetBasePositionAndOrientation(cube, [0, 0, 1], [0, 0, 0, 1])
        if is_held:
            held = p.createConstraint(cube, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
            _steps(1)
            p.removeConstraint(held)
        p.resetBasePositionAndOrientation(cube, [0, 0, 1], [0, 0, 0, 1])
        p.resetBaseVelocity(cube, [0, 0, 0], [1, 2, 3])
        _steps(20)
        stepping = CLIENTS[client].scene.world.stepping
        assert stepping.in_turn.contact_rows.is_last and stepping._is_direct
        speed.append(p.getBaseVelocity(cube))
    assert speed[0] == speed[1]


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (False, [-5.125e-06, -8.5e-08, 0.614419257, 8.0064e-05, 0.000357264, 0.000109809]),
        (True, [0.00470227, -3.108e-06, -0.096286138, -0.018326447, 0.571303424, 0.005827225]),
    ],
)
def test_a_slide_beside_a_centre_of_mass(client: int, other: bool, expected: list[float]) -> None:
    """Recorded from PyBullet, whose rounds end before forces have converged: the order of rows counts."""
    p.setGravity(0, 0, -10)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.2])
    box = p.createMultiBody(1, shape, -1, [1, 0, 0.5])
    carrier = p.createMultiBody(2, shape, -1, [0, 0, 0.5]) if other else -1
    slide = p.createConstraint(
        box, -1, carrier, -1, p.JOINT_PRISMATIC, [0, 1, 0], [0.05, -0.02, 0.03],
        [1.05, 0.02, 0.05 if other else 0.55],
    )  # fmt: skip
    _steps(3)
    assert np.ravel(p.getBaseVelocity(box)) == pytest.approx(expected, abs=3e-6 if other else 1e-8)
    if not other:
        assert p.getConstraintState(slide) == pytest.approx(
            [-26.8131525, 0.0013011, -0.000219, -0.5365337, -1.3416627], abs=1e-6
        )
