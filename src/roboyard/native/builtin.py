"""Machine code as builtin functions of Python, which are called without any work in Python."""

from __future__ import annotations

import ctypes
from types import FunctionType
from typing import Any

_FASTCALL, _KEYWORDS = 0x80, 0x02  # METH_FASTCALL and METH_KEYWORDS of Python's C interface


class _Definition(ctypes.Structure):
    """PyMethodDef of Python's C interface."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("call", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    )


_new = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.POINTER(_Definition), ctypes.py_object, ctypes.py_object)(
    ("PyCFunction_NewEx", ctypes.pythonapi)
)
_definitions: list[_Definition] = []
"""They outlive all modules: Python reads them once more when it frees a builtin function at its very end."""
ctypes.pythonapi.Py_IncRef(ctypes.py_object(_definitions))
_made: dict[Any, FunctionType] = {}
"""Builtin function to its Python source."""


def builtin_function(function: FunctionType, address: int) -> Any:
    """Return a builtin function with the name of a Python function, which calls machine code.

    Args:
        function: Python source of the machine code.
        address: of the machine code, whose arguments are None, the address of the objects and their number.
    """
    definition = _Definition(
        function.__name__.encode(), address, _FASTCALL, (function.__doc__ or "").encode() or None
    )
    _definitions.append(definition)
    made = _new(ctypes.byref(definition), None, function.__module__)
    _made[made] = function
    return made


def lone_function(name: str, module: str, address: int) -> Any:
    """Return a builtin function that calls the machine code of a loop, without its Python source.

    Args:
        name: of the loop.
        module: that defines it.
        address: of the machine code, as of `builtin_function`.
    """
    definition = _Definition(name.encode(), address, _FASTCALL, None)
    _definitions.append(definition)
    return _new(ctypes.byref(definition), None, module)


def bound_function(name: str, address: int, state: object) -> Any:
    """Return a builtin function which calls machine code with its own state.

    Args:
        name: its name.
        address: of the machine code, whose arguments are the state, the address of the objects, their number
            and the names of keywords.
        state: any object, which it keeps.
    """
    definition = _Definition(name.encode(), address, _FASTCALL | _KEYWORDS, None)
    _definitions.append(definition)
    return _new(ctypes.byref(definition), state, None)


def source_function(called: Any) -> Any:
    """Return the Python source of a loop, loaded or not; any other object as it is."""
    if called in _made:
        return _made[called]
    return getattr(called, "py_func", called)
