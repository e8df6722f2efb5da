"""Long lists of numbers read by compiled loops against Python's own reader."""

from __future__ import annotations

import random

import numpy as np
import pytest

from roboyard.shapes.readers.plain_numbers import read_plain_numbers


def test_floats_are_those_of_python() -> None:
    rng = random.Random(3)
    formats = ("%.6g", "%.9f", "%d", "%.3e", "%.15g", "%+.4f", "%.7E", "%.16g", "%.17g", "%.18g", "%.15e")
    words = [rng.choice(formats) % rng.uniform(-2000.0, 2000.0) for _ in range(5000)]
    words += ["0", "-0", "-0.0", "5.", ".5", "-.25e-3", "1e-7", "000012.50", "1e22"]
    words += [repr(rng.uniform(-1.0, 1.0) * 10.0 ** rng.randrange(-40, 3)) for _ in range(5000)]
    text = "\n" + "".join(word + rng.choice((" ", "\n", "\r\n", "  ")) for word in words)
    found = read_plain_numbers(text, np.float64)
    assert found is not None
    assert found.tobytes() == np.array([float(word) for word in words]).tobytes()


def test_whole_numbers_are_those_of_python() -> None:
    rng = random.Random(4)
    words = [str(rng.randrange(10 ** rng.randrange(1, 12))) for _ in range(3000)]
    found = read_plain_numbers(" " + "  ".join(words) + "\n", np.int64)
    assert found is not None
    assert found.dtype == np.int64
    assert found.tolist() == [int(word) for word in words]


@pytest.mark.parametrize("dtype", [np.float64, np.int64])
def test_an_empty_list(dtype: type) -> None:
    found = read_plain_numbers(" \n", dtype)
    assert found is not None
    assert found.shape == (0,)


@pytest.mark.parametrize(
    "text", ["1 2 x", "1,2", "1\t2", "nan", "1 inf", "1e400", "1.2.3", "-", "0x10", "1 é", "1_000", "1e-80"]
)
def test_lists_that_are_not_plain_are_left_to_others(text: str) -> None:
    assert read_plain_numbers(text, np.float64) is None


@pytest.mark.parametrize("text", ["1 2.0", "-1", "+1", "1e3", "1234567890123456789", "3 a"])
def test_whole_numbers_that_are_not_plain(text: str) -> None:
    assert read_plain_numbers(text, np.int64) is None
