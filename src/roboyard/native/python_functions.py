"""Functions of Python's C interface that compiled entries call; an object is its address."""

from __future__ import annotations

from typing import Any

from numba import types

WORD = types.int64
"""An address, or a number of Python's size."""
PYTHON: dict[str, Any] = {
    name: types.ExternalFunction(name, signature)
    for name, signature in {
        "PyCell_Get": WORD(WORD),
        "PyDict_Clear": types.void(WORD),
        "PyDict_DelItem": types.int32(WORD, WORD),
        "PyDict_GetItemWithError": WORD(WORD, WORD),
        "PyDict_SetItem": types.int32(WORD, WORD, WORD),
        "PyDict_Size": WORD(WORD),
        "PyDict_Values": WORD(WORD),
        "PyErr_BadArgument": types.int32(),
        "PyErr_Clear": types.void(),
        "PyErr_Fetch": types.void(types.CPointer(WORD), types.CPointer(WORD), types.CPointer(WORD)),
        "PyErr_NormalizeException": types.void(
            types.CPointer(WORD), types.CPointer(WORD), types.CPointer(WORD)
        ),
        "PyErr_Occurred": WORD(),
        "PyErr_Restore": types.void(WORD, WORD, WORD),
        "PyErr_SetObject": types.void(WORD, WORD),
        "PyEval_RestoreThread": types.void(WORD),
        "PyEval_SaveThread": WORD(),
        "PyException_SetTraceback": types.int32(WORD, WORD),
        "PyFloat_AsDouble": types.float64(WORD),
        "PyFloat_FromDouble": WORD(types.float64),
        "PyFunction_GetClosure": WORD(WORD),
        "PyList_Append": types.int32(WORD, WORD),
        "PyList_GetItem": WORD(WORD, WORD),
        "PyList_New": WORD(WORD),
        "PyList_SetItem": types.int32(WORD, WORD, WORD),
        "PyList_SetSlice": types.int32(WORD, WORD, WORD, WORD),
        "PyList_Size": WORD(WORD),
        "PyLong_AsLongLong": WORD(WORD),
        "PyLong_FromLongLong": WORD(WORD),
        "PyObject_GenericGetAttr": WORD(WORD, WORD),
        "PyObject_SetAttr": types.int32(WORD, WORD, WORD),
        "PyObject_Type": WORD(WORD),
        "PyObject_Vectorcall": WORD(WORD, types.CPointer(WORD), WORD, WORD),
        "PySequence_GetItem": WORD(WORD, WORD),
        "PySequence_Size": WORD(WORD),
        "PySet_Contains": types.int32(WORD, WORD),
        "PySet_Size": WORD(WORD),
        "PyThread_get_thread_ident": WORD(),
        "PyTuple_GetItem": WORD(WORD, WORD),
        "PyTuple_New": WORD(WORD),
        "PyTuple_SetItem": types.int32(WORD, WORD, WORD),
        "PyTuple_Size": WORD(WORD),
        "PyUnicode_AsUTF8AndSize": WORD(WORD, WORD),
        "PyUnicode_AsUTF8String": WORD(WORD),
        "PyUnicode_GetLength": WORD(WORD),
        "PyUnicode_ReadChar": types.uint32(WORD, WORD),
        "Py_DecRef": types.void(WORD),
        "Py_IncRef": types.void(WORD),
    }.items()
}
"""Name to function."""
