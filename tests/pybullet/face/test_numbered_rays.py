"""Hits by number that a compiled loop finds are those of the search from surface to surface."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.api import raycasts
from roboyard.pybullet.bullet_rules import ray_starts
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands, ray_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(autouse=True)
def _world(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert ray_entries.RAYS.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(getDataPath())
    p.loadURDF("plane.urdf")
    p.loadURDF("r2d2.urdf", [0, 0, 0.6], [0.1, 0.2, 0.3, 0.9])
    p.loadURDF("kuka_iiwa/model.urdf", [0.5, 0, 0], useFixedBase=True)
    shapes = [
        p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3]),
        p.createCollisionShape(p.GEOM_SPHERE, radius=0.2),
        p.createCollisionShape(p.GEOM_CAPSULE, radius=0.1, height=0.4),
    ]
    for k, shape in enumerate((*shapes, *shapes)):
        p.createMultiBody(1, shape, -1, [0.3 * k - 0.5, 0.1 * k, 0.8], [0.1, 0.5, 0.2, 0.8])
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def rays() -> list[tuple[list[float], list[float]]]:
    draw = random.Random(4)

    def point() -> list[float]:
        return [draw.uniform(-1, 1.5), draw.uniform(-1, 1), draw.uniform(0.05, 1.5)]

    found = [(point(), point()) for _ in range(60)]
    centres = [list(p.getBasePositionAndOrientation(body)[0]) for body in range(3, 9)]
    return [
        *found,
        *((centre, point()) for centre in centres),
        *((point(), centre) for centre in centres),
        ([0, 0, 1], [0, 0, 1]),
        ([0, 0, float("nan")], [0, 0, 1]),
        ([0, 0, 9], [0, 0, -9]),
    ]


@pytest.mark.parametrize("mask", [-1, 3, 8])
def test_hits_are_those_of_the_search(mask: int) -> None:
    if mask != -1:
        p.setCollisionFilterGroupMask(3, -1, 8, 255)
        p.setCollisionFilterGroupMask(1, 3, 8, 255)
    given, scene = rays(), CLIENTS[0].scene  # type: ignore[union-attr]
    starts, ends = [ray[0] for ray in given], [ray[1] for ray in given]
    some = 0
    for wanted in (*range(5), 40):
        batch = p.rayTestBatch(starts, ends, reportHitNumber=wanted, collisionFilterMask=mask)
        for (start, end), one in zip(given, batch, strict=True):
            if mask == -1:
                p.resetJointState(2, 3, 0.1)
            (alone,) = p.rayTest(start, end, mask, wanted)
            expected = raycasts._numbered_hit(scene, tuple(start), tuple(end), mask, wanted)
            some += expected[0] >= 0
            for found in (alone, one if mask != -1 else alone):
                assert found[:2] == expected[:2]
                np.testing.assert_allclose(found[2], expected[2], rtol=0, atol=1e-12)
                np.testing.assert_allclose(found[3:], expected[3:], rtol=0, atol=1e-9)
    assert some > (2 if mask == 8 else 50)


def test_more_hits_than_there_is_memory_for_are_found_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    ray: Any = ([0, 0, 9], [0, 0, -9])
    expected = [p.rayTest(*ray, reportHitNumber=k) for k in range(6)]
    monkeypatch.setattr(ray_starts, "MOST_HITS", 2)
    p.createMultiBody(1, basePosition=[9, 9, 9])
    assert [p.rayTest(*ray, reportHitNumber=k) for k in range(6)] == expected


def test_machine_code_finds_hits(monkeypatch: pytest.MonkeyPatch) -> None:
    ray: Any = ([0, 0, 9], [0, 0, -9])
    expected = [p.rayTest(*ray, reportHitNumber=k) for k in range(4)]
    first = p.rayTest(*ray)
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    monkeypatch.setattr(scene, "bodies", None)  # which the Python function reads
    assert [p.rayTest(*ray, reportHitNumber=k) for k in range(4)] == expected
    assert p.rayTestBatch([ray[0]] * 2, [ray[1]] * 2, reportHitNumber=1) == 2 * expected[1]
    assert p.rayTest(*ray, -1, -1) == first


def test_rays_with_masks_follow_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    draw = random.Random(5)
    scene: Any = CLIENTS[0].scene  # type: ignore[union-attr]
    starts, ends = [list(points) for points in zip(*rays()[:20], strict=True)]
    hit = 0
    for turn in range(60):
        if turn % 5 == 4:
            link = (draw.randrange(1, 9), -1)
            p.setCollisionFilterGroupMask(*link, draw.choice([0, 1, 4, 6]), draw.choice([1, 7]))
        if turn == 30:
            p.removeBody(8)
        mask, wanted = draw.choice([-1, 1, 4, 6, 0, -2, 2**31 - 1]), draw.choice([-1, -1, 0])
        for _ in range(3):
            batch = p.rayTestBatch(starts, ends, collisionFilterMask=mask, reportHitNumber=wanted)
            alone = [p.rayTest(*ray, mask, wanted)[0] for ray in zip(starts, ends, strict=True)]
        expected = raycasts.rayTestBatch(
            CLIENTS[0],  # type: ignore[arg-type]
            *(starts, ends),
            collisionFilterMask=mask,
            reportHitNumber=wanted,
        )
        assert list(batch) == alone == list(expected), turn
        hit += sum(body >= 0 for body, *_ in batch)
    assert hit > 100
    p.rayTestBatch(starts, ends, collisionFilterMask=1)
    monkeypatch.setattr(scene, "bodies", None)  # which the Python function reads
    p.rayTestBatch(starts, ends, collisionFilterMask=1)
