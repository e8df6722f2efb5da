"""Masses and moments that change between steps: as by the Python function, and as in PyBullet."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.api import dynamics
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet.fast.properties import entries as property_entries

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
MOMENTS = ([0.1, 0.1, 0.1], (0.02, 0.03, 0.04), np.array([0.3, 0.2, 0.25]), [1, 2, 2], [0.1, 0.1, 9.0])
"""The last ones are those of no rigid body."""


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert property_entries.PROPERTIES.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    dynamics.replace_changes()
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def spinning_box() -> int:
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    ground = p.createCollisionShape(p.GEOM_PLANE)
    p.createMultiBody(0, ground)
    return p.createMultiBody(1.0, shape, basePosition=[0, 0, 0.35])


def test_a_box_with_changing_moments_moves_as_in_pybullet() -> None:
    box = spinning_box()
    for step in range(60):
        moments = [0.1 + 0.01 * (step % 7), 0.12, 0.15]
        p.changeDynamics(box, -1, localInertiaDiagonal=moments)
        if step % 3 == 0:
            p.changeDynamics(box, -1, mass=1.0 + 0.1 * (step % 4))
        p.applyExternalTorque(box, -1, [2.0, 1.0, 0.5], p.LINK_FRAME)
        p.stepSimulation()
    position, turn = p.getBasePositionAndOrientation(box)
    np.testing.assert_allclose(position, POSITION, rtol=0, atol=1e-6)
    np.testing.assert_allclose(turn, TURN, rtol=0, atol=1e-6)


POSITION, TURN = (
    (-0.012941578642162716, -0.006493264515599611, 0.31810985286022414),
    (0.01723927749888513, 0.05672783803985112, 0.11112164392405287, 0.9920366626059023),
)
"""Of the box in PyBullet 3.2.7 (m; x, y, z, w)."""


def test_masses_and_moments_are_those_of_the_python_function() -> None:
    outcomes: list[Any] = []
    read = p.getDynamicsInfo.__self__  # keeps no answers
    for is_python in (False, True):
        draw, box = random.Random(3), spinning_box()
        change = p.changeDynamics.__self__ if is_python else p.changeDynamics
        for step in range(120):
            given: dict[str, Any] = {}
            if draw.random() < 0.6:
                given["mass"] = draw.choice([0.5, 1, np.float64(2.0), np.float32(0.25), 0.5])
            if draw.random() < 0.6:
                given["localInertiaDiagonal"] = draw.choice(MOMENTS)
            if step % 30 == 20:
                given["mass"] = 0.0
            if step % 40 == 10:
                given["collisionMargin"] = 0.001 * step
            change(box, -1, **given)
            if step % 25 == 24:
                p.createMultiBody(1.0, basePosition=[5, 5, 5 + step])
            if step % 3 == 0:
                p.stepSimulation()
            outcomes += [read(box, -1)[:3], p.getBasePositionAndOrientation(box)]
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_machine_code_writes_moments(monkeypatch: pytest.MonkeyPatch) -> None:
    box = spinning_box()
    p.stepSimulation()
    for k in (1, 2, 3):
        p.changeDynamics(box, -1, mass=k, localInertiaDiagonal=[0.1 * k] * 3)
    monkeypatch.setattr("roboyard.sim.link.Link.set_inertial", None)  # which the Python function calls
    p.changeDynamics(box, -1, mass=4, localInertiaDiagonal=[0.4] * 3)
    p.changeDynamics(box, -1, localInertiaDiagonal=[0.5] * 3)
    assert p.getDynamicsInfo(box, -1)[0] == 4.0
    assert p.getDynamicsInfo(box, -1)[2] == (0.5, 0.5, 0.5)
    p.changeDynamics(box, -1, mass=4)  # the same, but the moments become those of the shape again
    half = np.array([0.1, 0.2, 0.3])
    expected = 4.0 / 3.0 * (half @ half - half**2)
    np.testing.assert_allclose(p.getDynamicsInfo(box, -1)[2], expected, rtol=1e-12)
    world = CLIENTS[0].scene.world
    row = world.bodies[1].mujoco_ids[0]
    np.testing.assert_allclose(world.live_model.body_inertia[row], expected, rtol=1e-12)


@pytest.mark.parametrize("is_stale", [False, True])
def test_anchors_that_change_often_are_those_of_the_python_function(is_stale: bool) -> None:
    box = spinning_box()
    world: Any = CLIENTS[0].scene.world  # type: ignore[union-attr]
    p.stepSimulation()
    for turn in range(9):
        if is_stale and turn == 3:
            p.createMultiBody(1.0, basePosition=[0, 0, 5])
            assert world.is_stale
        for value in (1, 0, 2, 0.5, np.int64(turn % 2)):
            p.changeDynamics(box, -1, frictionAnchor=value)
        if turn % 4 == 3:
            p.stepSimulation()
            rows = CLIENTS[0].scene.bodies[box].body.links[0].geom_ids  # type: ignore[union-attr]
            assert world.surfaces.anchors[rows].tolist() == [turn % 2]
    state = CLIENTS[0].scene.bodies[box].links[0]  # type: ignore[union-attr]
    assert state.is_anchored is False
    p.changeDynamics(box, -1, frictionAnchor=-1)
    assert state.is_anchored is False
