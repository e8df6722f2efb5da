"""Code without machine code: it is emitted and linked as any other, and numba goes on as before."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numba import cfunc, njit, types
from numba.core.registry import cpu_target

from roboyard.native.code_library import without_machine_code

PROGRAM = """
import numpy as np
from numba import njit
from roboyard.native.building import machine_code
from roboyard.native.signatures import parse_signature

def turned(a, b):
    return np.sqrt(a @ a) + np.clip(b, -1.0, 1.0)[0] + np.arctan2(a[0], b[0])

def loop(x, y, out):
    total = 0.0
    for k in range(x.shape[0]):
        total += np.hypot(x[k], y[k]) * np.sign(x[k])
    out[0] = total

assert machine_code(loop, parse_signature("f8[:] f8[:] f8[:]"), "roboyard_loop", is_small=True)
x, y, out = np.linspace(-1.0, 2.0, 7), np.linspace(3.0, 4.0, 7), np.zeros(1)
njit(loop)(x, y, out)
assert np.isclose(out[0], (np.hypot(x, y) * np.sign(x)).sum())
assert np.isclose(njit(turned)(x, y), turned(x, y))
"""
"""Compiles a loop to be stored, then uses the same functions of numba in those of a program."""


def test_nothing_of_what_it_compiles_has_an_address() -> None:
    def half(x: float) -> float:
        return 0.5 * x

    part = njit(half)
    with without_machine_code():
        made = cfunc(types.float64(types.float64))(lambda x: part(x) + 1.0)
    assert made.address == 0
    assert "define double" in made.inspect_llvm()


def test_a_program_goes_on_with_numba_as_before() -> None:
    subprocess.run([sys.executable, "-W", "ignore", "-c", PROGRAM], check=True, timeout=120)


def test_numba_has_its_own_libraries_again_after_an_error() -> None:
    kept = cpu_target.target_context._internal_codegen
    with pytest.raises(ZeroDivisionError), without_machine_code():
        assert cpu_target.target_context._internal_codegen is not kept
        raise ZeroDivisionError
    assert cpu_target.target_context._internal_codegen is kept
    assert njit(lambda x: x + 1.0)(np.float64(2.0)) == 3.0


def test_libraries_that_are_not_known_are_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    other = object()
    monkeypatch.setattr(cpu_target.target_context, "_internal_codegen", other)
    with without_machine_code():
        assert cpu_target.target_context._internal_codegen is other
