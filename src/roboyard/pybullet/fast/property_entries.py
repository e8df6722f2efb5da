"""A command with many optional numbers as machine code: it calls a function for each number that is given.

Most calls of such a command give one or two of two dozen arguments. A call with one that is no plain number
of at least 0, or has no function, goes to the Python function of the command; see `fast_entries`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature


class Properties(NamedTuple):
    """State of a command; the machine code has the same order."""

    command: Callable[..., Any]
    changes: tuple[Callable[..., None] | None, ...]
    """By argument after the client, the body and the link: a function of these and of the number."""
    defaults: tuple[Any, ...]
    none: None = None
    whole: int = 0
    number: float = 0.0


_SOURCE = """
KIND, SIZE, ITEMS = 1, 2, 3  # of any object and of tuples, in words
COMMAND, CHANGES, DEFAULTS, NONE, WHOLE, NUMBER = range(3, 9)
FIRST = 3

@part
def is_plain(state, value):
    kind = word(value, KIND)
    if kind != word(word(state, NUMBER), KIND) and kind != word(word(state, WHOLE), KIND):
        return False
    found = PyFloat_AsDouble(value)
    if found == -1.0 and PyErr_Occurred() != 0:
        PyErr_Clear()
    return found >= 0.0 and found - found == 0.0

@part
def accepts(state, given, count):
    whole = word(word(state, WHOLE), KIND)
    if word(given[1], KIND) != whole or word(given[2], KIND) != whole:
        return False
    for place in range(FIRST, count):
        at = ITEMS + place - FIRST
        if given[place] != word(word(state, DEFAULTS), at):
            if word(word(state, CHANGES), at) == word(state, NONE) or not is_plain(state, given[place]):
                return False
    return True

def entry(state, given, count, keywords):
    fits = keywords == 0 and FIRST < count <= FIRST + word(word(state, CHANGES), SIZE)
    if not fits or not accepts(state, given, count):
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    passed = words()
    for place in range(FIRST):
        passed[place] = given[place]
    for place in range(FIRST, count):
        at = ITEMS + place - FIRST
        if given[place] != word(word(state, DEFAULTS), at):
            passed[FIRST] = given[place]
            done = PyObject_Vectorcall(word(word(state, CHANGES), at), passed, FIRST + 1, 0)
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
