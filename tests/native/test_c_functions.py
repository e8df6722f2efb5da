"""Compiled loops call functions of C libraries, as their Python source does."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

from roboyard.native import c_function, can_call, compiled
from roboyard.native.called import source_of
from roboyard.native.memory import images_can_be_loaded


def _mathematics() -> Any:
    return ctypes.CDLL("libm.so.6")


fmax = c_function("fmax", "f8 f8 -> f8", library=_mathematics)
frexp = c_function("frexp", "f8 i8 -> f8", library=_mathematics)


@compiled("f8[::1] i4[::1] f8 -> f8", library=_mathematics)
def split(values, powers, least):
    total = 0.0
    for k in range(len(values)):
        total += frexp(fmax(values[k], least), powers.ctypes.data + 4 * k)
    return total


LOOP = split  # its name becomes the loaded function


@pytest.mark.skipif(not images_can_be_loaded(), reason="images are for x86-64 Linux")
def test_loops_call_functions_of_c(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    values = np.array([3.0, 40.0, -7.0])
    fractions, powers = np.frexp(np.maximum(values, 0.25))
    for loop in (LOOP, LOOP.py_func):
        found = np.zeros(3, dtype=np.int32)
        assert loop(values, found, 0.25) == pytest.approx(fractions.sum(), rel=1e-15)
        assert found.tolist() == powers.tolist()
    assert can_call(_mathematics)


def test_loops_that_lack_their_library_or_are_not_compiled_call_none(monkeypatch):
    assert not can_call(lambda: None)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert not can_call(_mathematics)


def test_a_function_of_c_is_part_of_what_decides_machine_code():
    assert any(b"fmax" in part and b"CFunction" in part for part in source_of(LOOP.py_func))
