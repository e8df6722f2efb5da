"""Compilation options of the kernels."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from roboyard._numba import njit

FAST = {"contract", "arcp", "nsz", "reassoc", "afn"}
"""Fast-math flags: rounding may differ by a last bit; infinities and NaN keep their meaning."""

_OPTIONS: dict[str, Any] = {"cache": True, "error_model": "numpy", "fastmath": FAST, "nogil": True}
_NO_REFCOUNTS: dict[str, Any] = {"_nrt": False}

compiled: Any = njit(**_OPTIONS)
"""Decorator of a kernel."""
without_refcounts: Any = njit(**_OPTIONS, **_NO_REFCOUNTS)
"""Decorator of a function that creates no array: numba then counts no references to its array arguments,
which would cost an atomic operation per array and call."""
inlined: Any = njit(**_OPTIONS, **_NO_REFCOUNTS, forceinline=True)
"""Like `without_refcounts`, and always inlined: passing groups of arrays would cost 0.2 ms a picture."""

_EXACT: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "_nrt": False}

exact: Any = njit(**_EXACT)
"""Decorator of a kernel with the rounding of IEEE 754, which creates no array."""
inlined_exact: Any = njit(**_EXACT, forceinline=True)
"""Like `exact`, and always inlined."""

I: Any = int if getattr(numba.config, "DISABLE_JIT", False) else np.uint64
"""Type of indices: unsigned, so that compiled loops do not check for negative ones."""
