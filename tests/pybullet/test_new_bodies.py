"""Bodies that are read, set or commanded before the next step: the same numbers, and few compiles."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import roboyard.pybullet as p

INERTIAL = """<inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"""
BOX = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
ARM = f"""<robot name="arm"><link name="ROOT">{INERTIAL}{BOX}</link><link name="upper">{INERTIAL}{BOX}</link>
<link name="hand">{INERTIAL}{BOX}</link>
<joint name="hinge" type="continuous"><parent link="ROOT"/><child link="upper"/><origin xyz="1 0 0"/>
<axis xyz="0 0 1"/></joint>
<joint name="slide" type="prismatic"><parent link="upper"/><child link="hand"/><origin xyz="0 2 0"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>"""
COUNT = 12


@pytest.fixture
def arm(client: int, tmp_path: Path) -> str:
    """The file of a robot with a hinge and a slide."""
    (tmp_path / "arm.urdf").write_text(ARM.replace("ROOT", "base"))
    return str(tmp_path / "arm.urdf")


def _world() -> Any:
    from roboyard.pybullet.connections import CLIENTS

    opened: Any = CLIENTS[0]
    return opened.scene.world


def _compiles(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that gets an entry with each compile of the world."""
    world, found = _world(), []
    refresh = world._after_compile
    monkeypatch.setattr(world, "_after_compile", lambda: (found.append(1), refresh()))
    return found


READS: dict[str, Callable[[int, int], Any]] = {
    "getLinkState": p.getLinkState,
    "getLinkStates": lambda body, link: p.getLinkStates(body, [link]),
    "getJointState": p.getJointState,
    "getJointStates": lambda body, joint: p.getJointStates(body, [joint]),
    "getAABB": p.getAABB,
    "getBaseVelocity": lambda body, _: p.getBaseVelocity(body),
    "getBasePositionAndOrientation of all": lambda body, _: [
        p.getBasePositionAndOrientation(other) for other in range(body + 1)
    ],
    "getJointState of all": lambda body, joint: [p.getJointState(other, joint) for other in range(body + 1)],
    "resetJointState": lambda body, joint: p.resetJointState(body, joint, 0.1),
    "resetJointStateMultiDof": lambda body, joint: p.resetJointStateMultiDof(body, joint, [0.1]),
    "resetBaseVelocity": lambda body, _: p.resetBaseVelocity(body, [0, 0, 1]),
    "setJointMotorControl2": lambda body, joint: p.setJointMotorControl2(
        body, joint, p.VELOCITY_CONTROL, force=0
    ),
    "setJointMotorControlArray": lambda body, joint: p.setJointMotorControlArray(
        body, [joint], p.POSITION_CONTROL, [0.5]
    ),
    "setCollisionFilterGroupMask": lambda body, link: (
        p.setCollisionFilterGroupMask(body, link, 0, 0),
        p.getAABB(body),
    ),
    "changeDynamics": lambda body, link: (p.changeDynamics(body, link, mass=2), p.getLinkState(body, link)),
}


@pytest.mark.parametrize("name", READS)
def test_many_new_robots_are_read_with_few_compiles(
    arm: str, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    compiles = _compiles(monkeypatch)
    for k in range(COUNT):
        READS[name](p.loadURDF(arm, [0, 0, 5 * k]), 1)
    p.stepSimulation()
    assert len(compiles) <= 4


def test_frames_are_those_of_the_joints_that_were_set(arm: str) -> None:
    angle, length, turn = 0.7, 0.3, 0.4
    for k in range(COUNT):
        body = p.loadURDF(arm, [k, 0, 5], p.getQuaternionFromEuler([0, 0, turn]))
        p.resetJointState(body, 0, angle)
        p.resetJointState(body, 1, length, 0.25)
        x, y = 1 - 2 * math.sin(angle), 2 * math.cos(angle)
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
        x, y = k + x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        found = p.getLinkState(body, 1)
        assert found[4] == pytest.approx((x, y, 5), abs=1e-6)
        assert p.getEulerFromQuaternion(found[5])[2] == pytest.approx(angle + turn)
        lower, upper = p.getAABB(body, 1)
        assert [(a + b) / 2 for a, b in zip(lower, upper, strict=True)] == pytest.approx((x, y, 5), abs=1e-6)
        assert p.getJointState(body, 1)[:2] == (length, 0.25)


@pytest.mark.parametrize("fixed", [False, True])
def test_the_compiled_world_has_the_same_state(arm: str, fixed: bool) -> None:
    before = []
    for k in range(COUNT):
        body = p.loadURDF(arm, [k, 0, 1], useFixedBase=fixed)
        p.resetJointState(body, 0, 0.1 * k, 0.2)
        p.resetJointState(body, 1, 0.01 * k, -0.3)
        p.resetBasePositionAndOrientation(body, [k, 7, 2], p.getQuaternionFromEuler([0.1 * k, 0.2, 0.3]))
        if not fixed:
            p.resetBaseVelocity(body, [k, 2, 3], [0.1, 0.2, 0.3])
        before.append(_state(body))
    p.performCollisionDetection()
    p.getClosestPoints(0, 1, 0.1)
    for body, state in enumerate(before):
        for one, other in zip(_state(body), state, strict=True):
            assert one == pytest.approx(other, abs=1e-9)


def _state(body: int) -> list[Any]:
    links = p.getLinkStates(body, [0, 1], computeLinkVelocity=1, computeForwardKinematics=1)
    found = [*p.getBasePositionAndOrientation(body), *p.getBaseVelocity(body)]
    return [*found, *(part for state in links for part in state), *p.getJointState(body, 0)[:2]]


def test_bodies_that_were_compiled_are_read_while_a_new_one_awaits_it(
    arm: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = p.loadURDF(arm, [0, 0, 1], useFixedBase=True)
    p.resetJointState(old, 0, math.pi / 2)
    p.getAABB(old, 1)
    assert p.getLinkState(old, 1, computeForwardKinematics=1)[4] == pytest.approx((-1, 0, 1), abs=1e-6)
    p.stepSimulation()
    p.getLinkState(old, 1)
    compiles = _compiles(monkeypatch)
    p.loadURDF(arm, [9, 0, 0])
    p.resetJointState(old, 0, 0.0)
    assert p.getLinkState(old, 1)[4] == pytest.approx((1, 2, 1), abs=1e-6)
    lower, upper = p.getAABB(old, 1)
    assert [(a + b) / 2 for a, b in zip(lower, upper, strict=True)] == pytest.approx((1, 2, 1), abs=1e-6)
    assert not compiles
    p.resetBasePositionAndOrientation(old, [5, 0, 1], [0, 0, 0, 1])
    assert p.getLinkState(old, 1)[4] == pytest.approx((6, 2, 1), abs=1e-6)
    p.stepSimulation()
    assert p.getJointState(old, 0)[0] == pytest.approx(0, abs=1e-6)


def test_a_new_pose_ends_the_velocity_that_a_new_body_got(arm: str) -> None:
    for _ in range(COUNT):
        body = p.loadURDF(arm)
        p.resetBaseVelocity(body, [1, 2, 3], [4, 5, 6])
        assert p.getBaseVelocity(body)[0] == pytest.approx((1, 2, 3))
        p.resetBasePositionAndOrientation(body, [0, 0, 1], [0, 0, 0, 1])
        assert p.getBaseVelocity(body) == ((0, 0, 0), (0, 0, 0))


def test_a_fixed_base_that_is_carried_away_keeps_the_joints_that_were_set(arm: str) -> None:
    for _ in range(COUNT):
        body = p.loadURDF(arm, useFixedBase=True)
        p.resetJointState(body, 1, 0.3)
        p.resetBaseVelocity(body, [0, 0, 1])
        assert p.getJointState(body, 1)[0] == 0.3


def test_a_motor_that_was_switched_off_before_the_first_step_leaves_the_joint_free(arm: str) -> None:
    for k in range(COUNT):
        body = p.loadURDF(arm, [0, 0, 5 * k], useFixedBase=True)
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, force=0)
        p.resetJointState(body, 0, 0.0, 1.0)
    for _ in range(10):
        p.stepSimulation()
    speeds = [p.getJointState(body, 0)[1] for body in range(COUNT)]
    assert min(speeds) > 0.9


def test_robots_whose_base_is_called_world_are_loaded_in_any_number(client: int, tmp_path: Path) -> None:
    """MuJoCo's own root has that name, too."""
    (tmp_path / "arm.urdf").write_text(ARM.replace("ROOT", "world"))
    for k in range(COUNT):
        body = p.loadURDF(str(tmp_path / "arm.urdf"), [k, 0, 0], useFixedBase=True)
        assert p.getLinkState(body, 0)[4] == pytest.approx((k + 1, 0, 0))
        if k % 2:
            p.stepSimulation()
    assert p.getNumBodies() == COUNT


def test_a_link_is_pushed_right_after_a_robot_was_loaded(arm: str) -> None:
    """Frames of the last step are those of another compile."""
    for k in range(COUNT):
        body = p.loadURDF(arm, [3 * k, 0, 0])
        p.applyExternalForce(body, 0, [0, 0, 10], [0, 0, 0], p.LINK_FRAME)
        p.stepSimulation()
        assert p.getBaseVelocity(body)[0][2] > 0.0


@pytest.mark.parametrize("placed", [10, 4000])
def test_poses_of_new_bodies_are_set_quickly_once_they_are_many(
    client: int, monkeypatch: pytest.MonkeyPatch, placed: int
) -> None:
    """A program that only places bodies, as those that draw orbits do, compiles once; a few poses do not."""
    compiles = _compiles(monkeypatch)
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    bodies = [p.createMultiBody(1, shape, -1, [i, 0, 1]) for i in range(4)]
    for k in range(placed):
        for i, body in enumerate(bodies):
            p.resetBasePositionAndOrientation(body, [i, 0.001 * k, 2], [0, 0, 0, 1])
    assert _world().is_stale == (placed == 10)
    assert len(compiles) <= (placed > 10)
    for i, body in enumerate(bodies):
        position, orientation = p.getBasePositionAndOrientation(body)
        assert position == pytest.approx((i, 0.001 * (placed - 1), 2), abs=1e-12)
        assert orientation == pytest.approx((0, 0, 0, 1), abs=1e-12)


def test_filters_between_new_bodies_and_another_need_few_compiles(
    client: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every other box falls through the plane; the rest of the boxes stay on it."""
    p.setGravity(0, 0, -10)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    counts = _compiles(monkeypatch)
    for turn in range(40):
        box = p.createMultiBody(1, shape, -1, [0, 0, 0.1])
        falls = turn % 2 == 0
        if falls:
            p.setCollisionFilterPair(plane, box, -1, -1, 0)
        for _ in range(12):
            p.stepSimulation()
        speed = p.getBaseVelocity(box)[0][2]
        assert speed == pytest.approx(-12 * 10 / 240 if falls else 0.0, abs=0.02)
        p.removeBody(box)
        p.stepSimulation()
    assert len(counts) < 16


def test_bodies_without_mass_for_a_while_need_no_compile(
    client: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Mass 0 keeps the velocity, in a closed form; the next body in the same rows falls again."""
    p.setGravity(0, 0, -10)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
    other = p.createMultiBody(1, shape, -1, [5, 0, 0])
    p.stepSimulation()
    counts = _compiles(monkeypatch)
    for _ in range(16):
        box = p.createMultiBody(1, shape, -1, [0, 0, 9])
        p.changeDynamics(box, -1, linearDamping=0)
        speed, is_free = 0.0, True
        for step in range(60):
            if step % 20 == 10:
                is_free = not is_free
                p.changeDynamics(box, -1, mass=1.5 if is_free else 0)
            p.stepSimulation()
            speed -= 10 / 240 if is_free else 0.0
            assert p.getBaseVelocity(box)[0][2] == pytest.approx(speed, abs=1e-9)
        p.removeBody(box)
        p.stepSimulation()
    assert p.getBaseVelocity(other)[0][2] < -10, "it has fallen all the time"
    assert len(counts) < 8
