"""Debug drawings as machine code; see `fast_entries`.

Lines, texts, points and sliders of numbers are stored as plain tuples, which `DebugItems` knows. Anything
else goes to the Python functions.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import (
    ATTRIBUTE,
    FOUND,
    HAS_LENGTH,
    ITEM,
    NUMBER,
    NUMBER_IN,
    PLAIN,
    TRIPLE,
    parts,
)
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.state.debug_items import MAX_POINTS, WHITE

COUNTED = f"""{parts(ATTRIBUTE, FOUND)}
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words

@part
def count_up(owner, name):
    made = PyLong_FromLongLong(PyLong_AsLongLong(attribute(owner, name)) + 1)
    PyObject_SetAttr(owner, name, made)
    Py_DecRef(made)

@part
def take(owner, name):
    number = attribute(owner, name)
    Py_IncRef(number)
    made = PyLong_FromLongLong(PyLong_AsLongLong(number) + 1)
    PyObject_SetAttr(owner, name, made)
    Py_DecRef(made)
    return number
"""


class ItemState(NamedTuple):
    """State of addUserDebugLine and addUserDebugText; the machine code has the same order."""

    command: Any
    clock: Any
    """Returns the time on which items expire (s)."""
    parent: int
    """The default."""
    white: tuple[float, float, float] = WHITE
    width: float = 1.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    owner: str = "debug_items"
    table: str = "_items"
    ids: str = "_ids"
    following: str = "_next"
    revision: str = "revision"
    none: None = None
    text: str = ""
    empty: Any = np.empty


_ITEM = f"""{COUNTED}
COMMAND, CLOCK, PARENT, WHITE, WIDTH, LISTED, OWNER, TABLE, IDS, NEXT, REVISION = range(3, 14)
NONE, TEXT, EMPTY = range(14, 17)
NUMBER, WHOLE, TUPLE = WIDTH, PARENT, WHITE
{parts(PLAIN, ITEM, HAS_LENGTH, TRIPLE, NUMBER, NUMBER_IN)}
@part
def triple_of_sequence(values):
    if not has_length(values, 3):
        return 0
    x, y, z = item(values, 0), item(values, 1), item(values, 2)
    total = x + y + z
    if total - total != 0.0:
        return 0
    return triple(x, y, z)

@part
def has_parent(state, given, count, at):
    whole = word(word(state, PARENT), KIND)
    for place in range(at, min(count, at + 2)):
        if word(given[place], KIND) != whole:
            return False
    return True

@part
def set_parent(state, made, place, given, count, at):
    if count <= at or given[at] == word(state, PARENT):
        Py_IncRef(word(state, NONE))
        PyTuple_SetItem(made, place, word(state, NONE))
        return
    if PyLong_AsLongLong(given[at]) < 0:
        PyErr_Clear()
        Py_IncRef(word(state, NONE))
        PyTuple_SetItem(made, place, word(state, NONE))
        return
    parent, link = PyTuple_New(2), word(state, PARENT)
    if count > at + 1:
        link = given[at + 1]
    Py_IncRef(given[at])
    Py_IncRef(link)
    PyTuple_SetItem(parent, 0, given[at])
    PyTuple_SetItem(parent, 1, link)
    PyTuple_SetItem(made, place, parent)

@part
def end_of(state, given, count, at):
    seconds = plain(state, given[at]) if count > at else 0.0
    if seconds - seconds != 0.0:
        return 0
    if seconds <= 0.0:
        Py_IncRef(word(state, NONE))
        return word(state, NONE)
    now = PyObject_Vectorcall(word(state, CLOCK), words(), 0, 0)
    if now == 0:
        PyErr_Clear()
        return 0
    made = PyFloat_FromDouble(PyFloat_AsDouble(now) + seconds)
    Py_DecRef(now)
    return made

@part
def triple_of(state, values):
    is_tuple = word(values, KIND) == word(word(state, WHITE), KIND)
    if not is_tuple and word(values, KIND) != word(word(state, LISTED), KIND):
        return triple_of_sequence(values)
    if word(values, SIZE) != 3:
        return 0
    made, total = PyTuple_New(3), 0.0
    for place in range(3):
        value = held(state, values, place)
        size = plain(state, value) if value != 0 else np.nan
        if size != size:
            size, value = number_in(state, values, place), 0  # whose function may free the object
        total += size
        if value != 0 and word(value, KIND) == word(word(state, NUMBER), KIND):
            Py_IncRef(value)
        else:
            value = PyFloat_FromDouble(size)
        PyTuple_SetItem(made, place, value)
    if total - total != 0.0:
        Py_DecRef(made)
        return 0
    return made

@part
def store(state, items, made, replaced):
    table = attribute(items, word(state, TABLE))
    number = replaced if replaced != 0 and found(table, replaced) != 0 else 0
    if number == 0:
        number = take(attribute(items, word(state, IDS)), word(state, NEXT))
    else:
        Py_IncRef(number)
    PyDict_SetItem(table, number, made)
    Py_DecRef(made)
    count_up(items, word(state, REVISION))
    Py_DecRef(items)
    return number
"""
_LINE = f"""{_ITEM}
@part
def line(state, given, count):
    start = triple_of(state, given[1])
    end = triple_of(state, given[2]) if start != 0 else 0
    color, width = 0, np.nan
    if end != 0:
        if count > 3 and given[3] != word(state, WHITE):
            color = triple_of(state, given[3])
        else:
            color = word(state, WHITE)
            Py_IncRef(color)
        width = plain(state, given[4]) if count > 4 else 1.0
    ending = end_of(state, given, count, 5) if color != 0 and width - width == 0.0 else 0
    if ending == 0:
        if start != 0:
            Py_DecRef(start)
        if end != 0:
            Py_DecRef(end)
        if color != 0:
            Py_DecRef(color)
        return 0
    made = PyTuple_New(6)
    PyTuple_SetItem(made, 0, start)
    PyTuple_SetItem(made, 1, end)
    PyTuple_SetItem(made, 2, color)
    PyTuple_SetItem(made, 3, PyFloat_FromDouble(width))
    set_parent(state, made, 4, given, count, 6)
    PyTuple_SetItem(made, 5, ending)
    return made

def entry(state, given, count, keywords):
    fits = keywords == 0 and 3 <= count <= 9
    fits = fits and has_parent(state, given, count, 6)
    if count > 8:
        fits = fits and word(given[8], KIND) == word(word(state, PARENT), KIND)
    items = attribute(given[0], word(state, OWNER)) if fits else 0
    made = 0
    if items != 0:
        Py_IncRef(items)  # reading a number may reset the simulation
        made = line(state, given, count)
    if made == 0:
        if items != 0:
            Py_DecRef(items)
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    return store(state, items, made, given[8] if count > 8 else 0)
"""


def line_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


LINE = Front(line_call, EntrySignature(_LINE))
"""addUserDebugLine."""


_TEXT = f"""{_ITEM}
@part
def turn(state, values):
    if values == word(state, NONE):
        Py_IncRef(values)
        return values
    if not has_length(values, 4):
        return 0
    x, y, z, w = item(values, 0), item(values, 1), item(values, 2), item(values, 3)
    total = x + y + z + w
    if total - total != 0.0:
        return 0
    made = PyTuple_New(4)
    PyTuple_SetItem(made, 0, PyFloat_FromDouble(x))
    PyTuple_SetItem(made, 1, PyFloat_FromDouble(y))
    PyTuple_SetItem(made, 2, PyFloat_FromDouble(z))
    PyTuple_SetItem(made, 3, PyFloat_FromDouble(w))
    return made

@part
def text(state, given, count):
    if word(given[1], KIND) != word(word(state, TEXT), KIND):
        return 0
    size = plain(state, given[4]) if count > 4 else 1.0
    if size - size != 0.0:
        return 0
    position, color = triple_of(state, given[2]), 0
    if position != 0 and count > 3 and given[3] != word(state, WHITE):
        color = triple_of(state, given[3])
    elif position != 0:
        color = word(state, WHITE)
        Py_IncRef(color)
    turned = turn(state, given[6] if count > 6 else word(state, NONE)) if color != 0 else 0
    ending = end_of(state, given, count, 5) if turned != 0 else 0
    if ending == 0:
        if position != 0:
            Py_DecRef(position)
        if color != 0:
            Py_DecRef(color)
        if turned != 0:
            Py_DecRef(turned)
        return 0
    made = PyTuple_New(7)
    Py_IncRef(given[1])
    PyTuple_SetItem(made, 0, given[1])
    PyTuple_SetItem(made, 1, position)
    PyTuple_SetItem(made, 2, color)
    PyTuple_SetItem(made, 3, PyFloat_FromDouble(size))
    PyTuple_SetItem(made, 4, turned)
    set_parent(state, made, 5, given, count, 7)
    PyTuple_SetItem(made, 6, ending)
    return made

def entry(state, given, count, keywords):
    fits = keywords == 0 and 3 <= count <= 10
    fits = fits and has_parent(state, given, count, 7)
    if count > 9:
        fits = fits and word(given[9], KIND) == word(word(state, PARENT), KIND)
    items = attribute(given[0], word(state, OWNER)) if fits else 0
    made = 0
    if items != 0:
        Py_IncRef(items)  # reading a number may reset the simulation
        made = text(state, given, count)
    if made == 0:
        if items != 0:
            Py_DecRef(items)
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    return store(state, items, made, given[9] if count > 9 else 0)
"""


def text_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


TEXT = Front(text_call, EntrySignature(_TEXT))
"""addUserDebugText."""


_POINTS = f"""{_ITEM}
@part
def size_of(state, values):
    kind = word(values, KIND)
    is_tuple = kind == word(word(state, WHITE), KIND)
    return word(values, SIZE) if is_tuple or kind == word(word(state, LISTED), KIND) else -1

@part
def start_of(state, values):
    is_tuple = word(values, KIND) == word(word(state, WHITE), KIND)
    return values + 8 * ITEMS if is_tuple else word(values, ITEMS)

@part
def is_read(state, rows, into):
    if size_of(state, rows) != len(into):
        return False
    first, total = start_of(state, rows), 0.0
    for row in range(len(into)):
        values = word(first, row)
        if size_of(state, values) != 3:
            return False
        start = start_of(state, values)
        for k in range(3):
            into[row, k] = plain(state, word(start, k))
            total += into[row, k]
    return total - total == 0.0

@part
def array_of(state, rows, length):
    passed, shape = words(), PyTuple_New(2)
    PyTuple_SetItem(shape, 0, PyLong_FromLongLong(length))
    PyTuple_SetItem(shape, 1, PyLong_FromLongLong(3))
    passed[0] = shape
    made = PyObject_Vectorcall(word(state, EMPTY), passed, 1, 0)
    Py_DecRef(shape)
    if made == 0:
        PyErr_Clear()
        return 0
    if is_read(state, rows, matrix(made)):
        return made
    Py_DecRef(made)
    return 0

@part
def points(state, given, count):
    length = size_of(state, given[1])
    if not 0 < length <= {MAX_POINTS} or size_of(state, given[2]) != length:
        return 0
    size = plain(state, given[3]) if count > 3 else 1.0
    if size - size != 0.0:
        return 0
    positions = array_of(state, given[1], length)
    colors = array_of(state, given[2], length) if positions != 0 else 0
    ending = end_of(state, given, count, 4) if colors != 0 else 0
    if ending == 0:
        if positions != 0:
            Py_DecRef(positions)
        if colors != 0:
            Py_DecRef(colors)
        return 0
    made = PyTuple_New(5)
    PyTuple_SetItem(made, 0, positions)
    PyTuple_SetItem(made, 1, colors)
    PyTuple_SetItem(made, 2, PyFloat_FromDouble(size))
    set_parent(state, made, 3, given, count, 5)
    PyTuple_SetItem(made, 4, ending)
    return made

def entry(state, given, count, keywords):
    fits = keywords == 0 and 3 <= count <= 8
    fits = fits and has_parent(state, given, count, 5)
    if count > 7:
        fits = fits and word(given[7], KIND) == word(word(state, PARENT), KIND)
    items = attribute(given[0], word(state, OWNER)) if fits else 0
    made = 0
    if items != 0:
        Py_IncRef(items)  # reading a number may reset the simulation
        made = points(state, given, count)
    if made == 0:
        if items != 0:
            Py_DecRef(items)
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    return store(state, items, made, given[7] if count > 7 else 0)
"""


def points_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


POINTS = Front(points_call, EntrySignature(_POINTS))
"""addUserDebugPoints."""


class SliderState(NamedTuple):
    """State of addUserDebugParameter; the machine code has the same order."""

    command: Any
    defaults: tuple[float, ...]
    whole: int = 0
    number: float = 0.0
    text: str = ""
    owner: str = "debug_items"
    table: str = "_parameters"
    ids: str = "_ids"
    following: str = "_next"
    revision: str = "revision"


_SLIDER = f"""{COUNTED}
COMMAND, DEFAULTS, WHOLE, NUMBER, TEXT, OWNER, TABLE, IDS, NEXT, REVISION = range(3, 13)
{parts(PLAIN)}
@part
def slider(state, given, count):
    total, name = 0.0, given[1]
    for place in range(2, count):
        total += plain(state, given[place])
    if word(name, KIND) != word(word(state, TEXT), KIND) or total - total != 0.0:
        return 0
    made = PyTuple_New(4)
    Py_IncRef(name)
    PyTuple_SetItem(made, 0, name)
    for place in range(2, 5):
        value = given[place] if place < count else word(word(state, DEFAULTS), ITEMS + place - 2)
        PyTuple_SetItem(made, place - 1, PyFloat_FromDouble(plain(state, value)))
    return made

def entry(state, given, count, keywords):
    items = attribute(given[0], word(state, OWNER)) if keywords == 0 and 2 <= count <= 5 else 0
    made = slider(state, given, count) if items != 0 else 0
    if made == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    number = take(attribute(items, word(state, IDS)), word(state, NEXT))
    PyDict_SetItem(attribute(items, word(state, TABLE)), number, made)
    Py_DecRef(made)
    count_up(items, word(state, REVISION))
    return number
"""


def slider_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


SLIDER = Front(slider_call, EntrySignature(_SLIDER))
"""addUserDebugParameter."""


class RemovalState(NamedTuple):
    """State of removeUserDebugItem; the machine code has the same order."""

    command: Any
    none: None = None
    whole: int = 0
    owner: str = "debug_items"
    table: str = "_items"
    parameters: str = "_parameters"
    revision: str = "revision"


_REMOVAL = f"""{COUNTED}
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


for _front in (LINE, TEXT, POINTS, SLIDER, REMOVAL):
    vars(_front.core)["front"] = _front
