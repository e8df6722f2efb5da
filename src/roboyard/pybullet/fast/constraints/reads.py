"""Reading of constraints as machine code; see `fast_entries`.

Constraints that are only requested are read from their requests, so that reading builds none.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import ATTRIBUTE, FOUND, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS
from roboyard.pybullet.state.constraint_records import BOUND

_STATE = f"""{PARTS}
COMMAND, PREPARED, NONE, TRUE, ONE, SCENE, REQUESTED, ZEROS = range(3, 11)
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

@part
def zeros(state, client, number):
    scene = attribute(client, word(state, SCENE))
    requested = attribute(scene, word(state, REQUESTED)) if scene != 0 else 0
    request = found(requested, number) if requested != 0 else 0
    made = found(word(state, ZEROS), word(word(request, ITEMS), 4)) if request != 0 else 0
    if made != 0:
        Py_IncRef(made)
    return made

def entry(state, given, count, keywords):
    if keywords == 0 and count == 2 and word(given[1], KIND) == word(word(state, ONE), KIND):
        constraint = prepared(state, given[0], given[1])
        if constraint != 0:
            Py_IncRef(constraint)
            made = read(state, constraint)
            Py_DecRef(constraint)
        else:
            made = zeros(state, given[0], given[1])
        if made != 0:
            return made
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def state_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


STATE = Front(state_call, EntrySignature(_STATE))
"""getConstraintState."""


class ReadState(NamedTuple):
    """State of the commands below; the machine code has the same order."""

    command: Any
    none: None = None
    zero: int = 0
    scene: str = "scene"
    requested: str = "requested"
    built: str = "_constraints"
    order: str = "constraint_order"
    ends: tuple[str, ...] = ("parent", "child")
    """Attributes of a record that are two fields of getConstraintInfo."""
    fields: tuple[str, ...] = (
        *("kind", "axis", "parent_position", "child_position", "parent_orientation", "child_orientation"),
        *("max_force", "gear_ratio", "gear_aux_link", "relative_position_target", "erp"),
    )
    """Attributes of a record that are the next ones."""


_READ = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words
COMMAND, NONE, ZERO, SCENE, REQUESTED, BUILT, ORDER, ENDS, FIELDS = range(3, 12)
{parts(ATTRIBUTE, FOUND, WHOLE)}
@part
def scene_of(state, given, count, keywords, wanted):
    fits = keywords == 0 and count == wanted
    if fits and wanted == 2:
        fits = word(given[1], KIND) == word(word(state, ZERO), KIND)
    return attribute(given[0], word(state, SCENE)) if fits else 0
"""
_INFO = f"""{_READ}
@part
def info_of_request(request):
    made = PyTuple_New({BOUND})
    for place in range({BOUND}):
        value = word(word(request, ITEMS), place)
        Py_IncRef(value)
        PyTuple_SetItem(made, place, value)
    return made

@part
def info_of_record(state, record):
    ends, fields = word(state, ENDS), word(state, FIELDS)
    made = PyTuple_New(2 * word(ends, SIZE) + word(fields, SIZE))
    place = 0
    for k in range(word(ends, SIZE)):
        pair = attribute(record, word(ends, ITEMS + k))
        for end in range(2):
            Py_IncRef(word(pair, ITEMS + end))
            PyTuple_SetItem(made, place, word(pair, ITEMS + end))
            place += 1
    for k in range(word(fields, SIZE)):
        value = attribute(record, word(fields, ITEMS + k))
        if value == word(state, NONE):  # no third joint of a gear
            value = word(state, ZERO)
        Py_IncRef(value)
        PyTuple_SetItem(made, place, value)
        place += 1
    return made

def entry(state, given, count, keywords):
    scene = scene_of(state, given, count, keywords, 2)
    if scene != 0:
        request = found(attribute(scene, word(state, REQUESTED)), given[1])
        if request != 0:
            return info_of_request(request)
        record = found(attribute(scene, word(state, BUILT)), given[1])
        if record != 0:
            return info_of_record(state, record)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def info_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


INFO = Front(info_call, EntrySignature(_INFO))
"""getConstraintInfo."""

_COUNT = f"""{_READ}
def entry(state, given, count, keywords):
    scene = scene_of(state, given, count, keywords, 1)
    if scene == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    return PyLong_FromLongLong(PyList_Size(attribute(scene, word(state, ORDER))))
"""


def count_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


COUNT = Front(count_call, EntrySignature(_COUNT))
"""getNumConstraints."""

_NUMBER = f"""{_READ}
def entry(state, given, count, keywords):
    scene = scene_of(state, given, count, keywords, 2)
    if scene == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    place, order = whole(given[1]), attribute(scene, word(state, ORDER))
    if not 0 <= place < PyList_Size(order):
        return PyLong_FromLongLong(-1)
    number = word(word(order, ITEMS), place)
    Py_IncRef(number)
    return number
"""


def number_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


NUMBER = Front(number_call, EntrySignature(_NUMBER))
"""getConstraintUniqueId."""

for _front in (STATE, INFO, COUNT, NUMBER):
    vars(_front.core)["front"] = _front
