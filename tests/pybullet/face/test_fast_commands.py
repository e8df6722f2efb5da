"""Commands that are machine code as a whole agree with their Python functions in all states of a world."""

from __future__ import annotations

import gc
import sys
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
from roboyard.pybullet.fast import fast_commands, fast_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(scope="module", autouse=True)
def _machine_code() -> None:
    assert all(front.address() for front in (FRONT, fast_entries.PUSH, fast_entries.BOX))
    direct_calls.START.enter()
    fast_commands.replace_pushes(False)
    fast_commands.replace_boxes(False)


@pytest.fixture
def robot() -> Iterator[int]:
    assert p.connect(p.DIRECT) == 0
    p.setGravity(0, 0, -9.8)
    p.loadURDF(f"{getDataPath()}/plane.urdf")
    yield p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9])
    p.disconnect()


def python(name: str, *given: Any) -> Any:
    return COMMANDS[name].function(CLIENTS[0], *given)


def forces() -> np.ndarray:
    data = CLIENTS[0].scene.world.live_data  # type: ignore[union-attr]
    found = data.xfrc_applied.copy()
    data.xfrc_applied[:] = 0.0
    return found


PUSHES: list[tuple[str, tuple[Any, ...]]] = [
    (name, (link, *vectors, frame))
    for link in (-1, 0, 3, 7)
    for frame in (p.LINK_FRAME, p.WORLD_FRAME)
    for name, vectors in (
        ("applyExternalForce", ([1.0, -2.0, 3], [0.1, 0.2, 0.3])),
        ("applyExternalForce", ((0, 0, 1), np.array([0.5, 0.0, 0.1]))),
        ("applyExternalTorque", ([0.3, 0.2, -0.1],)),
    )
]


@pytest.mark.parametrize(("name", "given"), PUSHES)
def test_pushes_are_those_of_the_python_function(robot: int, name: str, given: tuple[Any, ...]) -> None:
    expected = np.zeros(0)
    for moves in (
        p.stepSimulation,
        lambda: p.getLinkState(robot, 2),
        lambda: p.resetBasePositionAndOrientation(robot, [1, 0, 2], [0, 0.6, 0, 0.8]),
        lambda: p.resetJointState(robot, 1, 0.4),
        lambda: p.getLinkState(robot, 2, computeForwardKinematics=1),
        lambda: p.createMultiBody(1.0),
        lambda: p.removeBody(p.getBodyUniqueId(p.getNumBodies() - 1)),
    ):
        moves()
        for _ in range(2):
            python(name, robot, *given)
            expected = forces()
            getattr(p, name)(robot, *given)
            np.testing.assert_array_equal(forces(), expected)
            getattr(p, name)(robot, *given[:-1], flags=given[-1], physicsClientId=0)
            np.testing.assert_array_equal(forces(), expected)
    assert expected.any()


def test_pushed_bodies_move_with_the_next_step_alone(robot: int) -> None:
    p.setGravity(0, 0, 0)
    for _ in range(3):
        before = p.getBaseVelocity(robot)[0][0]
        p.applyExternalForce(robot, -1, [100, 0, 0], [0, 0, 0], p.LINK_FRAME)
        p.stepSimulation()
        between = p.getBaseVelocity(robot)[0][0]
        p.stepSimulation()
        assert between > before + 1e-3
        assert p.getBaseVelocity(robot)[0][0] == pytest.approx(between, rel=0.02)


@pytest.mark.parametrize(
    "given",
    [
        (99, -1, [0, 0, 1], [0, 0, 0], 1),
        (1, 99, [0, 0, 1], [0, 0, 0], 1),
        (1, -2, [0, 0, 1], [0, 0, 0], 1),
        (1, -1, [0, 0, 1], [0, 0, 0], 3),
        (1, -1, [0, 0, 1], [0, 0, 0], 1.0),
        (1, 0.0, [0, 0, 1], [0, 0, 0], 1),
        (1, -1, [0, 0], [0, 0, 0], 1),
        (1, -1, [0, 0, "1"], [0, 0, 0], 1),
        (1, -1, "123", [0, 0, 0], 1),
        (1, -1, [0, 0, float("inf")], [0, 0, 0], 1),
        (1, -1, [0, 0, 1], None, 1),
        ([1], -1, [0, 0, 1], [0, 0, 0], 1),
        (1, -1, [0, 0, 1]),
    ],
)
def test_irregular_pushes_have_the_same_outcome(robot: int, given: tuple[Any, ...]) -> None:
    p.applyExternalForce(robot, -1, [0, 0, 1], [0, 0, 0], 1)
    forces()

    def outcome(call: Any) -> Any:
        try:
            call(*given)
        except Exception as problem:
            return type(problem).__mro__[-3:], str(problem), forces().tolist()
        return forces().tolist()

    assert outcome(p.applyExternalForce) == outcome(p.applyExternalForce.__self__)


def test_boxes_are_those_of_the_python_function(robot: int) -> None:
    for moves in (
        p.stepSimulation,
        lambda: p.resetBasePositionAndOrientation(robot, [1, 0, 2], [0, 0.6, 0, 0.8]),
        lambda: p.changeDynamics(robot, 3, collisionMargin=0.3),
        lambda: p.createMultiBody(1.0),
        p.stepSimulation,
    ):
        moves()
        for link in (-1, 0, 3, 3, 8):
            for body in (0, robot):
                if body or link == -1:
                    expected = python("getAABB", body, link)
                    assert p.getAABB(body, link) == p.getAABB(body, link, physicsClientId=0) == expected
        assert p.getAABB(robot) == python("getAABB", robot)
    for wrong in ((robot, 99), (robot, -2), (robot, 1.0), (99,), (-1,), ("a",)):
        with pytest.raises((TypeError, p.error)):
            p.getAABB(*wrong)


def test_bodies_of_another_world_are_not_mistaken(robot: int) -> None:
    p.stepSimulation()
    box, expected = p.getAABB(robot), []
    p.resetSimulation()
    shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5)
    bodies = [p.createMultiBody(1.0, shape, basePosition=[k, 0, 0]) for k in range(2)]
    expected = [python("getAABB", body) for body in bodies]
    assert [p.getAABB(body) for body in bodies] == expected
    assert box not in expected
    other = p.connect(p.DIRECT)
    with pytest.raises(p.error):
        p.getAABB(bodies[0], physicsClientId=other)
    p.disconnect(other)


def test_objects_are_released(robot: int) -> None:
    p.stepSimulation()
    vector, scene = [0.25, 1.5, 2.5], CLIENTS[0].scene  # type: ignore[union-attr]
    counts = []
    for _ in range(3):
        for _ in range(200):
            p.applyExternalForce(robot, -1, vector, vector, p.LINK_FRAME)
            p.applyExternalTorque(robot, 2, vector, p.LINK_FRAME)
            p.getAABB(robot, 2)
        gc.collect()
        counts.append([sys.getrefcount(one) for one in (vector, scene, scene.world, scene.world.wrenches)])
    assert counts[0] == counts[1] == counts[2]
