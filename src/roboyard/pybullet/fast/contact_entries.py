"""getContactPoints as machine code, for contacts of the last step where it is known where its rows are.

A compiled loop selects the contacts and writes their numbers, of which this makes tuples. Contacts that were
kept through an edit, or filtered since the step, go to the Python function; see `fast_entries`.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.fast_entries import PARTS


class ContactState(NamedTuple):
    """State of the command; the machine code has the same order."""

    command: Any
    prepared: Any
    none: None = None
    zero: int = 0
    """Also the key of what is prepared of the whole scene."""
    any_body: int = -1
    any_link: int = -2
    contacts: str = "_contacts"
    seen: str = "_seen"
    filtered: str = "filtered"
    last_rows: str = "last"
    parts: str = "parts"
    nothing: tuple[()] = ()


_SOURCE = f"""{PARTS}
COMMAND, PREPARED, NONE, ZERO, ANY_BODY, ANY_LINK = range(3, 9)
CONTACTS, SEEN, FILTERED, ROWS_NAME, PARTS_NAME, NOTHING = range(9, 15)
SCENE, LAST, OWN, ROWS, LOOP, BUNDLE, NUMBERS, LINKS = range(3, 11)
WIDTH = 4  # of a row of links

@part
def number(values, row, column):
    return PyFloat_FromDouble(values[row, column])

@part
def triple(values, row, first):
    made = PyTuple_New(3)
    for k in range(3):
        PyTuple_SetItem(made, k, PyFloat_FromDouble(values[row, first + k]))
    return made

@part
def point(state, values, links, row):
    made = PyTuple_New(14)
    Py_IncRef(word(state, ZERO))
    PyTuple_SetItem(made, 0, word(state, ZERO))
    for k in range(WIDTH):
        PyTuple_SetItem(made, 1 + k, PyLong_FromLongLong(links[WIDTH * row + k]))
    PyTuple_SetItem(made, 5, triple(values, row, 0))
    PyTuple_SetItem(made, 6, triple(values, row, 3))
    PyTuple_SetItem(made, 7, triple(values, row, 6))
    PyTuple_SetItem(made, 8, number(values, row, 9))
    PyTuple_SetItem(made, 9, number(values, row, 10))
    PyTuple_SetItem(made, 10, number(values, row, 11))
    PyTuple_SetItem(made, 11, triple(values, row, 12))
    PyTuple_SetItem(made, 12, number(values, row, 15))
    PyTuple_SetItem(made, 13, triple(values, row, 16))
    return made

@part
def is_known(state, scene):
    last, own = word(scene, LAST), word(scene, OWN)
    if attribute(last, word(state, CONTACTS)) != word(state, NONE):
        return False
    if attribute(last, word(state, SEEN)) != word(state, NONE):
        return False
    filtered = attribute(last, word(state, FILTERED))
    if filtered == 0 or PyDict_Size(filtered) != 0:
        return False
    return attribute(own, word(state, ROWS_NAME)) == word(scene, ROWS)

@part
def listed(state, scene, given, count):
    passed = words()
    passed[0] = word(scene, BUNDLE)
    passed[1] = attribute(word(scene, SCENE), word(state, PARTS_NAME))
    for place in range(4):
        passed[2 + place] = word(state, ANY_BODY if place < 2 else ANY_LINK)
        if place + 1 < count:
            passed[2 + place] = given[place + 1]
            if word(given[place + 1], KIND) != word(word(state, ZERO), KIND):
                return -1
    if passed[1] == 0:
        return -1
    done = PyObject_Vectorcall(word(scene, LOOP), passed, 6, 0)
    if done == 0:
        PyErr_Clear()
        return -1
    found = PyLong_AsLongLong(done)
    Py_DecRef(done)
    return found

def entry(state, given, count, keywords):
    scene = prepared(state, given[0], word(state, ZERO)) if keywords == 0 and 1 <= count <= 5 else 0
    if scene != 0 and is_known(state, scene):
        Py_IncRef(scene)
        found = listed(state, scene, given, count)
        if found == 0:
            Py_DecRef(scene)
            Py_IncRef(word(state, NOTHING))
            return word(state, NOTHING)
        if found > 0:
            values, links = matrix(word(scene, NUMBERS)), integers(word(scene, LINKS))
            made = PyTuple_New(found)
            for row in range(found):
                PyTuple_SetItem(made, row, point(state, values, links, row))
            Py_DecRef(scene)
            return made
        Py_DecRef(scene)
    return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
"""


def contact_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


CONTACT = Front(contact_call, EntrySignature(_SOURCE))
"""getContactPoints."""
vars(contact_call)["front"] = CONTACT
