"""Long lists of numbers read by compiled loops, many times faster than by NumPy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboyard._lazy import lazy_module
from roboyard.native import Kernel

kernels = lazy_module("roboyard.shapes.readers.number_kernels")

LARGE = 20_000
"""Characters from which a list is worth the loading of compiled loops."""
_POWERS = 10.0 ** np.arange(23)


def read_plain_numbers(text: str, dtype: type) -> NDArray | None:
    """Return the (n,) numbers of a text that blanks separate, as `np.float64` or `np.int64`.

    None for a list that is not plain: of more than 15 digits a number, with tabs, with signs before whole
    numbers, or with words. Also None where compiled loops cannot be stored.
    """
    read = kernels().read_floats if dtype is np.float64 else kernels().read_integers
    if isinstance(read, Kernel) and not read.is_cheap:
        return None
    data = np.frombuffer(text.encode("utf-8", "replace"), dtype=np.uint8)
    values = np.empty(len(data) // 2 + 1, dtype=dtype)
    if dtype is np.float64:
        count = read(data, _POWERS, np.zeros(1, dtype=np.int64), values)
    else:
        count = read(data, values)
    return None if count < 0 else values[:count].copy()
