"""User data as machine code; see `fast_entries`.

User data that is there gets another value. Anything else goes to the Python functions.
"""

from __future__ import annotations

from typing import Any

from roboyard._records import NamedTuple
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.fast.item_entries import COUNTED


class DataState(NamedTuple):
    """State of the commands of user data; the machine code has the same order."""

    command: Any
    nowhere: int = -1
    """Link and visual shape that are not given."""
    text: str = ""
    scene: str = "scene"
    bodies: str = "bodies"
    owner: str = "user_data"
    numbers: str = "_numbers"
    values: str = "_values"
    keys: str = "_keys"
    ids: str = "_ids"
    following: str = "_next"
    free: str = "_free"
    none: None = None


_KEYED = f"""{COUNTED}
COMMAND, NOWHERE, TEXT, SCENE, BODIES, OWNER, NUMBERS, VALUES, KEYS, IDS, NEXT, FREE, NONE = range(3, 16)

@part
def key_of(state, given, count, link_at):
    link = given[link_at] if count > link_at else word(state, NOWHERE)
    shape = given[link_at + 1] if count > link_at + 1 else word(state, NOWHERE)
    whole = word(word(state, NOWHERE), KIND)
    if word(given[1], KIND) != whole or word(link, KIND) != whole or word(shape, KIND) != whole:
        return 0
    if word(given[2], KIND) != word(word(state, TEXT), KIND):
        return 0
    key, parts = PyTuple_New(4), (given[1], link, shape, given[2])
    for place in range(4):
        Py_IncRef(parts[place])
        PyTuple_SetItem(key, place, parts[place])
    return key
"""
_DATA = f"""{_KEYED}
@part
def has_body(state, given):
    scene = attribute(given[0], word(state, SCENE))
    bodies = attribute(scene, word(state, BODIES)) if scene != 0 else 0
    return bodies != 0 and found(bodies, given[1]) != 0

@part
def new_number(state, data, key):
    ids = attribute(data, word(state, IDS))
    free, number = attribute(ids, word(state, FREE)), 0
    count = PyList_Size(free)
    if count > 0:
        number = PyList_GetItem(free, count - 1)
        Py_IncRef(number)
        PyList_SetSlice(free, count - 1, count, 0)
    else:
        number = take(ids, word(state, NEXT))
    PyDict_SetItem(attribute(data, word(state, NUMBERS)), key, number)
    PyDict_SetItem(attribute(data, word(state, KEYS)), number, key)
    return number

def entry(state, given, count, keywords):
    data = attribute(given[0], word(state, OWNER)) if keywords == 0 and 4 <= count <= 6 else 0
    key = value = 0
    if data != 0 and word(given[3], KIND) == word(word(state, TEXT), KIND) and has_body(state, given):
        key = key_of(state, given, count, 4)
    if key != 0:
        value = PyUnicode_AsUTF8String(given[3])
    if value == 0:
        if key != 0:
            PyErr_Clear()
            Py_DecRef(key)
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    number = found(attribute(data, word(state, NUMBERS)), key)
    if number == 0:
        number = new_number(state, data, key)
    else:
        Py_IncRef(number)
    PyDict_SetItem(attribute(data, word(state, VALUES)), number, value)
    Py_DecRef(value)
    Py_DecRef(key)
    return number
"""
_DATA_ID = f"""{_KEYED}
def entry(state, given, count, keywords):
    data = attribute(given[0], word(state, OWNER)) if keywords == 0 and 3 <= count <= 5 else 0
    key = key_of(state, given, count, 3) if data != 0 else 0
    if key == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    number = found(attribute(data, word(state, NUMBERS)), key)
    Py_DecRef(key)
    if number == 0:
        number = word(state, NOWHERE)
    Py_IncRef(number)
    return number
"""
_DATA_VALUE = f"""{_KEYED}
def entry(state, given, count, keywords):
    fits = keywords == 0 and count == 2 and word(given[1], KIND) == word(word(state, NOWHERE), KIND)
    data = attribute(given[0], word(state, OWNER)) if fits else 0
    if data == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    value = found(attribute(data, word(state, VALUES)), given[1])
    if value == 0:
        value = word(state, NONE)
    Py_IncRef(value)
    return value
"""
_DATA_REMOVAL = f"""{_KEYED}
def entry(state, given, count, keywords):
    fits = keywords == 0 and count == 2 and word(given[1], KIND) == word(word(state, NOWHERE), KIND)
    data = attribute(given[0], word(state, OWNER)) if fits else 0
    keys = attribute(data, word(state, KEYS)) if data != 0 else 0
    key = found(keys, given[1]) if keys != 0 else 0
    if key == 0:
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    Py_IncRef(key)
    PyDict_DelItem(keys, given[1])
    PyDict_DelItem(attribute(data, word(state, NUMBERS)), key)
    PyDict_DelItem(attribute(data, word(state, VALUES)), given[1])
    Py_DecRef(key)
    PyList_Append(attribute(attribute(data, word(state, IDS)), word(state, FREE)), given[1])
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def data_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


def data_id_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


def data_value_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


def data_removal_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


DATA = Front(data_call, EntrySignature(_DATA))
"""addUserData."""
DATA_ID = Front(data_id_call, EntrySignature(_DATA_ID))
"""getUserDataId."""
DATA_VALUE = Front(data_value_call, EntrySignature(_DATA_VALUE))
"""getUserData."""
DATA_REMOVAL = Front(data_removal_call, EntrySignature(_DATA_REMOVAL))
"""removeUserData."""

for _front in (DATA, DATA_ID, DATA_VALUE, DATA_REMOVAL):
    vars(_front.core)["front"] = _front
