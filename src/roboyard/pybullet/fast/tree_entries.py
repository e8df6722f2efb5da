"""calculateInverseDynamics and calculateMassMatrix as machine code; see `fast_entries`.

It writes the lists of numbers to an array, calls a loop with arguments that stay the same, and returns what
the loop has written.
"""

from __future__ import annotations

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS

_SOURCE = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ZERO, APPLIED, REVISION, IS_TABLE = range(3, 11)
SCENE, PARAMETERS, GIVEN, COUNTS, LOOP, ARGUMENTS, OUT = range(3, 10)

@part
def copied(into, first, values, length):
    if not has_length(values, length):
        return False
    total = 0.0
    for k in range(length):
        into[first + k] = item(values, k)
        total += into[first + k]
    return total - total == 0.0

@part
def tuple_of(values):
    made = PyTuple_New(len(values))
    for k in range(len(values)):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(values[k]))
    return made

@part
def computed(state, body, given):
    scene, parameters = word(body, SCENE), word(body, PARAMETERS)
    if scene != word(state, NONE):
        if attribute(scene, word(state, APPLIED)) != attribute(parameters, word(state, REVISION)):
            return 0
    into, counts, first = numbers(word(body, GIVEN)), word(body, COUNTS), 0
    for k in range(word(counts, SIZE)):
        length = PyLong_AsLongLong(word(counts, ITEMS + k))
        if not copied(into, first, given[2 + k], length):
            return 0
        first += length
    passed, arguments = words(), word(body, ARGUMENTS)
    for place in range(word(arguments, SIZE)):
        passed[place] = word(arguments, ITEMS + place)
    done = PyObject_Vectorcall(word(body, LOOP), passed, word(arguments, SIZE), 0)
    if done == 0:
        PyErr_Clear()
        return 0
    Py_DecRef(done)
    if word(state, IS_TABLE) != word(state, TRUE):
        return tuple_of(numbers(word(body, OUT)))
    table = matrix(word(body, OUT))
    made = PyTuple_New(len(table))
    for k in range(len(table)):
        PyTuple_SetItem(made, k, tuple_of(table[k]))
    return made

def entry(state, given, count, keywords):
    if keywords == 0 and count > 2:
        body = prepared(state, given[0], given[1])
        if body != 0:
            lists = word(word(body, COUNTS), SIZE)
            has_flags = count == lists + 3 and given[lists + 2] == word(state, ZERO)
            if has_flags or count == lists + 2:
                Py_IncRef(body)
                made = computed(state, body, given)
                Py_DecRef(body)
                if made != 0:
                    return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def tree_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


TREE = Front(tree_call, EntrySignature(_SOURCE))
vars(tree_call)["front"] = TREE
