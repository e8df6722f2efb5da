"""Compiled loops that load without numba, which takes half a second to load.

numba compiles a loop once, on its first use after an installation, and the machine code is stored. Afterwards
llvmlite, numba's code generator, loads the stored code, and ctypes calls it. Loops that use numba's threads
or create arrays stay with `numba.njit`.
"""

from __future__ import annotations

from roboyard.native.kernels import Kernel, compiled

__all__ = ["Kernel", "compiled"]
