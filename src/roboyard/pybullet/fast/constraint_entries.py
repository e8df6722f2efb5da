"""getConstraintState as machine code; see `fast_entries`."""

from __future__ import annotations

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS

_SOURCE = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE = range(3, 8)
LOOP, ARGUMENTS, OUT = range(3, 6)

@part
def read(state, constraint):
    passed, arguments = words(), word(constraint, ARGUMENTS)
    for place in range(word(arguments, SIZE)):
        passed[place] = word(arguments, ITEMS + place)
    done = PyObject_Vectorcall(word(constraint, LOOP), passed, word(arguments, SIZE), 0)
    if done == 0:
        PyErr_Clear()
        return 0
    is_found = PyLong_AsLongLong(done) == 1
    Py_DecRef(done)
    if not is_found:
        return 0
    values = numbers(word(constraint, OUT))
    made = PyTuple_New(len(values))
    for k in range(len(values)):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(values[k]))
    return made

def entry(state, given, count, keywords):
    if keywords == 0 and count == 2 and word(given[1], KIND) == word(word(state, ONE), KIND):
        constraint = prepared(state, given[0], given[1])
        if constraint != 0:
            Py_IncRef(constraint)
            made = read(state, constraint)
            Py_DecRef(constraint)
            if made != 0:
                return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def constraint_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


CONSTRAINT = Front(constraint_call, EntrySignature(_SOURCE))
vars(constraint_call)["front"] = CONSTRAINT
