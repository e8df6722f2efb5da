"""The decorator of compiled loops, and their first call."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from types import FunctionType
from typing import Any

from roboyard.native import objects
from roboyard.native.signatures import Signature, parse_signature

_CTYPES: dict[str, Any] = {"float64": ctypes.c_double, "int64": ctypes.c_int64, "int32": ctypes.c_int32}


class Kernel:
    """A loop that is compiled or loaded on its first call; its module then has the loaded function."""

    def __init__(
        self, function: FunctionType, signature: Signature, text: str, *, releases_gil: bool = False
    ) -> None:
        """Create the loop.

        Args:
            function: its Python source, which numba can compile.
            signature: its arguments.
            text: the signature as text.
            releases_gil: whether other Python threads run meanwhile.
        """
        self.releases_gil = releases_gil
        self.py_func = function
        """The loop in Python."""
        self.signature, self.text = signature, text
        self.__name__, self.__doc__, self.__module__ = (
            function.__name__,
            function.__doc__,
            function.__module__,
        )
        self._loaded: Callable[..., Any] | None = None
        self._checks = False

    def __call__(self, *values: Any) -> Any:
        """Call the loop; the first call loads it.

        Raises:
            TypeError: the values do not fit the signature. Later calls do not come here and are not checked,
                unless the environment had ROBOYARD_CHECK_LOOPS at the first one.
        """
        if self._loaded is None or self._checks:
            problem = self.signature.problem_with(values)
            if problem:
                raise TypeError(f"{self.__name__}({self.text}): {problem}")
            return self.load()(*values)
        return self._loaded(*values)

    def load(self) -> Callable[..., Any]:
        """Compile the loop or load its stored code, and return the function that executes it."""
        if self._loaded is None:
            address = objects.address_of(self.py_func, self.signature)
            self._loaded = _caller(self, address) if address else objects.jitted(self.py_func, self.signature)
            names = vars(sys.modules[self.__module__])
            self._checks = bool(os.environ.get("ROBOYARD_CHECK_LOOPS"))
            if names.get(self.__name__) is self and not self._checks:
                names[self.__name__] = self._loaded
        return self._loaded


def compiled(text: str, *, fast_math: bool = False, releases_gil: bool = False) -> Callable[[Any], Any]:
    """Return a decorator that makes a function a compiled loop.

    The function may use numbers, the arrays that it is given, NumPy's mathematics and other functions of its
    package, which are plain Python functions or loops; it creates no arrays. Divisions by zero give infinity.

    Args:
        text: types of the arguments, separated by spaces: f8, i8, i4 for numbers (float64, int64, int32) and
            f8[:], i4[:,:], ... for arrays, f8[:,::1] for those in C order, which are faster (only the first
            call checks); "-> f8" at the end where it returns a number.
        fast_math: whether the order of sums and products may be changed.
        releases_gil: whether other Python threads run during a call; for calls of a microsecond and more
            that return nothing, since there is one place for the number that a loop returns.
    """
    signature = replace(parse_signature(text), fast_math=fast_math)
    if releases_gil and signature.returns_number:
        raise TypeError(f"signature {text!r}: a loop that releases the GIL returns nothing")

    def decorate(function: Any) -> Kernel:
        given = function.__code__.co_argcount
        if given != len(signature.arguments):
            raise TypeError(f"{function.__name__} has {given} arguments, its signature {text!r} has others")
        return Kernel(function, signature, text, releases_gil=releases_gil)

    return decorate


def _caller(kernel: Kernel, address: int) -> Callable[..., Any]:
    """Return the Python function that calls machine code of numba's calling convention.

    That is: place of the result, place of an error, arguments. All arrays are passed as one tuple, since
    each argument of a foreign function costs a tenth of a microsecond; the code finds data, shape and strides
    in the array objects.
    """
    types = [_CTYPES[a.dtype] for a in kernel.signature.arguments if not a.dimensions]
    kind = ctypes.CFUNCTYPE if kernel.releases_gil else ctypes.PYFUNCTYPE
    call = kind(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.py_object, *types)(address)
    result, problem = ctypes.c_double(), ctypes.c_void_p()
    code = kernel.py_func.__code__
    names = code.co_varnames[: code.co_argcount]
    pairs = list(zip(names, kernel.signature.arguments, strict=True))
    arrays = "".join(f"{name}, " for name, argument in pairs if argument.dimensions)
    numbers = "".join(f", {name}" for name, argument in pairs if not argument.dimensions)
    lines = [f"_call(_result, _problem, ({arrays}){numbers})"]
    if kernel.signature.returns_number:
        lines.append("return _value.value")
    source = f"def {kernel.__name__}({', '.join(names)}):\n    " + "\n    ".join(lines)
    values: dict[str, Any] = {
        "_call": call,
        "_result": ctypes.addressof(result),
        "_problem": ctypes.addressof(problem),
        "_value": result,
        "_keep": problem,
    }
    exec(compile(source, f"<{kernel.__module__}.{kernel.__name__}>", "exec"), values)  # noqa: S102 - our own source
    made: Any = values[kernel.__name__]
    made.__doc__, made.__module__, made.py_func = kernel.__doc__, kernel.__module__, kernel.py_func
    return made
