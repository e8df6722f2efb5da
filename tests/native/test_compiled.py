"""Compiled loops: the machine code does what the Python source does, with stored code and without numba."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roboyard.native import Kernel, compiled
from roboyard.native.building import jit

SOURCE = """
import sys

import numpy as np

from roboyard.native import compiled


def half(x):
    return 0.5 * x


@compiled("f8[:,:] i4[:] f8[:,:,:] i8 f8 -> f8")
def mixed(a, rows, out, first, factor):
    total = 0.0
    for n in range(first, len(rows)):
        for k in range(a.shape[1]):
            out[0, n, k] = factor * np.arctan2(half(a[rows[n], k]), 1.0)
            total += out[0, n, k] / a[0, 0]
    return total


def arguments():
    a = np.arange(1.0, 49.0).reshape(6, 8)[:, ::2]
    return a, np.array([5, 0, 3], dtype=np.int32), np.zeros((2, 3, 8))[:, :, ::-2], 1, 2.5


if __name__ == "__main__":
    given, plain = arguments(), arguments()
    assert np.isclose(mixed(*given), mixed.py_func(*plain))
    assert np.allclose(given[2], plain[2], rtol=1e-14) and given[2].any()
    mixed(*given)
    print("numba" in sys.modules)
"""


def run(folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, "loops.py"],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")},
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_stored_code_is_loaded_without_numba_and_agrees_with_the_source(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(SOURCE)
    assert run(tmp_path) == "True"  # compiled now
    assert run(tmp_path) == "False"
    (stored,) = (tmp_path / "cache").iterdir()
    code = (tmp_path / "loops.py").read_text().replace("0.5 * x", "0.25 * x")
    (tmp_path / "loops.py").write_text(code)
    assert run(tmp_path) == "True", "the machine code of the other source was used"
    assert {stored} < set((tmp_path / "cache").iterdir())


@compiled("f8[:] i8 f8")
def fill(values, count, number):
    for k in range(count):
        values[k] = 1.0 / number


def test_wrong_arguments_are_rejected_with_their_place() -> None:
    loop = Kernel(fill.py_func, fill.signature, fill.text)
    with pytest.raises(TypeError, match="argument 0 is float32 instead of float64"):
        loop(np.zeros(3, dtype=np.float32), 3, 1.0)
    with pytest.raises(TypeError, match="argument 0 has 2 dimensions instead of 1"):
        loop(np.zeros((3, 3)), 3, 1.0)
    with pytest.raises(TypeError, match="2 arguments instead of 3"):
        loop(np.zeros(3), 3)
    with pytest.raises(TypeError, match="signature"):
        compiled("f8[:] i8")(fill.py_func)


def test_numbas_own_function_takes_over_where_stored_code_cannot_be_used() -> None:
    values = np.zeros(3)
    jit(fill.py_func)(values, 2, 0.0)
    assert values.tolist() == [np.inf, np.inf, 0.0]
