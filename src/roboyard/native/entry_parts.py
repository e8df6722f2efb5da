"""Source of what several entries in machine code do with objects of Python; see `EntrySignature`."""

from __future__ import annotations

NO_INDEX = -(2**62)
"""An integer that is no index, not even that of a base, in place of what is none of 64 bits."""
ITEM = """
def item(given, place):
    found = PySequence_GetItem(given, place)
    if found == 0:
        PyErr_Clear()
        return np.nan
    value = PyFloat_AsDouble(found)
    if value == -1.0 and PyErr_Occurred() != 0:
        PyErr_Clear()
        value = np.nan
    Py_DecRef(found)
    return value
"""
"""A number in a sequence, NaN where there is none."""
HAS_LENGTH = """
def has_length(given, length):
    found = PySequence_Size(given)
    if found < 0:
        PyErr_Clear()
    return found == length
"""
"""Whether an object is a sequence of so many."""
FOUND = """
def found(table, key):
    value = PyDict_GetItemWithError(table, key)
    if value == 0 and PyErr_Occurred() != 0:
        PyErr_Clear()
    return value
"""
"""The value of a key in a dictionary, which keeps it; 0 without."""
WHOLE_ITEM = """
def whole_item(given, place):
    found = PySequence_GetItem(given, place)
    if found == 0:
        PyErr_Clear()
        return -1
    value = PyLong_AsLongLong(found)
    Py_DecRef(found)
    if value == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
    return value
"""
"""An integer in a sequence, -1 where there is none."""
NUMBER = """
def number(value):
    made = PyFloat_AsDouble(value)
    if made == -1.0 and PyErr_Occurred() != 0:
        PyErr_Clear()
        made = np.nan
    return made
"""
"""Any number as a float, NaN for anything else."""
WHOLE = f"""
def whole(value):
    made = PyLong_AsLongLong(value)
    if made == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
        return {NO_INDEX}
    return made
"""
"""Any integer of 64 bits, `NO_INDEX` for anything else."""
TRIPLE = """
def triple(x, y, z):
    made = PyTuple_New(3)
    PyTuple_SetItem(made, 0, PyFloat_FromDouble(x))
    PyTuple_SetItem(made, 1, PyFloat_FromDouble(y))
    PyTuple_SetItem(made, 2, PyFloat_FromDouble(z))
    return made
"""
"""A new tuple of three numbers."""
ATTRIBUTE = """
def attribute(owner, name):
    value = PyObject_GenericGetAttr(owner, name)
    if value == 0:
        PyErr_Clear()
    else:
        Py_DecRef(value)  # its owner keeps it
    return value
"""
"""An attribute that its owner keeps; 0 without, also where `__getattr__` would make it."""
PLAIN = """
def plain(state, value):
    kind = word(value, KIND)
    if kind == word(word(state, NUMBER), KIND):
        return PyFloat_AsDouble(value)
    if kind != word(word(state, WHOLE), KIND):
        return np.nan
    found = PyLong_AsLongLong(value)  # PyFloat_AsDouble makes a float of it first
    if found == -1 and PyErr_Occurred() != 0:
        PyErr_Clear()
        return np.nan
    return np.float64(found)
"""
"""A plain float, or an int of 64 bits, NaN for anything else.

KIND is the place of an object's type; NUMBER and WHOLE are those of a float and an int in the state.
"""


CALLED = """
def called(function, arguments):
    passed, count = words(), word(arguments, SIZE)
    for place in range(count):
        passed[place] = word(arguments, ITEMS + place)
    return PyObject_Vectorcall(function, passed, count, 0)
"""
"""The result of a function for the items of a tuple, 0 where it raises.

SIZE and ITEMS are the places of a tuple's length and of its items.
"""
IS_DONE = """
def is_done(made):
    if made == 0:
        return False
    Py_DecRef(made)
    return True
"""
"""Whether a call returned anything, which is given up."""
NUMBER_IN = """
def held(state, values, place):
    kind = word(values, KIND)
    if kind == word(word(state, LISTED), KIND):
        return word(word(values, ITEMS), place) if place < word(values, SIZE) else 0
    if kind == word(word(state, TUPLE), KIND):
        return word(values, ITEMS + place) if place < word(values, SIZE) else 0
    return 0

def number_in(state, values, place):
    value = held(state, values, place)
    if value == 0:
        return item(values, place)
    found = plain(state, value)
    if found != found:
        Py_IncRef(value)  # its function may take it out of the list
        found = number(value)
        Py_DecRef(value)
    return found
"""
"""A number in a sequence, NaN for anything else; before it the item of a list or tuple, which keeps it, or 0.

Reading a number may call a function of Python, which may change the length of a list. KIND, SIZE and ITEMS
are the places of an object's type, of a tuple's length and of its items; LISTED and TUPLE are those of a list
and of a tuple in the state. ITEM, PLAIN and NUMBER have to be there, too.
"""


IS_ARRAY = """
def is_array(values, sample):
    if word(values, KIND) != word(sample, KIND) or word(values, 7) != word(sample, 7):
        return False
    return word(values, 3) & 0xFFFFFFFF == 1
"""
"""Whether an object is an array of one dimension and of the same type of numbers as another one.

KIND is the place of an object's type. The numbers are the places of an array's dimensions and of its type of
numbers, see `objects.arrays_have_the_known_layout`.
"""


def parts(*sources: str) -> str:
    """Return functions as parts of an entry."""
    return "".join(source.replace("\ndef ", "\n@part\ndef ") for source in sources)
