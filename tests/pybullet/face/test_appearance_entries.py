"""Looks that machine code changes, and dynamics that it reads, are those of the Python functions."""

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
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import appearance_entries, dynamics_entries, fast_commands
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    fronts = FRONT, appearance_entries.APPEARANCE, dynamics_entries.INFO
    assert all(front.address() for front in fronts)
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_appearance()
    fast_commands.replace_dynamics_info()
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def world() -> tuple[Any, list[int]]:
    """Return a client's scene with a box, a robot and two textures."""
    p.connect(p.DIRECT)
    client: Any = CLIENTS[0]
    shapes = p.createVisualShapeArray(
        [p.GEOM_BOX, p.GEOM_SPHERE], halfExtents=[[0.1] * 3] * 2, radii=[0.1] * 2
    )
    body = p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), shapes)
    robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [1, 0, 1])
    for value in (1, 2):
        client.scene.textures.add(np.full((1, 1, 4), value, np.uint8))
    return client.scene, [body, robot]


def looks(scene: Any, bodies: list[int]) -> Any:
    """Return colours, specular shares and textures of all shapes, and colours that scripts read."""
    found: list[Any] = []
    for number in bodies:
        record = scene.bodies[number]
        for link, shapes in scene.world.render_shapes.of(record.body).items():
            for one in shapes:
                texture = None if one.shape.texture is None else one.shape.texture.tolist()
                found.append((link, one.shape.rgba, one.shape.specular, texture))
        found.append(p.getVisualShapeData.__self__(number, p.VISUAL_SHAPE_DATA_TEXTURE_UNIQUE_IDS))
    return found


COLORS: list[Any] = [
    None,
    [1, 0, 0, 1],
    (0, 0.5, 1.0, 0.5),
    np.array([0.1, 0.2, 0.3, 1]),
    [1, 0, 0],
    [1, 2, 3, "4"],
]
SPECULARS: list[Any] = [None, None, [0.1, 0.2, 0.4], (1, 1, 1), np.zeros(3), [1, 2], 5, [None, 1, 2]]


@pytest.mark.parametrize("name", ["changeVisualShape", "resetVisualShapeData"])
def test_looks_are_those_of_the_python_function(name: str) -> None:
    outcomes: list[Any] = []
    for is_python in (False, True):
        scene, bodies = world()
        draw = random.Random(3)
        call = getattr(p, name).__self__ if is_python else getattr(p, name)
        for step in range(300):
            given: list[Any] = [draw.choice([*bodies, 9]), draw.choice([-1, 0, 2, 99, -2])]
            given += [draw.choice([-1, -1, 0, 1, 7, -3]), draw.choice([-2, -2, -1, 0, 1, 55])]
            given += [draw.choice(COLORS), draw.choice(SPECULARS), draw.choice([-1, 0])]
            try:
                outcomes.append(call(*given[: draw.choice([2, 3, 4, 5, 6, 7])]))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
            if step % 5 == 0:
                outcomes.append(looks(scene, bodies))
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])


def test_dynamics_that_are_read_are_those_of_the_python_function() -> None:
    outcomes: list[Any] = []
    for is_python in (False, True):
        _, bodies = world()
        draw = random.Random(4)
        call = p.getDynamicsInfo.__self__ if is_python else p.getDynamicsInfo
        for _ in range(300):
            body, link = (
                draw.choice([*bodies, 9, -1, 0.5, True, None]),
                draw.choice([-1, 0, 3, -2, 99, "0", 1.0]),
            )
            change = {
                "mass": draw.choice([0.5, 0, 2]),
                "lateralFriction": draw.random(),
                "collisionMargin": draw.choice([0.01, 0.02]),
                "contactStiffness": draw.choice([-1.0, 100.0]),
            }
            change["contactDamping"] = change["contactStiffness"]
            p.changeDynamics(draw.choice(bodies), draw.choice([-1, 2]), **change)
            try:
                outcomes.append(call(body, link))
            except Exception as problem:
                outcomes.append((type(problem), str(problem)))
        p.disconnect()
    half = len(outcomes) // 2
    assert repr(outcomes[:half]) == repr(outcomes[half:])
