"""performCollisionDetection many times between changes: contacts of spheres and planes, in a closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations
from math import dist

import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet.fast.steps import detection_entries

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
RADIUS = 0.2
TURNS = 60


@pytest.fixture
def passed_on(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[None]]:
    """A client whose command is machine code, and an item for each call that the Python function got."""
    assert FRONT.address()
    assert detection_entries.DETECTION.address()
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_detection()
    calls = list[None]()
    prepare = detection_entries.prepare

    def counted(scene: object) -> None:
        calls.append(None)
        prepare(scene)  # type: ignore[arg-type]

    monkeypatch.setattr(detection_entries, "prepare", counted)
    p.connect(p.DIRECT)
    yield calls
    for number in list(CLIENTS):
        p.disconnect(number)


def _expected(places: dict[int, tuple[float, float, float]], plane: int) -> dict[tuple[int, int], float]:
    """Return the gaps (m) of all pairs that overlap."""
    gaps = {(plane, body): at[2] - RADIUS for body, at in places.items()}
    for (a, at), (b, other) in combinations(places.items(), 2):
        gaps[min(a, b), max(a, b)] = dist(at, other) - 2 * RADIUS
    return {pair: gap for pair, gap in gaps.items() if gap < 0.0}


def _check(places: dict[int, tuple[float, float, float]], plane: int) -> None:
    found = {(min(row[1:3]), max(row[1:3])): row[8] for row in p.getContactPoints() if row[8] < 0.0}
    assert found == pytest.approx(_expected(places, plane), abs=1e-6)


def _sphere(place: tuple[float, float, float], mass: float = 1.0) -> int:
    return p.createMultiBody(mass, p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS), -1, place)


def _place(turn: int, k: int) -> tuple[float, float, float]:
    """Return where a body is: now near the others and the plane, now not."""
    return 0.3 * k + 0.01 * ((7 * turn + 3 * k) % 11), 0.0, 0.15 + 0.02 * ((5 * turn + k) % 9)


def _step_between(turn: int) -> None:
    if turn % 13 == 0:
        p.stepSimulation()


def _rules_between(turn: int) -> None:
    if turn % 17 == 0:
        p.setTimeStep(1 / (200 + turn))
    if turn % 19 == 0:
        p.setPhysicsEngineParameter(contactERP=0.1 + 0.001 * turn, numSolverIterations=20 + turn)


def _friction_between(turn: int) -> None:
    if turn % 11 == 0:
        p.changeDynamics(1, -1, lateralFriction=0.5 + 0.001 * turn, restitution=0.1, mass=1 + 0.01 * turn)


def _other_body_between(turn: int) -> None:
    if turn % 9 == 0:
        p.removeBody(_sphere((9, 9, 9)))
    if turn % 31 == 0:
        other = _sphere((9, 9, 9))
        p.performCollisionDetection()
        p.removeBody(other)


def _constraint_between(turn: int) -> None:
    if turn % 9 == 0:
        made = p.createConstraint(1, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1])
        if turn % 2:
            p.stepSimulation()
        p.removeConstraint(made)


@pytest.mark.parametrize(
    "between", [_step_between, _rules_between, _friction_between, _other_body_between, _constraint_between]
)
def test_contacts_are_those_of_the_present_places(
    passed_on: list[None], between: Callable[[int], None]
) -> None:
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    bodies = [_sphere((k, 0, 1)) for k in range(3)]
    p.stepSimulation()
    for turn in range(TURNS):
        between(turn)
        places = {body: _place(turn, k) for k, body in enumerate(bodies)}
        for body, at in places.items():
            p.resetBasePositionAndOrientation(body, at, [0, 0, 0, 1])
        p.performCollisionDetection()
        _check(places, plane)
    assert 0 < len(passed_on) < TURNS // 2, "most are made in machine code"


def test_links_that_were_moved_touch_where_they_are(passed_on: list[None]) -> None:
    ball = p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS)
    arm = p.createMultiBody(
        0, -1, -1, [0, 0, 1], linkMasses=[1], linkCollisionShapeIndices=[ball], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]], linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkJointTypes=[p.JOINT_PRISMATIC], linkJointAxis=[[1, 0, 0]],
    )  # fmt: skip
    other = p.createMultiBody(1, ball, -1, [1, 0, 1])
    p.stepSimulation()
    p.resetBasePositionAndOrientation(other, [1, 0, 1], [0, 0, 0, 1])
    for turn in range(TURNS):
        x = 0.5 + 0.01 * (turn % 30)
        p.resetJointState(arm, 0, x)
        p.performCollisionDetection()
        rows = [row for row in p.getContactPoints(arm, other) if row[8] < 0]
        gap = 1 - x - 2 * RADIUS
        assert [(row[3], row[8]) for row in rows] == ([(0, pytest.approx(gap, abs=1e-6))] if gap < 0 else [])
        assert p.getLinkState(arm, 0, computeForwardKinematics=1)[0] == pytest.approx((x, 0, 1), abs=1e-6)
        if turn % 20 == 19:
            p.setCollisionFilterPair(arm, other, 0, -1, 0)
            p.performCollisionDetection()
            assert p.getContactPoints(arm, other) == ()
            p.setCollisionFilterPair(arm, other, 0, -1, 1)
    assert len(passed_on) < TURNS // 2
