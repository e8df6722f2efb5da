"""Closest points that machine code lists are those of the Python function."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet.fast.closest import entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture
def bodies(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    assert FRONT.address()
    assert entries.CLOSEST.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_closest()
    p.connect(p.DIRECT)
    p.setAdditionalSearchPath(getDataPath())
    found = [p.loadURDF("plane.urdf"), p.loadURDF("r2d2.urdf", [0, 0, 0.6])]
    found.append(p.loadURDF("kuka_iiwa/model.urdf", [0.5, 0, 0], [0, 0, 0.6, 0.8], useFixedBase=True))
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    found += [p.createMultiBody(1, box, -1, [1.0, 0.2 * k, 0.8], [0.1, 0.5, 0.2, 0.8]) for k in range(2)]
    found.append(p.createMultiBody(1))
    yield found
    for number in list(CLIENTS):
        p.disconnect(number)


CALLS: list[tuple[Any, ...]] = [
    (0.7,),
    (5,),
    (0.0,),
    (-0.01,),
    (0.7, -1),
    (0.7, 3),
    (0.7, -2, -1),
    (0.7, 6, 3),
    (0.7, 99),
    (0.7, np.int64(6), np.int32(3)),
    (0.7, np.float64(6), -1),
    (0.7, np.uint8(6), True),
    (0.7, -3, -2),
    (0.7, -1.0),
    (float("nan"),),
    ("0.7",),
    (None,),
    (),
]


def outcome(call: Any, *given: Any) -> Any:
    try:
        return call(*given)
    except Exception as problem:
        return type(problem), str(problem)


@pytest.mark.parametrize("given", CALLS)
def test_points_are_those_of_the_python_function(bodies: list[int], given: tuple[Any, ...]) -> None:
    def change_margin() -> None:
        p.changeDynamics(bodies[3], -1, collisionMargin=0.02)

    edits = (
        p.stepSimulation,
        lambda: p.resetJointState(bodies[2], 1, 0.4),
        lambda: p.resetBasePositionAndOrientation(bodies[3], [0.9, 0.1, 0.7], [0, 0.6, 0, 0.8]),
        lambda: p.removeBody(p.createMultiBody(1.0)),
        change_margin,
        lambda: p.removeBody(bodies[4]),
    )
    some = 0
    for edit in edits:
        for a in (*bodies, 99, -1, 1.0, np.int64(bodies[2])):
            for b in (bodies[0], *bodies[2:4], True):
                answers = []
                for is_python in (False, False, True):
                    edit()
                    p.resetJointState(bodies[2], 1, 0.3 if edit is p.stepSimulation else 0.2)
                    call = p.getClosestPoints.__self__ if is_python else p.getClosestPoints
                    answers.append(repr(outcome(call, a, b, *given)))
                if edit is not p.stepSimulation:  # which moves
                    assert answers[0] == answers[1] == answers[2]
                    some += answers[0] != "()"
    assert some


def test_machine_code_finds_points(bodies: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    p.getClosestPoints(bodies[3], bodies[2], 5)
    p.getClosestPoints(bodies[3], bodies[2], 5, -1, 6)
    p.getClosestPoints(bodies[3], bodies[4], 5, linkIndexB=-1)
    p.resetBasePositionAndOrientation(bodies[3], [1, 0, 2], [0, 0, 0, 1])
    p.resetBasePositionAndOrientation(bodies[4], [1, 0, 3], [0, 0, 0, 1])
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python function reads
    ((*_, on_a, on_b, normal, distance, force, _, _, _, _),) = p.getClosestPoints(
        bodies[3], bodies[4], 5, linkIndexB=-1
    )
    assert (on_a[2], on_b[2], distance) == pytest.approx((2.3, 2.7, 0.4), abs=1e-6)
    np.testing.assert_allclose(normal, [0, 0, -1], rtol=0, atol=1e-6)
    assert force == 0.0
    assert len(p.getClosestPoints(bodies[3], bodies[2], 5)) > 5
    of_numpy: Any = np.int64(bodies[3]), np.int32(bodies[2]), 5, np.int64(-1), np.int32(6)
    (point,) = p.getClosestPoints(*of_numpy)
    assert point == p.getClosestPoints(*map(int, of_numpy))[0]
    assert [type(number) for number in point[:5]] == [int] * 5


def test_machine_code_finds_points_beside_terrain(bodies: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    def distances() -> list[float]:
        return [row[8] for row in p.getClosestPoints(bodies[3], bodies[2], 5)]

    before = distances()
    assert len(before) > 5
    heights = [0.01 * (k % 7) for k in range(64)]
    field: dict[str, Any] = {"heightfieldData": heights, "numHeightfieldRows": 8, "numHeightfieldColumns": 8}
    shape = p.createCollisionShape(p.GEOM_HEIGHTFIELD, meshScale=[0.1, 0.1, 1], **field)
    ground = p.createMultiBody(0, shape, -1, [1, 6, 0])
    np.testing.assert_allclose(distances(), before, rtol=0, atol=1e-12)
    on_ground = p.getClosestPoints(bodies[3], ground, 10)
    assert len(on_ground) == 2 * 7 * 7
    assert p.getClosestPoints(bodies[3], ground, 10) == on_ground
    (nearest,) = (row for row in on_ground if row[8] == min(row[8] for row in on_ground))
    apart = np.subtract(nearest[5], nearest[6])
    np.testing.assert_allclose(np.array(nearest[7]) * nearest[8], apart, rtol=0, atol=1e-9)
    client: Any = CLIENTS[0]
    monkeypatch.setattr(client.scene, "bodies", None)  # which the Python function reads
    np.testing.assert_allclose(distances(), before, rtol=0, atol=1e-12)


POSES: list[tuple[Any, Any]] = [
    (None, None),
    ([1, 0, 1.2], None),
    ((0.5, np.float64(0.2), 1), [0, 0, 0.6, 0.8]),
    (np.array([0, 0, 1.0]), np.array([0.1, 0.2, 0.3, 2.0])),
    ([0, 0, 1], (0, 0, 0, 0)),
    ([0, 0, float("nan")], None),
    ([0, 0], None),
    ([0, 0, 1], "abcd"),
    (1.0, None),
]


@pytest.mark.parametrize("pose", POSES, ids=repr)
def test_points_of_shapes_are_those_of_the_python_function(bodies: list[int], pose: tuple[Any, Any]) -> None:
    box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.2, 0.3])
    two = p.createCollisionShapeArray(
        [p.GEOM_SPHERE] * 2, radii=[0.1, 0.2], collisionFramePositions=[[0, 0, 0], [0, 0, 0.5]]
    )
    position, turn = pose

    def change_margin() -> None:
        p.changeDynamics(bodies[3], -1, collisionMargin=0.02)

    def change_shape() -> None:
        nonlocal two
        p.removeCollisionShape(two)
        two = p.createCollisionShape(p.GEOM_SPHERE, radius=0.15)

    edits = (
        lambda: None,
        lambda: p.resetJointState(bodies[2], 1, 0.4),
        lambda: p.resetBasePositionAndOrientation(bodies[3], [0.9, 0.1, 0.7], [0, 0.6, 0, 0.8]),
        change_margin,
        lambda: p.createMultiBody(1.0, basePosition=[0, 0, 30]),
        change_shape,
        lambda: p.removeBody(bodies[4]),
        lambda: p.removeCollisionShape(two),
    )
    some = 0
    for edit in edits:
        edit()
        sides: list[Any] = [(box, two), (two, box), (two, two), (box, 77), (-1, two), (box, -1), (True, box)]
        sides.append((np.int64(box), two))
        for a, b in sides:
            for body in (bodies[2], bodies[3], bodies[4], 99, -1):
                for link in (-2, -1, 3):
                    given: Any = (body, body, 5.0, link, link, a, b, position, position, turn, turn)
                    answers = [repr(outcome(p.getClosestPoints, *given[: 11 - k % 2])) for k in range(7)]
                    expected = [
                        repr(outcome(p.getClosestPoints.__self__, *given[: 11 - k % 2])) for k in range(2)
                    ]
                    assert answers[-2:] == expected[1:] + expected[:1]
                    some += expected[0].startswith("((0")
    assert bool(some) == any(pose is one for one in POSES[:4])


def test_points_of_shapes_follow_poses(bodies: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
    p.resetBasePositionAndOrientation(bodies[3], [0, 0, 10], [0, 0, 0, 1])
    found = []
    for k in range(12):
        if k == 8:
            client: Any = CLIENTS[0]
            monkeypatch.setattr(client.scene.shapes, "_query_shapes", None)  # which the Python function reads
        for height in (12.0, 13.0):
            ((*_, distance, _, _, _, _, _),) = p.getClosestPoints(
                bodies[3], -1, 9, -1, collisionShapeB=ball, collisionShapePositionB=[0, 0, height]
            )
            found.append(distance)
        if k == 5:
            p.resetBasePositionAndOrientation(bodies[3], [0, 0, 9.5], [0, 0, 0, 1])
    np.testing.assert_allclose(np.diff(found[:12]), [1, -1] * 5 + [1], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found[12:], np.tile(found[:2], 6) + 0.5, rtol=0, atol=1e-6)
