"""Debug lines and user data as machine code; see `fast_entries`.

Lines in the world that do not expire, of plain numbers, are stored as plain tuples, which `DebugItems` knows.
User data that is there gets another value. Anything else goes to the Python functions.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import ATTRIBUTE, FOUND, PLAIN, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.state.debug_items import WHITE

_PARTS = f"""{parts(ATTRIBUTE, FOUND)}
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words

@part
def count_up(owner, name):
    made = PyLong_FromLongLong(PyLong_AsLongLong(attribute(owner, name)) + 1)
    PyObject_SetAttr(owner, name, made)
    Py_DecRef(made)
"""


class LineState(NamedTuple):
    """State of addUserDebugLine; the machine code has the same order."""

    command: Any
    life_time: float
    """The default, and that of the next one."""
    parent: int
    white: tuple[float, float, float] = WHITE
    width: float = 1.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    owner: str = "debug_items"
    table: str = "_items"
    ids: str = "_ids"
    following: str = "_next"
    revision: str = "revision"


_LINE = f"""{_PARTS}
COMMAND, LIFE_TIME, PARENT, WHITE, WIDTH, LISTED, OWNER, TABLE, IDS, NEXT, REVISION = range(3, 14)
NUMBER, WHOLE = WIDTH, PARENT
{parts(PLAIN)}
@part
def triple(state, values):
    is_tuple = word(values, KIND) == word(word(state, WHITE), KIND)
    if not is_tuple and word(values, KIND) != word(word(state, LISTED), KIND):
        return 0
    if word(values, SIZE) != 3:
        return 0
    first = ITEMS if is_tuple else 0
    start = values if is_tuple else word(values, ITEMS)
    made, total = PyTuple_New(3), 0.0
    for place in range(3):
        value = word(start, first + place)
        size = plain(state, value)
        total += size
        if word(value, KIND) == word(word(state, NUMBER), KIND):
            Py_IncRef(value)
        else:
            value = PyFloat_FromDouble(size)
        PyTuple_SetItem(made, place, value)
    if total - total != 0.0:
        Py_DecRef(made)
        return 0
    return made

@part
def line(state, given, count):
    start = triple(state, given[1])
    end = triple(state, given[2]) if start != 0 else 0
    color, width = 0, np.nan
    if end != 0:
        if count > 3 and given[3] != word(state, WHITE):
            color = triple(state, given[3])
        else:
            color = word(state, WHITE)
            Py_IncRef(color)
        width = plain(state, given[4]) if count > 4 else 1.0
    if color == 0 or width - width != 0.0:
        if start != 0:
            Py_DecRef(start)
        if end != 0:
            Py_DecRef(end)
        if color != 0:
            Py_DecRef(color)
        return 0
    made = PyTuple_New(4)
    PyTuple_SetItem(made, 0, start)
    PyTuple_SetItem(made, 1, end)
    PyTuple_SetItem(made, 2, color)
    PyTuple_SetItem(made, 3, PyFloat_FromDouble(width))
    return made

def entry(state, given, count, keywords):
    fits = keywords == 0 and 3 <= count <= 9
    if count > 5:
        fits = fits and given[5] == word(state, LIFE_TIME)
    if count > 6:
        fits = fits and given[6] == word(state, PARENT)
    if count > 8:
        fits = fits and word(given[8], KIND) == word(word(state, PARENT), KIND)
    items = attribute(given[0], word(state, OWNER)) if fits else 0
    made = line(state, given, count) if items != 0 else 0
    if made == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    table = attribute(items, word(state, TABLE))
    number = given[8] if count > 8 and found(table, given[8]) != 0 else 0
    if number == 0:
        ids = attribute(items, word(state, IDS))
        number = attribute(ids, word(state, NEXT))
        Py_IncRef(number)
        count_up(ids, word(state, NEXT))
    else:
        Py_IncRef(number)
    PyDict_SetItem(table, number, made)
    Py_DecRef(made)
    count_up(items, word(state, REVISION))
    return number
"""


def line_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


LINE = Front(line_call, EntrySignature(_LINE))
"""addUserDebugLine."""


class RemovalState(NamedTuple):
    """State of removeUserDebugItem; the machine code has the same order."""

    command: Any
    none: None = None
    whole: int = 0
    owner: str = "debug_items"
    table: str = "_items"
    parameters: str = "parameters"
    revision: str = "revision"


_REMOVAL = f"""{_PARTS}
COMMAND, NONE, WHOLE, OWNER, TABLE, PARAMETERS, REVISION = range(3, 10)

def entry(state, given, count, keywords):
    fits = keywords == 0 and count == 2 and word(given[1], KIND) == word(word(state, WHOLE), KIND)
    items = attribute(given[0], word(state, OWNER)) if fits else 0
    if items == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    table = attribute(items, word(state, TABLE))
    if found(table, given[1]) == 0:  # ids are of one counter: in one of the two
        table = attribute(items, word(state, PARAMETERS))
    if found(table, given[1]) != 0:
        PyDict_DelItem(table, given[1])
    count_up(items, word(state, REVISION))
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def removal_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


REMOVAL = Front(removal_call, EntrySignature(_REMOVAL))
"""removeUserDebugItem."""


class DataState(NamedTuple):
    """State of addUserData; the machine code has the same order."""

    command: Any
    nowhere: int = -1
    """Link and visual shape that are not given."""
    text: str = ""
    scene: str = "scene"
    bodies: str = "bodies"
    owner: str = "user_data"
    numbers: str = "_numbers"
    values: str = "_values"


_DATA = f"""{_PARTS}
COMMAND, NOWHERE, TEXT, SCENE, BODIES, OWNER, NUMBERS, VALUES = range(3, 11)

@part
def number_of(state, data, given, count):
    link = given[4] if count > 4 else word(state, NOWHERE)
    shape = given[5] if count > 5 else word(state, NOWHERE)
    whole, text = word(word(state, NOWHERE), KIND), word(word(state, TEXT), KIND)
    if word(given[1], KIND) != whole or word(link, KIND) != whole or word(shape, KIND) != whole:
        return 0
    if word(given[2], KIND) != text or word(given[3], KIND) != text:
        return 0
    scene = attribute(given[0], word(state, SCENE))
    bodies = attribute(scene, word(state, BODIES)) if scene != 0 else 0
    if bodies == 0 or found(bodies, given[1]) == 0:
        return 0
    key, parts = PyTuple_New(4), (given[1], link, shape, given[2])
    for place in range(4):
        Py_IncRef(parts[place])
        PyTuple_SetItem(key, place, parts[place])
    number = found(attribute(data, word(state, NUMBERS)), key)
    Py_DecRef(key)
    return number

def entry(state, given, count, keywords):
    data = attribute(given[0], word(state, OWNER)) if keywords == 0 and 4 <= count <= 6 else 0
    number = number_of(state, data, given, count) if data != 0 else 0
    value = PyUnicode_AsUTF8String(given[3]) if number != 0 else 0
    if value == 0:
        if number != 0:
            PyErr_Clear()
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    PyDict_SetItem(attribute(data, word(state, VALUES)), number, value)
    Py_DecRef(value)
    Py_IncRef(number)
    return number
"""


def data_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


DATA = Front(data_call, EntrySignature(_DATA))
"""addUserData."""

for _front in (LINE, REMOVAL, DATA):
    vars(_front.core)["front"] = _front
