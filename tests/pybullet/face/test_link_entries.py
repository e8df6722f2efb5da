"""Link states that machine code reads are those of the Python functions, and leave the same frames."""

from __future__ import annotations

import random
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
from roboyard.pybullet.fast import fast_commands, link_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert link_entries.LINKS.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def outcome(call: Any, *given: Any) -> Any:
    try:
        return call(*given)
    except Exception as problem:
        return type(problem), str(problem).partition("\n")[0]


def build(number: int) -> None:
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.8, physicsClientId=number)
    data = getDataPath()
    p.loadURDF(f"{data}/plane.urdf", physicsClientId=number)
    p.loadURDF(f"{data}/r2d2.urdf", [0, 0, 1], [0.1, 0.2, 0.3, 0.9], physicsClientId=number)
    p.loadURDF(f"{data}/kuka_iiwa/model.urdf", [2, 0, 0], useFixedBase=True, physicsClientId=number)


@pytest.mark.parametrize("seed", range(4))
def test_states_are_those_of_the_python_functions(seed: int) -> None:
    draw = random.Random(seed)
    for number in (0, 1):
        build(number)
    scenes: Any = [CLIENTS[number].scene for number in (0, 1)]  # type: ignore[union-attr]

    def edit() -> None:
        kind, value = draw.randrange(9), draw.random()
        for number in (0, 1):
            of = {"physicsClientId": number}
            if kind < 3:
                p.stepSimulation(**of)
            elif kind < 5:
                p.resetJointState(2, 3, value, 0.5, **of)
            elif kind == 5:
                p.resetBasePositionAndOrientation(1, [0, value, 2], [0, 0.6, 0, 0.8], **of)
            elif kind == 6:
                p.resetBasePositionAndOrientation(2, [2, value, 0], [0, 0.6, 0, 0.8], **of)
            elif kind == 7:
                p.getAABB(2, 3, **of)
            else:
                p.removeBody(p.createMultiBody(1.0, **of), **of)
                p.getNumBodies(**of)

    for _ in range(250):
        if draw.random() < 0.5:
            edit()
        body = draw.choice([1, 2, 2, 0, 99])
        flags = [draw.choice([0, 1, True, False, 2]) for _ in range(draw.randrange(3))]
        if draw.random() < 0.6:
            name, links = "getLinkState", draw.choice([0, 3, 6, np.int64(2), -1, 99, 1.0])
        else:
            name = "getLinkStates"
            links = draw.choice(
                [[0, 3], range(7), (6,), np.arange(3), [2, 99], [-1], [], "12", [1.0], 3, [3, 3]]
            )
        function = COMMANDS[name].function
        found = outcome(getattr(p, name), body, links, *flags)
        expected = outcome(function, CLIENTS[1], body, links, *flags)
        if found and type(found[0]) is type:
            assert type(expected[0]) is type
        else:
            assert repr(found) == repr(expected)
        kept = [
            (scene.frames_are_old, scene.single_reads, scene.world.kept_frames is None, scene.world.is_moved)
            for scene in scenes
        ]
        assert kept[0] == kept[1]


def test_machine_code_reads_links(monkeypatch: pytest.MonkeyPatch) -> None:
    build(0)
    p.stepSimulation()
    expected: Any = [p.getLinkStates(2, [0, 6], 1) for _ in range(3)][-1]
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    p.resetJointState(2, 1, 0.5)
    monkeypatch.setattr(scene, "bodies", None)  # which the Python functions read
    moved = p.getLinkState(2, 6)
    for found in (
        p.getLinkStates(2, [0, 6], computeLinkVelocity=True)[1],
        p.getLinkStates(2, [0, 6], computeForwardKinematics=1)[1],
        p.getLinkState(2, 6, 1),
    ):
        assert len(found) in (6, 8)
        for one, other in zip(found, moved, strict=False):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-9)
    assert np.abs(np.subtract(moved[0], expected[1][0])).max() > 0.1
