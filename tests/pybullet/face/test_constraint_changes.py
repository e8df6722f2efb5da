"""Constraints whose force or frame changes in every step: as by the Python functions, and as in PyBullet."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.api import constraints
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet.fast.properties import entries as property_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
ZERO = [0, 0, 0]


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert property_entries.PROPERTIES.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    constraints.replace_changes()
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def held_box() -> tuple[int, int]:
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    box = p.createMultiBody(
        1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3]), basePosition=[0, 0, 1]
    )
    return box, p.createConstraint(box, -1, -1, -1, p.JOINT_FIXED, ZERO, [0, 0, 0.1], [0, 0, 1.1])


def test_a_box_with_changing_bounds_moves_as_in_pybullet() -> None:
    box, held = held_box()
    for step in range(120):
        p.changeConstraint(held, [0.1, 0, 1.1], maxForce=4 + 2 * (step % 5))
        p.stepSimulation()
    assert p.getConstraintInfo(held)[10] == 12.0
    position, turn = p.getBasePositionAndOrientation(box)
    np.testing.assert_allclose(position, POSITION, rtol=0, atol=1e-8)
    np.testing.assert_allclose(turn, TURN, rtol=0, atol=1e-8)


POSITION, TURN = (0.07826082804157877, 0.0, 0.7675346428892326), (0.0, 0.0, 0.0, 1.0)
"""Of the box in PyBullet 3.2.7 (m; x, y, z, w)."""


def refresh() -> None:
    """Let the next step look up all bounds."""
    client: Any = CLIENTS[0]
    client.scene.world.constraints.rows.refresh()
    client.scene.world.refresh_stepping()


def test_bounds_are_those_of_the_python_function() -> None:
    outcomes: list[Any] = []
    read = p.getConstraintInfo.__self__  # keeps no answers
    for is_python in (False, True):
        draw = random.Random(5)
        box, held = held_box()
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [2, 0, 1])
        made = [held, p.createConstraint(robot, 2, robot, 3, p.JOINT_GEAR, [0, 1, 0], ZERO, ZERO)]

        change = p.changeConstraint.__self__ if is_python else p.changeConstraint
        change(made[1], gearRatio=-1, maxForce=100)
        for step in range(120):
            for constraint in made:
                change(constraint, maxForce=draw.choice([0.5, 3, 20.0, 0, 1e11]))
            if is_python:
                refresh()
            p.setJointMotorControl2(robot, 2, p.VELOCITY_CONTROL, targetVelocity=5, force=20)
            if step % 30 == 10:
                made.append(p.createConstraint(box, -1, -1, -1, p.JOINT_POINT2POINT, ZERO, ZERO, [0, 0, 1]))
            if step % 30 == 20:
                p.removeConstraint(made.pop())
            if step % 40 == 35:
                change(made[1], gearRatio=-1 - 0.01 * step)
            if step == 60:
                p.createMultiBody(1.0, basePosition=[5, 5, 5])
            p.stepSimulation()
            outcomes += [p.getConstraintState(k) for k in made] + [read(k) for k in made]
            outcomes += [p.getBasePositionAndOrientation(box), p.getJointStates(robot, [2, 3])]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_machine_code_writes_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    _, held = held_box()
    for force in (5, 6):
        p.changeConstraint(held, maxForce=force)
        p.stepSimulation()
    p.changeConstraint(held, maxForce=7)
    client: Any = CLIENTS[0]
    rows = client.scene.world.constraints.rows
    monkeypatch.setattr(rows, "write_bound", None)  # which the Python function calls
    p.changeConstraint(held, maxForce=8)
    p.stepSimulation()
    assert p.getConstraintInfo(held)[10] == 8.0
    assert np.abs(p.getConstraintState(held)[:3]).max() == pytest.approx(8.0, rel=1e-6)


def turn_of(step: int) -> list[float]:
    return [0.0, 0.01 * step, 0.3, 2.0 - 0.01 * (step % 7)]


def test_a_box_that_is_turned_by_its_constraint_moves_as_in_pybullet() -> None:
    box, held = held_box()
    for step in range(60):
        p.changeConstraint(held, [0.001 * step, 0, 1.1], turn_of(step), maxForce=50)
        p.stepSimulation()
    position, turn = p.getBasePositionAndOrientation(box)
    np.testing.assert_allclose(position, TURNED[:3], rtol=0, atol=1e-9)
    np.testing.assert_allclose(turn, TURNED[3:], rtol=0, atol=1e-9)


TURNED = (
    *(0.004380078139423495, -0.00769534417889882, 1.014077409437603),
    *(1.9012120006406038e-05, 0.26548304642465953, 0.14496864669909157, 0.9531541549895564),
)
"""Position (m) and quaternion of that box in PyBullet 3.2.7."""


def test_turned_frames_are_those_of_the_python_function() -> None:
    outcomes: list[Any] = []
    for is_python in (False, True):
        draw = random.Random(2)
        box, held = held_box()
        robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [2, 0, 1])
        made = [
            held,
            p.createConstraint(box, -1, robot, -1, p.JOINT_FIXED, ZERO, ZERO, [-2, 0, 0]),
            p.createConstraint(box, -1, robot, 3, p.JOINT_FIXED, ZERO, ZERO, [-2, 0, 0]),
        ]
        change = p.changeConstraint.__self__ if is_python else p.changeConstraint
        client: Any = CLIENTS[0]
        for step in range(80):
            turn: Any = [draw.uniform(-1, 1) for _ in range(4)]
            if step % 5 == 4:
                turn = draw.choice([[0, 0, 0, 0], (0, 0, 0, 1), [0.6, 0, 0, 0.8], np.array([0, 0, 3.0, 4.0])])
            for constraint in made:
                change(constraint, jointChildFrameOrientation=turn)
                change(constraint, [0, 0.01 * step, 1], turn[::-1])
            if step % 30 == 10:
                p.createMultiBody(1.0, basePosition=[5, 5, 5])
                change(held, jointChildFrameOrientation=turn)
            if step % 3 == 0:
                p.stepSimulation()
            world = client.scene.world
            for record in client.scene.constraints.values():
                outcomes += [record.child_orientation, tuple(record.made.orientation_b)]
                if not world.is_stale:
                    outcomes.append(world.live_model.site_quat[record.made.rows[1]].tolist())
            outcomes.append(p.getBasePositionAndOrientation(box))
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])
