"""Type of indices in the kernels."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard.native.objects import compiler_is_off

I: Any = int if compiler_is_off() else np.uint64
"""Type of indices: unsigned, so that compiled loops do not check for negative ones."""
