"""Commands that store settings, as machine code that a table describes; see `fast_entries`.

The table has a `Step` for each parameter. An argument that is the parameter's default object is skipped. All
others are checked first: plain numbers, or sequences of three, within bounds. Then they are stored. Anything
irregular goes to the Python function.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import ATTRIBUTE, HAS_LENGTH, ITEM, PLAIN, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature

IGNORED, REFUSED, CHECKED, INTEGER = range(4)
"""An argument that is not even checked, or never accepted; a number or an integer that is only checked."""
WHOLE, NUMBER, SHORT, ENTRY = range(4, 8)
"""An attribute that is an integer, a number or a number rounded to 32 bits; a number in the dictionary."""
TRIPLE, PLACE, COLOR, SWITCH = range(8, 12)
"""With the next two an attribute of three numbers; an attribute of three numbers rounded to 32 bits; three
numbers that are only checked; with the next one key and value of the dictionary, unless it is `most`."""
REQUIRED = object()
"""Default of a parameter without one."""
LARGEST = 3e38
"""Largest number of 32 bits, and a little less."""


class Step(NamedTuple):
    """Use of an argument; the machine code has the same order."""

    kind: int
    name: str = ""
    """Of the attribute, or the key in the dictionary."""
    default: Any = REQUIRED
    least: float = -LARGEST
    most: float = LARGEST


class Settings(NamedTuple):
    """State of a command; the machine code has the same order."""

    command: Any
    kinds: Any
    """(n,) kinds of the steps."""
    bounds: Any
    """(n, 2) bounds of the steps."""
    owner: str | None
    """Attribute of the client that has the settings; None where none are stored."""
    table: str | None
    """Attribute of the owner that is the dictionary, where one of the arguments goes there."""
    revision: str | None
    """Attribute of the owner that counts changes."""
    steps: tuple[Step, ...]
    none: None = None
    whole: int = 0
    number: float = 0.0
    required: object = REQUIRED
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read


_SOURCE = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object and of tuples, in words
COMMAND, KINDS, BOUNDS, OWNER, TABLE, REVISION, STEPS, NONE, WHOLE, NUMBER, REQUIRED, LISTED = range(3, 15)
OF_STEP, NAME, DEFAULT = range(3, 6)
{parts(ATTRIBUTE, ITEM, HAS_LENGTH, PLAIN)}
@part
def coordinate(state, values, place):
    if word(values, KIND) == word(word(state, STEPS), KIND):
        return plain(state, word(values, ITEMS + place))
    if word(values, KIND) == word(word(state, LISTED), KIND):
        return plain(state, word(word(values, ITEMS), place))
    return item(values, place)

@part
def is_triple(state, values):
    kind = word(values, KIND)
    if kind == word(word(state, STEPS), KIND) or kind == word(word(state, LISTED), KIND):
        return word(values, SIZE) == 3
    return has_length(values, 3)

@part
def accepts(state, kind, least, most, value, is_last):
    if kind == {IGNORED}:
        return True
    if kind == {REFUSED}:
        return False
    if kind == {COLOR} or kind == {PLACE}:
        if not is_triple(state, value):
            return False
        for k in range(3):
            found = coordinate(state, value, k)
            if not least <= found <= most:
                return False
        return True
    is_whole = kind == {WHOLE} or kind == {INTEGER} or kind == {SWITCH}
    if is_whole and word(value, KIND) != word(word(state, WHOLE), KIND):
        return False
    found = plain(state, value)
    if kind == {SWITCH}:
        return found >= least and found != most and not is_last
    return least <= found <= most

@part
def set_triple(owner, name, x, y, z):
    made = PyTuple_New(3)
    PyTuple_SetItem(made, 0, PyFloat_FromDouble(x))
    PyTuple_SetItem(made, 1, PyFloat_FromDouble(y))
    PyTuple_SetItem(made, 2, PyFloat_FromDouble(z))
    PyObject_SetAttr(owner, name, made)
    Py_DecRef(made)

@part
def short(value):
    return np.float64(np.float32(value))

@part
def store(state, kind, step, owner, table, given, place):
    name, value = word(step, NAME), given[place]
    if kind == {WHOLE}:
        PyObject_SetAttr(owner, name, value)
    elif kind == {NUMBER} or kind == {SHORT}:
        found = plain(state, value)
        made = PyFloat_FromDouble(short(found) if kind == {SHORT} else found)
        PyObject_SetAttr(owner, name, made)
        Py_DecRef(made)
    elif kind == {ENTRY}:
        PyDict_SetItem(table, name, value)
    elif kind == {SWITCH}:
        PyDict_SetItem(table, value, given[place + 1])
    elif kind == {TRIPLE}:
        x, y, z = given[place], given[place + 1], given[place + 2]
        set_triple(owner, name, plain(state, x), plain(state, y), plain(state, z))
    elif kind == {PLACE}:
        x, y, z = coordinate(state, value, 0), coordinate(state, value, 1), coordinate(state, value, 2)
        set_triple(owner, name, short(x), short(y), short(z))

def entry(state, given, count, keywords):
    steps = word(state, STEPS)
    kinds, bounds = integers(word(state, KINDS)), matrix(word(state, BOUNDS))
    fits = keywords == 0 and 1 < count <= word(steps, SIZE) + 1
    if fits:
        for place in range(1, word(steps, SIZE) + 1):
            step = word(steps, ITEMS + place - 1)
            if place >= count:
                fits = fits and word(step, DEFAULT) != word(state, REQUIRED)
            elif given[place] != word(step, DEFAULT):
                least, most = bounds[place - 1, 0], bounds[place - 1, 1]
                is_last = place == count - 1
                fits = fits and accepts(state, kinds[place - 1], least, most, given[place], is_last)
    if fits and word(state, OWNER) == word(state, NONE):
        Py_IncRef(word(state, NONE))
        return word(state, NONE)
    owner = attribute(given[0], word(state, OWNER)) if fits else 0
    has_table = word(state, TABLE) != word(state, NONE)
    table = attribute(owner, word(state, TABLE)) if owner != 0 and has_table else owner
    if owner == 0 or table == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    Py_IncRef(owner)
    Py_IncRef(table)
    for place in range(1, count):
        step = word(steps, ITEMS + place - 1)
        if given[place] != word(step, DEFAULT):
            store(state, kinds[place - 1], step, owner, table, given, place)
    if word(state, REVISION) != word(state, NONE):
        changes = attribute(owner, word(state, REVISION))
        made = PyLong_FromLongLong(PyLong_AsLongLong(changes) + 1)
        PyObject_SetAttr(owner, word(state, REVISION), made)
        Py_DecRef(made)
    Py_DecRef(table)
    Py_DecRef(owner)
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def settings_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


SETTINGS = Front(settings_call, EntrySignature(_SOURCE))
vars(settings_call)["front"] = SETTINGS
