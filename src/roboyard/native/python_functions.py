"""Functions of Python's C interface that compiled entries call; an object is its address."""

from __future__ import annotations

from typing import Any

from numba import types

WORD = types.int64
"""An address, or a number of Python's size."""
PYTHON: dict[str, Any] = {
    name: types.ExternalFunction(name, signature)
    for name, signature in {
        "PyErr_BadArgument": types.int32(),
        "PyErr_Clear": types.void(),
        "PyErr_Occurred": WORD(),
        "PyEval_RestoreThread": types.void(WORD),
        "PyEval_SaveThread": WORD(),
        "PyFloat_AsDouble": types.float64(WORD),
        "PyFloat_FromDouble": WORD(types.float64),
        "PyLong_AsLongLong": WORD(WORD),
        "PyLong_FromLongLong": WORD(WORD),
        "PyObject_Vectorcall": WORD(WORD, types.CPointer(WORD), WORD, WORD),
        "PySequence_GetItem": WORD(WORD, WORD),
        "PySequence_Size": WORD(WORD),
        "PyTuple_GetItem": WORD(WORD, WORD),
        "PyTuple_New": WORD(WORD),
        "PyTuple_SetItem": types.int32(WORD, WORD, WORD),
        "PyTuple_Size": WORD(WORD),
        "PyUnicode_GetLength": WORD(WORD),
        "PyUnicode_ReadChar": types.uint32(WORD, WORD),
        "Py_DecRef": types.void(WORD),
        "Py_IncRef": types.void(WORD),
    }.items()
}
"""Name to function."""
