"""A command with many optional arguments as machine code: it calls a function for each one that is given.

Most calls of such a command give one or two of two dozen arguments. A call with one that is neither a
plain number of at least 0 nor a list or tuple of plain numbers, as its function takes, or that has no
function, goes to the Python function of the command; see `fast_entries`. An argument that is as it was,
which scripts often repeat, calls nothing where the state names the attribute that holds it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.entry_parts import ATTRIBUTE, FOUND, PLAIN, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature


class Properties(NamedTuple):
    """State of a command; the machine code has the same order."""

    command: Callable[..., Any]
    changes: tuple[Callable[..., None] | None, ...]
    """By optional argument: a function of the client, the first arguments and this one."""
    lengths: tuple[int, ...]
    """0 where that is a number; else of its numbers, which the function gets as a tuple of floats."""
    defaults: tuple[Any, ...]
    first: int
    """Number of the first arguments, which are integers, with the client."""
    records: str | None = None
    """Attribute of the scene that is a dictionary of records by the first integer."""
    present: tuple[str | None, ...] = ()
    """By optional argument: attribute of the record with its present number, or tuple of numbers."""
    scene: str = "scene"
    none: None = None
    whole: int = 0
    number: float = 0.0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read


_SOURCE = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object and of tuples, in words
COMMAND, CHANGES, LENGTHS, DEFAULTS, FIRST, RECORDS, PRESENT, SCENE = range(3, 11)
NONE, WHOLE, NUMBER, LISTED = range(11, 15)
{parts(PLAIN, ATTRIBUTE, FOUND)}
@part
def number_of(state, values, place):
    is_list = word(values, KIND) == word(word(state, LISTED), KIND)
    return plain(state, word(word(values, ITEMS), place) if is_list else word(values, ITEMS + place))

@part
def has_numbers(state, values, length):
    kind = word(values, KIND)
    if kind != word(word(state, LISTED), KIND) and kind != word(word(state, CHANGES), KIND):
        return False
    if word(values, SIZE) != length:
        return False
    total = 0.0
    for place in range(length):
        found = number_of(state, values, place)
        total += found * found
    return total - total == 0.0

@part
def fits_change(state, at, value):
    if word(word(state, CHANGES), at) == word(state, NONE):
        return False
    length = PyLong_AsLongLong(word(word(state, LENGTHS), at))
    if length > 0:
        return has_numbers(state, value, length)
    found = plain(state, value)
    return found >= 0.0 and found - found == 0.0

@part
def accepts(state, given, count, first):
    for place in range(1, first):
        if word(given[place], KIND) != word(word(state, WHOLE), KIND):
            return False
    for place in range(first, count):
        at = ITEMS + place - first
        if given[place] != word(word(state, DEFAULTS), at):
            if not fits_change(state, at, given[place]):
                return False
    return True

@part
def record_of(state, given):
    if word(state, RECORDS) == word(state, NONE):
        return 0
    scene = attribute(given[0], word(state, SCENE))
    records = attribute(scene, word(state, RECORDS)) if scene != 0 else 0
    return found(records, given[1]) if records != 0 else 0

@part
def is_present(state, record, at, value, length):
    name = word(word(state, PRESENT), at)
    present = attribute(record, name) if name != word(state, NONE) else 0
    if present == 0:
        return False
    if length == 0:
        is_number = word(present, KIND) == word(word(state, NUMBER), KIND)
        return is_number and PyFloat_AsDouble(present) == plain(state, value)
    if word(present, KIND) != word(word(state, CHANGES), KIND) or word(present, SIZE) != length:
        return False
    for k in range(length):
        if plain(state, word(present, ITEMS + k)) != number_of(state, value, k):
            return False
    return True

def entry(state, given, count, keywords):
    first = PyLong_AsLongLong(word(state, FIRST))
    fits = keywords == 0 and first < count <= first + word(word(state, CHANGES), SIZE)
    if not fits or not accepts(state, given, count, first):
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    record = record_of(state, given)
    passed = words()
    for place in range(first):
        passed[place] = given[place]
    for place in range(first, count):
        at = ITEMS + place - first
        if given[place] != word(word(state, DEFAULTS), at):
            value = given[place]
            length = PyLong_AsLongLong(word(word(state, LENGTHS), at))
            if record != 0 and is_present(state, record, at, value, length):
                continue
            if length > 0:
                made = PyTuple_New(length)
                for k in range(length):
                    PyTuple_SetItem(made, k, PyFloat_FromDouble(number_of(state, value, k)))
                value = made
            else:
                Py_IncRef(value)
            passed[first] = value
            done = PyObject_Vectorcall(word(word(state, CHANGES), at), passed, first + 1, 0)
            Py_DecRef(value)
            if done == 0:
                return 0
            Py_DecRef(done)
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def property_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


PROPERTIES = Front(property_call, EntrySignature(_SOURCE))
vars(property_call)["front"] = PROPERTIES
