"""Compiled loops that load without numba, which takes half a second to load.

numba compiles a loop once, on its first use after an installation, and the machine code is stored: as an
image that is copied into memory, or as an object file that llvmlite, numba's code generator, loads. Each
becomes a builtin function of Python. Loops that use numba's threads or create arrays stay with `numba.njit`.
"""

from __future__ import annotations

from roboyard.native.c_functions import c_function
from roboyard.native.kernels import Kernel, can_call, compiled, lazy_loop, loaded
from roboyard.native.signatures import Bundle, Record, record

__all__ = [
    "Bundle",
    "Kernel",
    "Record",
    "c_function",
    "can_call",
    "compiled",
    "lazy_loop",
    "loaded",
    "record",
]
