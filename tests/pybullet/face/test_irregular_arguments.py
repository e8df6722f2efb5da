"""Irregular arguments lead to the same outcome in machine code and in Python functions."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pkgutil import walk_packages
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.fronts import Front
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet import fast
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands
from roboyard.pybullet_data import getDataPath

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


class Evil:
    """A sequence whose items cannot be read."""

    def __len__(self) -> int:
        """Return its length."""
        return 3

    def __getitem__(self, place: int) -> float:
        """Raise an error."""
        raise ValueError(place)


class Index:
    """An object that serves as an index."""

    def __index__(self) -> int:
        """Return it."""
        return 1


class Real(float):
    """A number of a class of its own."""


class Whole(int):
    """An integer of a class of its own."""


VALUES: dict[str, Any] = {
    "none": None, "minus one": -1, "zero": 0, "two": 2, "large": 10**6, "32 bits": 2**31, "64 bits": 2**63,
    "below 64 bits": -(2**70), "nan": float("nan"), "inf": float("inf"), "text": "abc", "bytes": b"x",
    "no text": "", "empty": [], "empty tuple": (), "dict": {}, "one": [1], "pair": [1, 2],
    "three": [1.0, 2, 3], "four": (0, 0, 0, 1),
    "nones": [None] * 3, "texts": ["a"] * 3, "rows": [[1, 2, 3]], "array": np.zeros(3),
    "matrix": np.zeros((2, 3)), "scalar": np.array(3), "single": np.float32(1), "integer": np.int64(2),
    "true": True, "object": object(), "evil": Evil(), "index": Index(), "range": range(3), "set": {1, 2},
    "nans": [float("nan")] * 3, "infs": [float("inf")] * 4, "huge": [10**30] * 3, "many": [0.0] * 100,
    "real": Real(1.5), "whole": Whole(1), "reals": [Real(1.0)] * 3, "objects": np.array([1, 2, 3], object),
    "view": memoryview(b"abc"), "complex": 1j, "largest": [1e308] * 3,
}  # fmt: skip
LENIENT = "index", "single"
"""Values that are equal to an integer, or serve as one, which machine code may take where Python does not."""
NOWHERE, UNTURNED = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
ROBOT, CUBE, PLANE = 1, 2, 0
CALLS: dict[str, tuple[Any, ...]] = {
    "getBasePositionAndOrientation": (ROBOT,),
    "getBaseVelocity": (ROBOT,),
    "resetBasePositionAndOrientation": (CUBE, [1, 1, 1], UNTURNED),
    "resetBaseVelocity": (CUBE, NOWHERE, NOWHERE),
    "getJointState": (ROBOT, 2),
    "getJointStates": (ROBOT, [2, 3]),
    "getJointStateMultiDof": (ROBOT, 2),
    "getJointStatesMultiDof": (ROBOT, [2, 3]),
    "getLinkState": (ROBOT, 2, 1, 1),
    "getLinkStates": (ROBOT, [2, 3], 1, 1),
    "resetJointState": (ROBOT, 2, 0.1, 0.1),
    "resetJointStateMultiDof": (ROBOT, 2, [0.1], [0.1]),
    "resetJointStatesMultiDof": (ROBOT, [2, 3], [[0.1], [0.1]], [[0.1], [0.1]]),
    "setJointMotorControl2": (ROBOT, 2, p.POSITION_CONTROL, 0.1, 0.1, 5.0, 0.1, 0.1, 3.0),
    "setJointMotorControlArray": (ROBOT, [2, 3], p.VELOCITY_CONTROL, [0, 0], [1, 1], [2, 2]),
    "setJointMotorControlMultiDof": (ROBOT, 2, p.POSITION_CONTROL, [0.1], [0.1], [1], 0.1, 0.1),
    "applyExternalForce": (CUBE, -1, [1, 0, 0], NOWHERE, p.LINK_FRAME),
    "applyExternalTorque": (CUBE, -1, [1, 0, 0], p.LINK_FRAME),
    "getAABB": (ROBOT, -1),
    "getOverlappingObjects": ([-1, -1, -1], [1, 1, 1]),
    "getContactPoints": (CUBE, PLANE, -1, -1),
    "getClosestPoints": (ROBOT, CUBE, 1.0, -1, -1),
    "rayTest": ([0, 0, 5], [0, 0, -5]),
    "rayTestBatch": ([[0, 0, 5]], [[0, 0, -5]]),
    "getDynamicsInfo": (ROBOT, -1),
    "changeDynamics": (CUBE, -1, 0.5, 0.5, 0.1, 0.1, 0.1, 0.04, 0.04),
    "createConstraint": (CUBE, -1, -1, -1, p.JOINT_POINT2POINT, NOWHERE, NOWHERE, NOWHERE),
    "changeConstraint": (1, [1, 1, 1], UNTURNED, 5),
    "getConstraintState": (1,),
    "getConstraintInfo": (1,),
    "getConstraintUniqueId": (0,),
    "setCollisionFilterGroupMask": (CUBE, -1, 1, 1),
    "addUserData": (ROBOT, "a", "b", -1, -1),
    "getUserData": (0,),
    "getUserDataId": (ROBOT, "a", -1, -1),
    "addUserDebugLine": (NOWHERE, [1, 1, 1], [1, 0, 0], 1, 0),
    "addUserDebugText": ("t", NOWHERE, [1, 0, 0], 1, 0),
    "addUserDebugPoints": ([NOWHERE], [[1, 0, 0]], 1, 0),
    "addUserDebugParameter": ("x", 0, 1, 0.5),
    "changeVisualShape": (CUBE, -1, -1, -2, [1, 0, 0, 1]),
    "calculateMassMatrix": (ROBOT, [0.0] * 15),
    "setGravity": (0, 0, -10),
}


@pytest.fixture(scope="module", autouse=True)
def _machine_code() -> Iterator[None]:
    found = walk_packages(fast.__path__, f"{fast.__name__}.")
    modules = [import_module(module.name) for module in found]
    entries = [value for module in modules for value in vars(module).values() if isinstance(value, Front)]
    assert all(front.address() for front in (FRONT, *entries)), "compiled and stored now, if not before"
    few, fast_commands.FEW = fast_commands.FEW, 0
    direct_calls.START.enter(waits=False)
    yield
    fast_commands.FEW = few


def world() -> None:
    """Make a robot, a cube with a constraint, and a plane, and prepare what machine code needs of them."""
    p.resetSimulation()
    p.setGravity(0, 0, -10)
    for file, height in (("plane.urdf", 0.0), ("r2d2.urdf", 0.5), ("cube_small.urdf", 2.0)):
        p.loadURDF(f"{getDataPath()}/{file}", [0, 0, height])
    p.createConstraint(CUBE, -1, -1, -1, p.JOINT_FIXED, NOWHERE, NOWHERE, [1, 1, 1])
    p.addUserData(ROBOT, "a", "b")
    p.stepSimulation()


def outcome(name: str, given: tuple[Any, ...], *, is_python: bool) -> Any:
    """Return the class of the exception that a call raises, with the message; None where it raises none."""
    try:
        if is_python:  # public functions make Python's integers of NumPy's
            numbers = [int(value) if isinstance(value, np.int64) else value for value in given]
            COMMANDS[name].function(CLIENTS[0], *numbers)
        else:
            getattr(p, name)(*given)
    except Exception as problem:
        try:
            direct_calls.fail(name, problem)
        except Exception as shown:
            return type(shown), str(shown).splitlines()[:1]
    return None


@pytest.fixture
def _client() -> Iterator[None]:
    assert p.connect(p.DIRECT) == 0
    world()
    yield
    p.disconnect()


@pytest.mark.usefixtures("_client")
@pytest.mark.parametrize("name", sorted(CALLS))
def test_irregular_arguments_have_the_same_outcome(name: str) -> None:
    given = CALLS[name]
    for _ in range(3):
        assert outcome(name, given, is_python=False) is None
    for place in range(len(given)):
        for kind, value in VALUES.items():
            changed = (*given[:place], value, *given[place + 1 :])
            ours, theirs = (outcome(name, changed, is_python=is_python) for is_python in (False, True))
            if ours is not None or kind not in LENIENT:
                assert ours == theirs, f"argument {place}: {kind}"
            outcome(name, given, is_python=False)
        world()


class Clearing:
    """A number that empties the list that has it when it is read."""

    def __init__(self, owner: list[Any]) -> None:
        """Note the list."""
        self.owner = owner

    def __float__(self) -> float:
        """Empty the list and return 1.5."""
        self.owner.clear()
        return 1.5

    def __index__(self) -> int:
        """Empty the list and return 1."""
        self.owner.clear()
        return 1


class ClearingRow(Clearing):
    """The same as a row of three numbers."""

    def __len__(self) -> int:
        """Return the number of numbers."""
        return 3

    def __getitem__(self, place: int) -> float:
        """Empty the list and return one of the numbers."""
        self.owner.clear()
        return (0.25, 0.5, 0.75)[place]


OF_NUMPY = "addUserDebugPoints", "calculateMassMatrix", "rayTestBatch"
"""Commands whose Python functions give lists to NumPy, which reads freed memory if a row empties its list."""


@pytest.mark.usefixtures("_client")
@pytest.mark.parametrize("name", sorted(CALLS))
def test_lists_that_are_emptied_while_they_are_read_end_no_process(name: str) -> None:
    given = CALLS[name]
    for place in range(len(given)):
        for length in (1, 2, 3, 4, 40):
            for position in {0, 1, length - 1}:
                for kind in (Clearing,) if name in OF_NUMPY else (Clearing, ClearingRow):
                    values: list[Any] = [0.5] * length
                    values[min(position, length - 1)] = kind(values)
                    outcome(name, (*given[:place], values, *given[place + 1 :]), is_python=False)
                    outcome(name, given, is_python=False)
        world()
    assert outcome(name, given, is_python=False) is None


class Resetting:
    """A number that resets the simulation when it is read."""

    def __float__(self) -> float:
        """Reset the simulation and return 0.5."""
        p.resetSimulation()
        return 0.5

    def __index__(self) -> int:
        """Reset the simulation and return 1."""
        p.resetSimulation()
        return 1


class ResettingRow(Resetting):
    """The same as a row of three numbers."""

    def __len__(self) -> int:
        """Return the number of numbers."""
        return 3

    def __getitem__(self, place: int) -> float:
        """Reset the simulation and return one of the numbers."""
        p.resetSimulation()
        return (0.25, 0.5, 0.75)[place]


@pytest.mark.usefixtures("_client")
@pytest.mark.parametrize("name", sorted(CALLS))
def test_numbers_that_reset_the_simulation_while_they_are_read_end_no_process(name: str) -> None:
    given = CALLS[name]
    for place, value in enumerate(given):
        hostile: list[Any] = [Resetting(), ResettingRow()]
        if isinstance(value, list | tuple):
            for at in range(len(value)):
                for one in (Resetting(), ResettingRow(), [0.5, Resetting(), 0.5], [Resetting()]):
                    hostile.append([*value[:at], one, *value[at + 1 :]])
        for one in hostile:
            for _ in range(3):
                outcome(name, given, is_python=False)
            outcome(name, (*given[:place], one, *given[place + 1 :]), is_python=False)
            world()
    assert outcome(name, given, is_python=False) is None
