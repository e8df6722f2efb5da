"""Velocities of bases that machine code reads are those of the Python function, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import base_entries, fast_commands
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture
def bodies(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    assert FRONT.address()
    assert base_entries.VELOCITY.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8)
    data, box = getDataPath(), p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    yield [
        p.loadURDF(f"{data}/plane.urdf"),
        p.loadURDF(f"{data}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9]),
        p.loadURDF(f"{data}/kuka_iiwa/model.urdf", [2, 0, 0], useFixedBase=True),
        p.createMultiBody(1, box, -1, [4, 0, 1], baseInertialFramePosition=[0.1, 0.05, 0.02]),
        p.createMultiBody(0, box, -1, [6, 0, 1]),
    ]
    for number in list(CLIENTS):
        p.disconnect(number)


def outcome(call: Any, *given: Any) -> Any:
    try:
        return call(*given)
    except Exception as problem:
        return type(problem), str(problem)


def test_velocities_are_those_of_the_python_function(bodies: list[int]) -> None:
    for body in bodies[1:4:2]:
        p.resetBaseVelocity(body, [0.1, 0.2, 0.3], [1.0, -2.0, 0.5])
    edits = (
        p.stepSimulation,
        lambda: p.resetBaseVelocity(bodies[3], [1, 2, 3], [0.3, 0.2, 0.1]),
        lambda: p.resetBasePositionAndOrientation(bodies[1], [0, 0, 2], [0, 0.6, 0, 0.8]),
        lambda: p.removeBody(p.createMultiBody(1.0)),
        lambda: p.changeDynamics(bodies[4], -1, mass=1.0),
        lambda: p.resetBaseVelocity(bodies[2], [0.5, 0, 0]),
        p.stepSimulation,
        lambda: p.removeBody(bodies[3]),
    )
    for edit in edits:
        edit()
        for _ in range(3):
            for body in (*bodies, 99, -1, "a", 1.0):
                expected = outcome(COMMANDS["getBaseVelocity"].function, CLIENTS[0], body)
                assert repr(outcome(p.getBaseVelocity, body)) == repr(
                    expected if type(expected[0]) is not type else outcome(p.getBaseVelocity.__self__, body)
                )
    assert any(p.getBaseVelocity(bodies[1])[1])


def test_machine_code_reads_velocities(bodies: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    for _ in range(3):
        for body in bodies:
            p.getBaseVelocity(body)
    p.resetBasePositionAndOrientation(bodies[3], [4, 0, 1], [0, 0, 0.6, 0.8])
    p.resetBaseVelocity(bodies[3], [1, 2, 3], [0.3, 0.2, 0.1])
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    monkeypatch.setattr(scene, "bodies", None)  # which the Python function reads
    linear, angular = p.getBaseVelocity(bodies[3])
    np.testing.assert_allclose(linear, [1, 2, 3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(angular, [0.3, 0.2, 0.1], rtol=0, atol=1e-12)
    assert p.getBaseVelocity(bodies[2]) == ((0, 0, 0), (0, 0, 0))
