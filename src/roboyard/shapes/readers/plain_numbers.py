"""Long lists of numbers read by compiled loops, many times faster than by NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import lazy_module
from roboyard.shapes.readers.worth import is_large, is_worth

kernels = lazy_module("roboyard.shapes.readers.number_kernels")

_POWERS = [10**k for k in range(61)]
POWERS = np.array([*map(float, _POWERS), *(float(power - int(float(power))) for power in _POWERS)])
"""Powers of ten from 0 to 60, then how much more than these they are exactly, as the loops need them."""


def is_worth_it(text: str, dtype: type) -> bool:
    """Return whether a compiled loop should read the numbers of a text."""
    return is_large(len(text)) and is_worth(_loop(dtype), len(text))


def _loop(dtype: type) -> Any:
    return kernels().read_floats if dtype is np.float64 else kernels().read_integers


def read_plain_numbers(text: str, dtype: type) -> NDArray | None:
    """Return the (n,) numbers of a text that blanks separate, as `np.float64` or `np.int64`.

    None for a list that is not plain: of more than 18 digits a number, with tabs, with signs before whole
    numbers, or with words.
    """
    read = _loop(dtype)
    data = np.frombuffer(text.encode("utf-8", "replace"), dtype=np.uint8)
    values = np.empty(len(data) // 2 + 1, dtype=dtype)
    if dtype is np.float64:
        count = read(data, POWERS, np.zeros(1, dtype=np.int64), values)
    else:
        count = read(data, values)
    return None if count < 0 else values[:count].copy()
