"""Compiled functions for C are called with C's arguments, and call another C function where they decline."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from roboyard.native.callbacks import called_by_c
from roboyard.native.memory import function_address, images_can_be_loaded
from roboyard.native.views import integers_at, numbers_at, short_numbers_at, words_at

pytestmark = pytest.mark.skipif(not images_can_be_loaded(), reason="images are for x86-64 Linux")


class Library:
    """Functions of a library, as ctypes gives them."""


LIBRARY = Library()


def _mathematics():
    return ctypes.CDLL("libm.so.6")


@called_by_c("f8 -> f8", otherwise="fabs", library=_mathematics)
def doubled(value):
    return 2.0 * value


@called_by_c("i8 i4 i4 -> i4", otherwise="roboyard_nothing", library=lambda: LIBRARY)
def summed(table, first, count):
    words = words_at(table, 4)
    total = 0.0
    for k in range(count):
        total += numbers_at(words[0], 9)[first + k] + short_numbers_at(words[1], 9)[first + k]
        total += integers_at(words[2], 9)[first + k]
    numbers_at(words[3], 1)[0] = total
    return count


def test_a_negative_result_is_that_of_the_other_function():
    call = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(doubled.address())
    assert [call(value) for value in (1.5, 0.0, -4.0)] == [3.0, 0.0, 4.0]
    assert doubled.is_stored == doubled.is_cheap


def test_memory_is_read_and_written_at_addresses(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    rng = np.random.default_rng(0)
    numbers, short, whole = (
        rng.normal(size=9),
        rng.normal(size=9).astype(np.float32),
        np.arange(9, dtype="i4"),
    )
    out = np.zeros(1)
    table = np.array([a.ctypes.data for a in (numbers, short, whole, out)])
    wanted = float((numbers + short + whole)[2:7].sum())
    assert summed.core(table.ctypes.data, 2, 5) == 5
    assert out[0] == pytest.approx(wanted)
    out[0] = 0.0
    with pytest.raises(TypeError, match="roboyard_nothing"):
        summed.address()
    LIBRARY.roboyard_nothing = ctypes.CFUNCTYPE(ctypes.c_int)(lambda: 7)
    function_address.cache_clear()
    call = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int64, ctypes.c_int, ctypes.c_int)(summed.address())
    assert call(table.ctypes.data, 2, 5) == 5
    assert out[0] == pytest.approx(wanted)
    assert call(table.ctypes.data, 2, -1) == 7


def test_a_callback_of_another_number_of_arguments_is_rejected():
    with pytest.raises(TypeError, match="has 2 arguments"):

        @called_by_c("f8 -> f8", otherwise="fabs", library=_mathematics)
        def two(a, b):
            return a + b
