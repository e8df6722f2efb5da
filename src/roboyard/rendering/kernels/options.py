"""Type of indices in the kernels."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

I: Any = int if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0") else np.uint64
"""Type of indices: unsigned, so that compiled loops do not check for negative ones."""
