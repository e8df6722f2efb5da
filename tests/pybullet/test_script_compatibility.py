"""Behaviour of PyBullet 3.2.7 that published scripts rely on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import roboyard.pybullet as p
import roboyard.pybullet_data as data


def test_a_leading_slash_is_no_hindrance(client: int) -> None:
    """Scripts write "%s/plane.urdf" % root with an empty root."""
    p.setAdditionalSearchPath(data.getDataPath())
    assert p.loadURDF("/plane.urdf") == 0
    with pytest.raises(p.error, match="Cannot load URDF file"):
        p.loadURDF("/no/such/plane.urdf")


def test_a_line_colour_of_four_numbers_is_left_out(client: int) -> None:
    assert p.addUserDebugLine([0, 0, 0], [1, 0, 0], [1, 0, 0, 1]) >= 0
    with pytest.raises(TypeError):
        p.addUserDebugLine([0, 0, 0], [1, 0, 0], ["red", 0, 0])
    with pytest.raises(p.error, match="textColorRGBObj"):
        p.addUserDebugText("red", [0, 0, 0], [1, 0, 0, 1])


def test_the_mass_matrix_takes_more_numbers_than_it_needs(client: int) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    robot = p.loadURDF("r2d2.urdf")
    count = len([j for j in range(p.getNumJoints(robot)) if p.getJointInfo(robot, j)[3] >= 0])
    positions = [0.01 * k for k in range(count)]
    wanted = p.calculateMassMatrix(robot, positions)
    np.testing.assert_array_equal(p.calculateMassMatrix(robot, [*positions, 5.0, 6.0]), wanted)
    with pytest.raises(p.error, match="calculateMassMatrix"):
        p.calculateMassMatrix(robot, positions[:-1])


def test_shapes_that_are_in_no_body_can_be_compared(client: int) -> None:
    sphere = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.2])

    def gap(one: int, two: int, x: float) -> float:
        (point,) = p.getClosestPoints(
            -1, -1, 100, collisionShapeA=one, collisionShapeB=two, collisionShapePositionA=[x, 0, 1],
            collisionShapePositionB=[1.5, 0, 1],
        )  # fmt: skip
        assert point[1:5] == (-1, -1, -2, -2)
        return point[8]

    assert gap(sphere, box, 0.5) == pytest.approx(0.7, abs=1e-6)
    assert gap(sphere, box, 0.6) == pytest.approx(0.6, abs=1e-6)
    assert gap(box, box, 0.5) == pytest.approx(0.6, abs=1e-6)
    assert gap(sphere, sphere, 0.5) == pytest.approx(0.8, abs=1e-6)
    p.removeCollisionShape(sphere)
    larger = p.createCollisionShape(p.GEOM_SPHERE, radius=0.3)
    assert gap(larger, box, 0.5) == pytest.approx(0.5, abs=1e-6)
    assert p.getNumBodies() == 0
    with pytest.raises(p.error):
        gap(99, box, 0.5)


def test_commands_are_logged_and_called_again(client: int, tmp_path: Path) -> None:
    p.setAdditionalSearchPath(data.getDataPath())
    log = p.startStateLogging(p.STATE_LOGGING_ALL_COMMANDS, str(tmp_path / "commands.bin"))
    p.setGravity(0, 0, -9.81)
    p.loadURDF("plane.urdf")
    ball = p.createMultiBody(
        1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), basePosition=np.array([0, 0, 1.0])
    )
    p.resetBaseVelocity(ball, linearVelocity=[0.5, 0, 0])
    for _ in range(50):
        p.stepSimulation()
    p.stopStateLogging(log)
    end = p.getBasePositionAndOrientation(ball)
    p.stepSimulation()  # no longer logged
    p.resetSimulation()
    replay = p.startStateLogging(p.STATE_REPLAY_ALL_COMMANDS, str(tmp_path / "commands.bin"))
    assert p.getNumBodies() == 2 and p.getBasePositionAndOrientation(ball) == end
    p.stopStateLogging(replay)


@pytest.mark.parametrize(
    "content", [b"\x00", b"\xff\xff\xff\xff", b"\x00\x00\x00\x01\xc1", b"no commands here"]
)
def test_other_files_are_not_replayed(client: int, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "other.bin").write_bytes(content)
    with pytest.raises(p.error, match="startStateLogging failed") as caught:
        p.startStateLogging(p.STATE_REPLAY_ALL_COMMANDS, str(tmp_path / "other.bin"))
    assert "not a log of commands" in "".join(caught.value.__notes__)


def test_a_log_of_controllers_has_no_records(client: int, tmp_path: Path) -> None:
    path = tmp_path / "controllers.bin"
    log = p.startStateLogging(p.STATE_LOGGING_VR_CONTROLLERS, str(path))
    p.stepSimulation()
    p.stopStateLogging(log)
    names, types, rest = path.read_bytes().split(b"\n")
    assert len(names.split(b",")) == len(types) and not rest


def test_a_new_mass_lets_a_fixed_base_go(client: int) -> None:
    """Positions and speeds are real PyBullet's."""
    p.setGravity(0, 0, -10)
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.5, 0.5, 0.5])
    cube = p.createMultiBody(0, box, basePosition=[0, 0, 3])
    for _ in range(10):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(cube)[0] == (0, 0, 3)
    p.changeDynamics(cube, -1, mass=1)
    for _ in range(51):
        p.stepSimulation()
    np.testing.assert_allclose(p.getBasePositionAndOrientation(cube)[0], [0, 0, 2.7711017501], atol=1e-8)
    np.testing.assert_allclose(p.getBaseVelocity(cube)[0], [0, 0, -2.1039336497], atol=1e-8)
    assert p.getDynamicsInfo(cube, -1)[0] == 1.0
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    p.changeDynamics(plane, -1, mass=1)
    for _ in range(300):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(plane)[0] == (0, 0, 0)
    assert p.getBasePositionAndOrientation(cube)[0][2] == pytest.approx(0.5, abs=1e-3)
