"""Compiled fronts: plain calls agree with the Python function, all others go to it."""

from __future__ import annotations

import pickle
import random
import sys
from importlib import import_module
from math import inf, nan
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.fronts import fronted
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.face import calling
from roboyard.pybullet.functions import _FREE

pytestmark = pytest.mark.skipif(not arrays_have_the_known_layout(), reason="machine code is not used here")


def scaled(x: float, y: float, factor: float) -> tuple[float, float, float]:
    return factor * x, factor * y, x / y


@fronted(scaled, "f8:2 f8 -> f8:2 f4", ignored="unused")
def python(vector: Any, factor: float, unused: int = 0, mark: str = "") -> Any:
    return "python", vector, factor, mark


@pytest.fixture(scope="module")
def front() -> Any:
    made = calling.counted(python)
    function = calling.builtin(made)
    made.entered[0].function = made.front.address()  # type: ignore[attr-defined]
    return function


@pytest.mark.parametrize(
    "vector", [[1.5, 3.0], (1.5, 3.0), np.array([1.5, 3.0]), np.array([1.5, 3.0], dtype=np.float32)]
)
def test_it_takes_sequences_of_numbers(front: Any, vector: Any) -> None:
    assert front(vector, 2) == ((3.0, 6.0), 0.5)
    assert front(vector, 2.0, unused=7) == ((3.0, 6.0), 0.5)
    assert all(type(number) is float for number in (*front(vector, 2)[0], front(vector, 2)[1]))


def test_results_are_rounded_where_the_signature_says_so(front: Any) -> None:
    (x, y), ratio = front([0.1, 0.3], 1.0)
    assert (x, y, ratio) == (0.1, 0.3, float(np.float32(0.1 / 0.3)))


@pytest.mark.parametrize(
    "vector",
    [[1.0], [1.0, 2.0, 3.0], ["1", "2"], "12", 5, None, {0: 1.0, 1: 2.0}, [nan, 1.0], [inf, 1.0], [1.0, 0.0]],
)
def test_the_python_function_takes_the_rest(front: Any, vector: Any) -> None:
    assert front(vector, 2.0)[0] == "python"


def test_it_takes_its_arguments_by_name(front: Any) -> None:
    given = [1.5, 3.0]
    for found in (
        front(given, factor=2.0),
        front(vector=given, factor=2.0),
        front(factor=2.0, vector=given),
        front(unused=3, factor=2.0, vector=given),
        front(given, unused=3, factor=2.0),
    ):
        assert found == ((3.0, 6.0), 0.5)
    assert front(vector=given, factor=2.0, mark="x") == ("python", given, 2.0, "x")
    assert front(vector=given, factor="2") == ("python", given, "2", "")
    for keywords, message in (
        ({"vector": given}, "missing 1 required"),
        ({"vector": given, "factor": 2.0, "vectoR": given}, "unexpected keyword"),
    ):
        with pytest.raises(TypeError, match=message):
            front(**keywords)
    with pytest.raises(TypeError, match="multiple values"):
        front(given, vector=given)
    with pytest.raises(TypeError, match="multiple values"):
        front(given, 2.0, vector=given, factor=2.0)


def test_the_python_function_takes_other_calls(front: Any) -> None:
    given = [1.0, 2.0]
    assert front(given, 2.0, 0, "mark") == ("python", given, 2.0, "mark")
    assert front(given, 2.0, mark="x") == ("python", given, 2.0, "x")
    assert front(given, 2.0, mark="a", unused=1) == ("python", given, 2.0, "a")
    assert front(given, "2")[0] == "python"
    with pytest.raises(TypeError, match="missing 1 required"):
        front(given)


class Broken:
    """A sequence whose numbers cannot be read."""

    def __len__(self) -> int:
        return 2

    def __getitem__(self, place: int) -> float:
        raise RuntimeError(f"no number {place}")


def test_errors_of_a_sequence_are_left_to_the_python_function(front: Any) -> None:
    assert front(Broken(), 1.0)[0] == "python"
    front([1.0, 2.0], 1.0)  # no error is left behind


def test_objects_are_released(front: Any) -> None:
    number, vector = 1234.5, [0.5, 1.5]
    vector[0] = number
    counts = sys.getrefcount(number), sys.getrefcount(vector)
    for _ in range(1000):
        front(vector, 2.0)
        front(vector, "2")
    assert sys.getrefcount(number) == counts[0]
    assert sys.getrefcount(vector) == counts[1]


def test_a_wrong_number_of_arguments_is_refused() -> None:
    with pytest.raises(TypeError, match="3 arguments, 'f8:2 -> f8' has 2"):
        fronted(scaled, "f8:2 -> f8")


def functions() -> list[str]:
    """Return the names of PyBullet's mathematics that have a front."""
    return [
        name
        for module, names in _FREE.items()
        for name in names
        if hasattr(getattr(import_module(f"roboyard.pybullet.{module}"), name), "front")
    ]


def test_all_mathematics_has_fronts() -> None:
    assert len(functions()) == 16


@pytest.mark.parametrize("name", functions())
def test_mathematics_is_the_same_with_and_without(name: str) -> None:
    module = next(module for module, names in _FREE.items() if name in names)
    function = getattr(import_module(f"roboyard.pybullet.{module}"), name)
    made = calling.counted(function)
    compiled = calling.builtin(made)
    made.entered[0].function = made.front.address()  # type: ignore[attr-defined]
    draw = random.Random(name)
    lengths = [given.length for given in function.front.signature.arguments]
    for _ in range(50):
        given = [
            [draw.uniform(-1, 1) for _ in range(length)] if length else draw.uniform(0.1, 2.0)
            for length in lengths
        ]
        if name == "computeViewMatrixFromYawPitchRoll":
            given[-1] = draw.choice([1, 2])
        if name == "getEulerFromQuaternion":
            given[0] = list(np.array(given[0]) / np.linalg.norm(given[0]))
        np.testing.assert_allclose(flat(compiled(*given)), flat(function(*given)), rtol=2e-6, atol=2e-7)


def flat(value: Any) -> list[float]:
    """Return all numbers of nested tuples."""
    return [n for part in value for n in flat(part)] if isinstance(value, tuple) else [value]


def test_fronted_functions_are_pickled() -> None:
    assert pickle.loads(pickle.dumps(p.multiplyTransforms)) is p.multiplyTransforms
