"""Settings of the solver change what motors reach in a step, as recorded from PyBullet 3.2.7."""

import math

import numpy as np
import pytest

from roboyard import pybullet as p

AXES = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
RECORDED = {
    ("numSolverIterations", 1): (0.340272, 0.06997, 0.203964, -0.108731, 0.138115, -0.349052, 0.210667),
    ("numSolverIterations", 3): (0.222363, 0.038537, 0.203964, -0.196815, -0.170053, -0.278637, 0.182213),
    ("numSolverIterations", 10): (0.163346, 0.059974, 0.66013, -0.190486, -0.423514, -0.24897, 0.139026),
    ("numSolverIterations", 50): (0.238373, 0.042705, 0.358663, -0.202804, -0.423514, -0.253661, 0.143504),
    ("solverResidualThreshold", 0.01): (
        *(0.23838, 0.042711, 0.358678, -0.202803, -0.423599, -0.253672, 0.143486),
    ),
}  # fmt: skip


@pytest.fixture
def arm(tmp_path):
    inertial = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    links = "".join(f'<link name="link{i}">{inertial}</link>' for i in range(8))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="link{i}"/><child link="link{i + 1}"/>'
        f'<origin xyz="0 0 0.2"/><axis xyz="{axis}"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        for i, axis in enumerate(AXES)
    )
    file = tmp_path / "arm.urdf"
    file.write_text(f'<robot name="a">{links}{joints}</robot>')
    number = p.connect(p.DIRECT)
    yield str(file)
    p.disconnect(number)


def positions_after(body: int) -> list[float]:
    for step in range(20):
        for j in range(7):
            goal = 0.5 * math.sin(0.05 * step + j)
            p.setJointMotorControl2(body, j, p.POSITION_CONTROL, goal, force=60)
        p.stepSimulation()
    return [state[0] for state in p.getJointStates(body, range(7))]


@pytest.mark.parametrize(("name", "value"), RECORDED)
def test_rounds_and_residual_are_pybullets(arm, name, value):
    p.setGravity(0, 0, -9.81)
    p.setPhysicsEngineParameter(**{name: value})
    body = p.loadURDF(arm, useFixedBase=True)
    assert np.allclose(positions_after(body), RECORDED[name, value], atol=2e-6)


def test_a_reset_restores_them(arm):
    p.setPhysicsEngineParameter(numSolverIterations=1, solverResidualThreshold=1.0)
    p.stepSimulation()
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    body = p.loadURDF(arm, useFixedBase=True)
    assert np.allclose(positions_after(body), RECORDED["numSolverIterations", 50], atol=2e-6)


def columns(count: int, height: int, steps: int, *, top_mass: float = 1.0) -> list[tuple[list[int], float]]:
    """Return the cubes of columns after so many steps, and with what force (N) each stands on the ground.

    Cubes are 0.1 m wide and have 1 kg, the top ones `top_mass`.
    """
    p.setGravity(0, 0, -10)
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05] * 3)
    cubes = [
        [
            p.createMultiBody(1 if k < height - 1 else top_mass, shape, basePosition=(*place, 0.05 + 0.1 * k))
            for k in range(height)
        ]
        for place in ((0.3 * (c % 3), 0.3 * (c // 3)) for c in range(count))
    ]
    for _ in range(steps):
        p.stepSimulation()
    return [(column, sum(point[9] for point in p.getContactPoints(column[0], ground))) for column in cubes]


def height_of(cube: int) -> float:
    return p.getBasePositionAndOrientation(cube)[0][2]


def test_worlds_of_many_bodies_are_solved_in_rounds(client: int) -> None:
    """Of 45 cubes, 270 degrees of freedom; PyBullet has tops at 0.44988 m, bottoms at 0.04999, 50.000 N."""
    for cubes, push in columns(9, 5, 240):
        assert height_of(cubes[-1]) == pytest.approx(0.44988, abs=1e-4)
        assert height_of(cubes[0]) == pytest.approx(0.04999, abs=1e-4)
        assert push == pytest.approx(50.0, abs=0.1)


@pytest.mark.parametrize(
    ("height", "steps", "top"), [(10, 240, 0.94852), (15, 600, 1.4384), (15, 1400, 0.05)]
)
def test_columns_stand_and_fall_as_in_pybullet(client: int, height: int, steps: int, top: float) -> None:
    """The high one leans after 600 steps and is down after 1400; between them cubes tumble."""
    ((column, _),) = columns(1, height, steps)
    assert height_of(column[height - 1]) == pytest.approx(top, abs=5e-3)


def test_dantzigs_method_solves_all_rows_together(client: int) -> None:
    """A column under 100 kg stands 0.92 m high in PyBullet, too; a reset of the simulation ends it there."""
    p.setPhysicsEngineParameter(constraintSolverType=p.CONSTRAINT_SOLVER_LCP_DANTZIG)
    ((column, _),) = columns(1, 10, 200, top_mass=100.0)
    assert height_of(column[9]) > 0.9
    p.resetSimulation()
    ((column, _),) = columns(1, 10, 300, top_mass=100.0)
    assert height_of(column[9]) < 0.7


TURNTABLE = """
<robot name="turntable">
  <link name="base"/>
  <link name="plate">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.1 0 0.05"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="upper">{arm}</link>
  <link name="fore">{arm}</link>
  <joint name="turn" type="continuous">
    <parent link="base"/><child link="plate"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="shoulder" type="continuous">
    <parent link="plate"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
  </joint>
</robot>
""".format(
    arm='<inertial><origin xyz="0.2 0 0"/><mass value="0.5"/>'
    '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
)
TURNED = {
    0.01: (-0.327787471, 1.0, -1.000689611),
    -0.001: (-0.308974976, 0.89545436, -1.0),
}
"""By height (m) of the plate: velocities (rad/s) after three steps, of 30 rounds and of one."""


@pytest.mark.parametrize("height", TURNED)
@pytest.mark.parametrize("others", [0, 40])
def test_a_contact_that_moves_nothing_ends_the_rounds_as_in_pybullet(tmp_path, height, others):
    """The plate turns about its contacts' normal: Bullet divides 0 by 0, and looks at friction alone."""
    file = tmp_path / "turntable.urdf"
    file.write_text(TURNTABLE)
    number = p.connect(p.DIRECT)
    p.setGravity(0, 0, -10)
    ground = p.createCollisionShape(p.GEOM_BOX, halfExtents=[20, 20, 0.5])
    p.createMultiBody(0, ground, basePosition=[0, 0, -0.5])
    body = p.loadURDF(str(file), [0, 0, height], useFixedBase=True, flags=p.URDF_USE_INERTIA_FROM_FILE)
    ball = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.05, 0.05])
    for k in range(others):  # groups of their own, with which there are too many rows for a table
        p.createMultiBody(1, ball, basePosition=[3 + 0.5 * k, 3, 0.05])
    for j, (velocity, force) in enumerate(((-1.0, 20.0), (1.0, 8.0), (-1.0, 4.0))):
        p.setJointMotorControl2(body, j, p.VELOCITY_CONTROL, targetVelocity=velocity, force=force)
    for _ in range(3):
        p.stepSimulation()
    assert len(p.getContactPoints(body)) == (4 if height < 0 else 0)
    assert np.allclose([state[1] for state in p.getJointStates(body, range(3))], TURNED[height], atol=1e-8)
    p.disconnect(number)


def test_friction_without_a_cone_is_pybullets(arm):
    """It is bounded in each direction alone, and nothing resists spinning, until a reset."""
    cone = [
        ((0.813661002, 1.627322004, 0.0), (-7.453559925, 3.726779962, 0.0)),
        ((0.841749724, 1.64235567, -0.044676898), (-0.377211815, 0.679078926, 2.570833729)),
    ]
    pyramid = [
        ((0.654761905, 1.583333333, 0.0), (-8.333333333, 6.547619048, 3.0)),
        ((0.572162031, 1.572162031, 0.022342605), (0.062959102, -0.391526405, 2.835716348)),
    ]
    for settings, expected in (({}, cone), ({"enableConeFriction": 0}, pyramid), ({}, cone)):
        p.resetSimulation()
        p.setPhysicsEngineParameter(numSolverIterations=30, **settings)
        p.setGravity(0, 0, -10)
        plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
        shapes = (
            p.createCollisionShape(p.GEOM_SPHERE, radius=0.1),
            p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1]),
        )
        bodies = [p.createMultiBody(1, shape, basePosition=[k, 0, 0.1]) for k, shape in enumerate(shapes)]
        p.changeDynamics(plane, -1, lateralFriction=0.5)
        for body in bodies:
            p.changeDynamics(body, -1, lateralFriction=1, linearDamping=0, angularDamping=0)
            p.resetBaseVelocity(body, [1, 2, 0], [0, 0, 3])
        p.changeDynamics(bodies[0], -1, spinningFriction=0.1, rollingFriction=0.02)
        for _ in range(20):
            p.stepSimulation()
        for body, velocities in zip(bodies, expected, strict=True):
            assert np.allclose(p.getBaseVelocity(body), velocities, atol=1e-8)


def test_rounds_of_a_fixed_constraint_end_with_its_turns(arm):
    """The rest of the turns of a body that its constraint pulls down is PyBullet's."""
    p.setGravity(0, 0, -9.8)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.15, 0.05])
    body = p.createMultiBody(
        1, box, -1, [0, 0, 4], linkMasses=[0.3], linkCollisionShapeIndices=[box],
        linkVisualShapeIndices=[-1], linkPositions=[[0.3, 0.1, 0]], linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0], linkJointTypes=[p.JOINT_REVOLUTE], linkJointAxis=[[0, 0, 1]],
    )  # fmt: skip
    p.createConstraint(body, -1, -1, -1, p.JOINT_FIXED, [0, 0, 0], [0, 0, 0], [0, 0, 1])
    for velocities in (
        ((0, 0, -100), (0.00013942, 0, 0)),
        ((0, 0, -100), (-1.4483e-05, -0.000150746, 0)),
        ((0, 0, -100), (-1.5335e-05, -7.8423e-05, 0)),
        ((0, 0, -84.000016255), (-0.000170884, 4.5834e-05, 0)),
    ):
        p.stepSimulation()
        assert np.allclose(p.getBaseVelocity(body), velocities, atol=2e-9)


@pytest.mark.parametrize(
    ("changes", "velocities"),
    [
        (
            {"rollingFriction": 0.0001},
            ((-0.081547799, -0.020837915, -0.005863932), (0.280196377, -0.940253, 0.322289051)),
        ),
        ({"lateralFriction": 0}, ((-0.079232514, -0.024509489, 0), (0.491402605, -1.588571033, 0.070312903))),
    ],
)
def test_contacts_without_friction_have_none(arm, changes, velocities):
    """Of small boxes that overlap and are pushed apart; MuJoCo's least coefficient would slow them down."""
    p.setTimeStep(1 / 480)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.005] * 3)
    places = (([0, 0, 0.01], 0.3), ([0.0075, 0.001, 0.012], 0.9))
    bodies = [
        p.createMultiBody(0.001, shape, -1, place, p.getQuaternionFromEuler([0, 0, turn]))
        for place, turn in places
    ]
    for body in bodies:
        p.changeDynamics(body, -1, localInertiaDiagonal=[5e-8] * 3, **changes)
    for _ in range(3):
        p.stepSimulation()
    assert np.allclose(p.getBaseVelocity(bodies[0]), velocities, atol=2e-9)
