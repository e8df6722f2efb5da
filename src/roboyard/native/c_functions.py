"""Functions of C libraries that compiled loops call."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import field
from typing import Any

from roboyard._records import dataclass
from roboyard.native.signatures import DTYPES

_KINDS = {
    "int64": ctypes.c_int64,
    "int32": ctypes.c_int32,
    "float64": ctypes.c_double,
}


@dataclass(frozen=True)
class CFunction:
    """A function of a C library; addresses are whole numbers."""

    name: str
    arguments: tuple[str, ...]
    """`int64`, `int32` or `float64`."""
    returns: str
    library: Callable[[], Any] = field(repr=False)
    """Returns the `ctypes.CDLL` that has it, or None."""

    def __call__(self, *values: float) -> Any:
        """Call the function from Python, as loops do that are not compiled."""
        function = self.library()[self.name]
        function.argtypes = [_KINDS[kind] for kind in self.arguments]
        function.restype = _KINDS[self.returns]
        return function(*values)


def c_function(name: str, text: str, *, library: Callable[[], Any]) -> CFunction:
    """Return a function of a C library for loops, which are `compiled` with the same `library`.

    Args:
        name: of the function.
        text: arguments and result, such as "i8 i8 i4 f8 -> f8"; i8 is an address, too.
        library: returns the `ctypes.CDLL` that has it, or None.
    """
    before, _, after = text.partition("->")
    return CFunction(name, tuple(DTYPES[word] for word in before.split()), DTYPES[after.strip()], library)
