"""Constraints that machine code requests: those of the Python function, errors included."""

from __future__ import annotations

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
from roboyard.pybullet.fast.constraints import creation, reads
from roboyard.pybullet.fast.properties import entries as property_entries
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
ZERO, AXIS = [0, 0, 0], (0, 1, 0)
FIXED, POINT, SLIDE, GEAR = p.JOINT_FIXED, p.JOINT_POINT2POINT, p.JOINT_PRISMATIC, p.JOINT_GEAR
REQUESTED = [
    (0, -1, -1, -1, FIXED, ZERO, ZERO, [0, 0, 1]),
    (0, 2, 1, -1, POINT, ZERO, (0.1, 0, 0), np.array([0, 0, 0.2])),
    (0, 2, -1, -1, FIXED, np.zeros(3), [np.float64(0.1), 0, np.float32(0.5)], ZERO, [0, 0, 0, 1], None),
    (1, -1, -1, -1, SLIDE, AXIS, ZERO, [2, 0, 1]),
    (1, -1, 0, 3, SLIDE, np.array([0.3, 0.1, -1.0]), ZERO, ZERO, np.array([0, 0, 0, 2.0]), (0, 0, 1, 0)),
    (0, 2, 0, 3, GEAR, AXIS, ZERO, ZERO),
]
REFUSED = [
    (1, -1, -1, -1, SLIDE, ZERO, ZERO, ZERO),
    (1, -1, -1, -1, SLIDE, [0, 0, float("nan")], ZERO, ZERO),
    (1, -1, -1, -1, SLIDE, [0, 1], ZERO, ZERO),
    (0, -1, 0, 3, GEAR, AXIS, ZERO, ZERO),
    (0, 0, 0, 3, GEAR, AXIS, ZERO, ZERO),  # a fixed joint
    (0, 2, 0, 99, GEAR, AXIS, ZERO, ZERO),
    (0, 2, -1, -1, GEAR, AXIS, ZERO, ZERO),
    (7, -1, -1, -1, FIXED, ZERO, ZERO, ZERO),
    (0, -1, -1, -1, 4, ZERO, ZERO, [0, 0, float("inf")]),
    (0, -1, -1, -1, FIXED, ZERO, "abc", ZERO),
]


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    fronts = creation.CREATION, creation.REMOVAL, reads.STATE, reads.INFO, reads.COUNT, reads.NUMBER
    assert all(front.address() for front in (*fronts, property_entries.PROPERTIES))
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    fast_commands.replace_constraints()
    fast_commands.replace_constraint_reads()
    constraints.replace_changes()
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def outcome(given: tuple[Any, ...], *, is_python: bool) -> tuple[bool, Any]:
    """Return whether the constraint was requested, and what scripts see of it."""
    p.connect(p.DIRECT)
    p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1])
    p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [2, 0, 1])
    call = p.createConstraint.__self__ if is_python else p.createConstraint
    scene: Any = CLIENTS[0].scene
    try:
        made = call(*given)
        is_requested, info = made in scene.requested, p.getConstraintInfo.__self__(made)
        for _ in range(3):
            p.stepSimulation()
        seen: Any = made, info, p.getConstraintState(made), p.getBasePositionAndOrientation(1)
    except Exception as problem:
        is_requested, seen = False, (type(problem), str(problem), p.getNumConstraints())
    p.disconnect()
    return is_requested, seen


@pytest.mark.parametrize("given", [*REQUESTED, *REFUSED], ids=repr)
def test_constraints_are_those_of_the_python_function(given: tuple[Any, ...]) -> None:
    ours, theirs = (outcome(given, is_python=is_python) for is_python in (False, True))
    assert ours[0] == any(given is one for one in REQUESTED)
    assert repr(ours[1]) == repr(theirs[1])


CHANGED: list[dict[str, Any]] = [
    {"maxForce": 20},
    {"jointChildPivot": [0, 0.1, np.float32(1.5)], "maxForce": 0},
    {"jointChildFrameOrientation": (0, 0, 2, 0)},
    {"jointChildPivot": (0.1, 0, 0.9), "jointChildFrameOrientation": np.array([0.1, 0.2, 0.3, 0.9])},
    {"jointChildFrameOrientation": [0, 0, 0, 0]},
    {"gearRatio": -1.5, "maxForce": 100},
    {"gearRatio": 2, "erp": 0.1, "relativePositionTarget": -0.3},
    {"gearRatio": 0.5, "erp": 0},
]
BUILT: list[dict[str, Any]] = [
    {"gearRatio": 0},
    {"erp": 0.2, "maxForce": -1},
    {"relativePositionTarget": 2e32, "maxForce": -2},
]
"""Numbers that change nothing, which the Python function knows."""


def changed_outcome(given: tuple[Any, ...], change: dict[str, Any], *, is_python: bool) -> Any:
    """Return whether a changed constraint was only requested, and what scripts see of it."""
    p.connect(p.DIRECT)
    robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1])
    p.createMultiBody(1.0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1] * 3), -1, [2, 0, 1])
    call: Any = (lambda name: getattr(p, name).__self__) if is_python else (lambda name: getattr(p, name))
    scene: Any = CLIENTS[0].scene
    made = [call("createConstraint")(*given), call("createConstraint")(*REQUESTED[0])]
    call("changeConstraint")(made[0], **change)
    is_requested = made[0] in scene.requested
    seen = [call("getNumConstraints")(), call("getConstraintUniqueId")(1), call("getConstraintUniqueId")(2)]
    seen += [call("getConstraintInfo")(made[0]), call("getConstraintState")(made[0])]
    p.setJointMotorControl2(robot, 2, p.VELOCITY_CONTROL, targetVelocity=5, force=20)
    for _ in range(5):
        p.stepSimulation()
    seen += [call("getConstraintInfo")(made[0]), call("getConstraintState")(made[0])]
    seen += [p.getBasePositionAndOrientation(1), p.getJointStates(robot, [2, 3])]
    call("changeConstraint")(made[0], **change)
    seen.append(call("getConstraintInfo")(made[0]))
    p.disconnect()
    return is_requested, seen


@pytest.mark.parametrize("change", [*CHANGED, *BUILT], ids=repr)
@pytest.mark.parametrize("given", REQUESTED, ids=repr)
def test_changed_requests_are_those_of_the_python_function(
    given: tuple[Any, ...], change: dict[str, Any]
) -> None:
    ours, theirs = (changed_outcome(given, change, is_python=is_python) for is_python in (False, True))
    assert ours[0] == any(change is one for one in CHANGED)
    assert repr(ours[1]) == repr(theirs[1])


def test_a_third_joint_is_asked_for_at_once() -> None:
    p.connect(p.DIRECT)
    robot = p.loadURDF(f"{getDataPath()}/r2d2.urdf", [0, 0, 1])
    gear = p.createConstraint(robot, 2, robot, 3, GEAR, AXIS, ZERO, ZERO)
    client: Any = CLIENTS[0]
    assert gear in client.scene.requested
    with pytest.raises(p.error, match="changeConstraint failed"):
        p.changeConstraint(gear, gearAuxLink=99)
    assert gear not in client.scene.requested
    assert p.getConstraintInfo(gear)[12] == 0
    p.changeConstraint(gear, gearAuxLink=6)
    assert p.getConstraintInfo(gear)[12] == 6
