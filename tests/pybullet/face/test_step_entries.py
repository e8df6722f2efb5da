"""stepSimulation many times between changes: as by the Python function, and in closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import get_ident
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet.fast.steps import step_entries
from roboyard.pybullet_data import getDataPath
from roboyard.sim.simulation import Simulation
from roboyard.sim.stepping.solver_warning import RAISED, solver_warning

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
STEP = 1 / 240
G = 9.8


@pytest.fixture
def passed_on(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[None]]:
    """A client whose command is machine code, and an item for each call that the Python function got."""
    assert FRONT.address()
    assert step_entries.STEP.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_step()
    calls = list[None]()
    prepare = step_entries.prepare

    def counted(*given: Any) -> None:
        calls.append(None)
        prepare(*given)

    monkeypatch.setattr(step_entries, "prepare", counted)
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(getDataPath())
    yield calls
    for number in list(CLIENTS):
        p.disconnect(number)


def _ball(place: tuple[float, float, float], mass: float = 1.0) -> int:
    made = p.createMultiBody(mass, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1), -1, place)
    p.changeDynamics(made, -1, linearDamping=0, angularDamping=0)
    return made


def _falls(height: float, steps: int) -> float:
    """Return the height after so many steps of semi-implicit Euler."""
    return height - G * STEP**2 * steps * (steps + 1) / 2


def test_a_ball_falls_as_in_the_closed_form(passed_on: list[None]) -> None:
    p.setGravity(0, 0, -G)
    ball = _ball((0, 0, 100))
    for step in range(1, 200):
        assert p.stepSimulation() == ()
        (x, y, z), _ = p.getBasePositionAndOrientation(ball)
        assert (x, y, z) == pytest.approx((0, 0, _falls(100, step)), abs=1e-9)
        assert p.getBaseVelocity(ball)[0][2] == pytest.approx(-G * STEP * step)
    assert 0 < len(passed_on) < 10, "most are made in machine code"


def test_an_external_force_acts_in_one_step(passed_on: list[None]) -> None:
    ball, speed = _ball((0, 0, 0), mass=2.0), 0.0
    for step in range(100):
        if step % 3 == 0:
            p.applyExternalForce(ball, -1, [6, 0, 0], [0, 0, 0], p.LINK_FRAME)
            speed += 3 * STEP
        p.stepSimulation()
        assert p.getBaseVelocity(ball)[0][0] == pytest.approx(speed)
    assert len(passed_on) < 20


def test_settings_and_time_steps_are_followed(passed_on: list[None]) -> None:
    ball, height, speed = _ball((0, 0, 10)), 10.0, 0.0
    for step in range(120):
        duration, gravity = 0.001 * (1 + step // 20), 1.0 + step // 30
        if step % 10 == 0:
            p.setTimeStep(duration)
            p.setGravity(0, 0, -gravity)
        p.stepSimulation()
        speed -= gravity * duration
        height += speed * duration
        assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(height, abs=1e-9)
    p.setTimeStep(0)
    p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0][2] == pytest.approx(height, abs=1e-9)
    assert len(passed_on) < 40


def test_every_step_is_recorded(passed_on: list[None], tmp_path: Path) -> None:
    p.setGravity(0, 0, -G)
    _ball((0, 0, 10))
    for _ in range(50):
        p.stepSimulation()
    log = p.startStateLogging(p.STATE_LOGGING_GENERIC_ROBOT, str(tmp_path / "steps.bin"))
    before = len(passed_on)
    for _ in range(7):
        p.stepSimulation()
    p.stopStateLogging(log)
    assert len(passed_on) == before + 7
    p.stepSimulation()
    assert len(passed_on) == before + 7


def test_a_simulation_that_diverges_raises(passed_on: list[None]) -> None:
    ball = _ball((0, 0, 1))
    for _ in range(20):
        p.stepSimulation()
    before = len(passed_on)
    solver_warning.begin()
    solver_warning.message = "Nan, Inf or huge value in QACC at DOF 0. The simulation is unstable. Time = 0.1"
    with pytest.raises(p.error, match="diverged"):
        p.stepSimulation()
    assert get_ident() not in RAISED, "others may be of threads that ended with theirs"
    p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0] == (0, 0, 1)
    assert len(passed_on) == before


def _program(steps: Callable[[], None]) -> list[Any]:
    """Return states between many changes of what steps depend on; `steps` makes some of them."""
    found: list[Any] = []
    p.resetSimulation()
    p.setGravity(0, 0, -9.8)
    bodies = [p.loadURDF("plane.urdf"), p.loadURDF("r2d2.urdf", [0, 0, 0.6]), p.loadURDF("cartpole.urdf")]
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3)

    def go_on() -> None:
        steps()
        for body in bodies:
            found.append(p.getBasePositionAndOrientation(body))
            found.append(p.getBaseVelocity(body))
            if p.getNumJoints(body):
                found.extend(p.getJointStates(body, range(p.getNumJoints(body))))
                found.append(p.getLinkState(body, 0, computeLinkVelocity=1))
        found.append(p.getContactPoints())

    def with_pd() -> None:
        p.setJointMotorControl2(bodies[2], 1, p.PD_CONTROL, 0.2, 0, 5, 0.1, 0.01)

    def end_pd() -> None:
        p.setJointMotorControl2(bodies[2], 1, p.VELOCITY_CONTROL, force=0)

    def motors() -> None:
        p.setJointMotorControlArray(
            bodies[1], (2, 3), p.VELOCITY_CONTROL, targetVelocities=(-6, -8), forces=(9, 8)
        )

    def fall() -> None:
        bodies.append(p.createMultiBody(1.0, box, -1, [0.3, 0, 1.2]))

    def lock() -> None:
        p.createConstraint(bodies[1], -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])

    saved: list[int] = []
    for change in (
        motors,
        lambda: p.applyExternalTorque(bodies[1], 3, [0, 0, 5], p.LINK_FRAME),
        fall,
        lambda: p.setPhysicsEngineParameter(numSubSteps=3),
        lambda: p.setPhysicsEngineParameter(numSubSteps=0, erp=0.3),
        lambda: p.changeDynamics(bodies[-1], -1, lateralFriction=0.2, restitution=0.4, mass=2),
        lambda: p.enableJointForceTorqueSensor(bodies[2], 0),
        lock,
        lambda: p.removeConstraint(1),
        lambda: p.setCollisionFilterGroupMask(bodies[-1], -1, 0, 0),
        lambda: saved.append(p.saveState()),
        lambda: p.resetJointState(bodies[2], 1, 0.5, 0.1),
        lambda: p.restoreState(saved[0]),
        lambda: p.removeBody(bodies.pop()),
        fall,
        lambda: p.changeDynamics(bodies[1], 2, maxJointVelocity=1.0),
        lambda: p.performCollisionDetection(),
        with_pd,
        end_pd,
    ):
        change()
        go_on()
        p.getLinkState(bodies[1], 3, computeForwardKinematics=1)
        go_on()
    return found


def test_steps_between_changes_are_those_of_the_python_function(
    passed_on: list[None], monkeypatch: pytest.MonkeyPatch
) -> None:
    count = 0

    def steps() -> None:
        nonlocal count
        for _ in range(9):
            p.stepSimulation()
            count += 1

    found = _program(steps)
    assert 0 < len(passed_on) < count // 2, "most are made in machine code"
    monkeypatch.setattr(Simulation, "direct_step", lambda self: None)
    passed_on.clear()
    count = 0
    np.testing.assert_equal(found, _program(steps))
    assert len(passed_on) == count


def _touching() -> list[Any]:
    """Return the contacts of balls of one size that touch, between changes of filters."""
    p.resetSimulation()
    p.setGravity(0, 0, -9.8)
    p.loadURDF("plane.urdf")
    balls = [_ball((0.1999 * k, 0, 0.1)) for k in range(5)]
    found: list[Any] = []
    for turn in range(12):
        one, other = balls[turn % 5], balls[(turn + 1) % 5]
        for is_on in (0, 1):
            p.setCollisionFilterPair(one, other, -1, -1, is_on)
            for _ in range(3):
                p.stepSimulation()
            found.append(p.getContactPoints())
    return found


def test_filters_between_steps_are_followed(passed_on: list[None], monkeypatch: pytest.MonkeyPatch) -> None:
    found = _touching()
    assert passed_on
    monkeypatch.setattr(Simulation, "direct_step", lambda self: None)
    np.testing.assert_equal(found, _touching())


def test_two_clients_do_not_step_each_other(passed_on: list[None]) -> None:
    other = p.connect(p.DIRECT)
    balls = [_ball((0, 0, 5)), 0]
    p.setGravity(0, 0, -G)
    p.setGravity(0, 0, -G, physicsClientId=other)
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1, physicsClientId=other)
    balls[1] = p.createMultiBody(1, shape, -1, [0, 0, 5], physicsClientId=other)
    p.changeDynamics(balls[1], -1, linearDamping=0, physicsClientId=other)
    for _ in range(60):
        p.stepSimulation()
    for _ in range(30):
        p.stepSimulation(other)
    assert p.getBasePositionAndOrientation(balls[0])[0][2] == pytest.approx(_falls(5, 60), abs=1e-9)
    after = p.getBasePositionAndOrientation(balls[1], physicsClientId=other)[0][2]
    assert math.isclose(after, _falls(5, 30), abs_tol=1e-9)
