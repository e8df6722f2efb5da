"""Writes of commands in machine code, each for an argument with a known effect; see `properties.entries`."""

from __future__ import annotations

from math import inf
from typing import Any

from roboyard._records import NamedTuple
from roboyard.description.mass_properties import LEAST_RATIO, MIN_INERTIA


class Write(NamedTuple):
    """The effect of a value of one argument; the machine code has the same order.

    Numbers are sums of the value's one to three numbers and 1, each with a factor.
    """

    owner: Any
    name: str
    """Attribute of the owner that is the value, a float or a tuple of three; the first of a pair."""
    factors: Any = None
    """(n, 4) factors of the value's numbers, with zeros where there are fewer than three, and of 1.

    None: any other value goes to the function.
    """
    targets: tuple[Any, ...] = ()
    """Views (k,) of float64 that take numbers."""
    places: tuple[Any, ...] = ()
    """(k,) which number each element of a target takes."""
    least: float = -1.0
    """Values that are not larger go to the function."""
    other: Any = None
    other_name: str = ""
    """Attribute of another object that is the last three numbers; of a pair the owner and its second."""
    marked: Any = None
    marks: tuple[str, ...] = ()
    """Attributes of an object that become True."""
    late: dict[Any, Any] | None = None
    key: Any = None
    worth: Any = None
    """A key of a dictionary and its value from then on."""
    true: bool = True
    most: float = inf
    """Values that are larger go to the function."""
    also: tuple[Any, ...] = ()
    """Objects, each followed by the name of its attribute that is the value, too."""
    rises: bool = False
    """Whether a pair whose second number is smaller than the first goes to the function."""
    turns: bool = False
    """Whether the value is a quaternion x, y, z, w, of which the other's attribute is the one of length 1.

    The targets (4,) take that with w first.
    """
    is_inertia: bool = False
    """Whether three numbers that are not the moments of a rigid body go to the function."""
    among: dict[int, Any] | None = None
    """Records by the first integer, of which the owner is one; it need not be looked up otherwise."""


WRITES = f"""
OWNER, NAME, FACTORS, TARGETS, PLACES, LEAST, OTHER, OTHER_NAME = range(3, 11)
MARKED, MARKS, LATE, KEY, WORTH, TRUE, MOST, ALSO, RISES, TURNS, IS_INERTIA, AMONG = range(11, 23)

@part
def float_of(state, x):
    if x == 0.0 and 1.0 / x > 0.0:  # the most frequent number
        Py_IncRef(word(state, NUMBER))
        return word(state, NUMBER)
    return PyFloat_FromDouble(x)

@part
def taken(state, values, place, x):
    value = held(state, values, place) if values != 0 else 0
    if value == 0 or word(value, KIND) != word(word(state, NUMBER), KIND):
        return float_of(state, x)
    Py_IncRef(value)
    return value

@part
def tuple_of(state, values, length, x, y, z, w):
    made = PyTuple_New(length)
    PyTuple_SetItem(made, 0, taken(state, values, 0, x))
    PyTuple_SetItem(made, 1, taken(state, values, 1, y))
    PyTuple_SetItem(made, 2, taken(state, values, 2, z))
    if length > 3:
        PyTuple_SetItem(made, 3, taken(state, values, 3, w))
    return made

@part
def writes_of(state, given, first):
    writes = word(state, PREPARED)
    if writes == word(state, NONE):
        return 0
    for place in range(first):
        writes = found(writes, given[place])
        if writes == 0:
            return 0
    return writes

@part
def write_of(state, writes, at):
    if writes == 0:
        return 0
    write = word(word(writes, ITEMS), at - ITEMS)  # of a list
    return 0 if write == word(state, NONE) else write

@part
def output(factors, row, x, y, z):
    return factors[row, 0] * x + factors[row, 1] * y + factors[row, 2] * z + factors[row, 3]

@part
def are_equal(state, present, value, length):
    if word(present, KIND) != word(word(state, TUPLE), KIND) or word(present, SIZE) != length:
        return False
    Py_IncRef(present)  # reading a number may call a function of Python
    is_equal = True
    for k in range(length):
        if is_equal and plain(state, word(present, ITEMS + k)) != number_in(state, value, k):
            is_equal = False
    Py_DecRef(present)
    return is_equal

@part
def is_known(state, write, value, length):
    present = attribute(word(write, OWNER), word(write, NAME))
    if present == 0:
        return False
    if length != 0 and length != 2:
        return are_equal(state, present, value, length)
    first = plain(state, present)
    if first != (plain(state, value) if length == 0 else number_in(state, value, 0)):
        return False
    if length == 0:
        return True
    present = attribute(word(write, OWNER), word(write, OTHER_NAME))
    if present == 0:
        return False
    second = plain(state, present)
    return second == number_in(state, value, 1)

@part
def are_moments(x, y, z):
    large, small = max(x, y, z), min(x, y, z)
    middle = max(min(x, y), min(max(x, y), z))
    return small >= max(large * {LEAST_RATIO}, {MIN_INERTIA}) and large - small - middle <= 0.0

@part
def is_written(state, write, value, length):
    if word(write, FACTORS) == word(state, NONE):
        return False
    x, y, z = plain(state, value), 0.0, 0.0
    if length > 0:
        x, y = number_in(state, value, 0), number_in(state, value, 1)
        z = number_in(state, value, 2) if length > 2 else 0.0
        if word(write, RISES) == word(write, TRUE) and not x <= y:
            return False
        if word(write, IS_INERTIA) == word(write, TRUE) and not are_moments(x, y, z):
            return False
    elif not PyFloat_AsDouble(word(write, LEAST)) < x <= PyFloat_AsDouble(word(write, MOST)):
        return False
    factors, targets = matrix(word(write, FACTORS)), word(write, TARGETS)
    for t in range(word(targets, SIZE)):
        target, places = numbers(word(targets, ITEMS + t)), integers(word(word(write, PLACES), ITEMS + t))
        for k in range(len(places)):
            target[k] = output(factors, places[k], x, y, z)
    made = tuple_of(state, value, 3, x, y, z, 0.0) if length > 2 else PyFloat_FromDouble(x)
    PyObject_SetAttr(word(write, OWNER), word(write, NAME), made)
    also = word(write, ALSO)
    for k in range(0, word(also, SIZE), 2):
        PyObject_SetAttr(word(also, ITEMS + k), word(also, ITEMS + k + 1), made)
    if length == 2:
        Py_DecRef(made)
        made = PyFloat_FromDouble(y)
        PyObject_SetAttr(word(write, OWNER), word(write, OTHER_NAME), made)
    elif word(write, OTHER) != word(state, NONE):
        row = len(factors) - 3
        a, b = output(factors, row, x, y, z), output(factors, row + 1, x, y, z)
        c = output(factors, row + 2, x, y, z)
        if length == 0 or a != x or b != y or c != z:
            Py_DecRef(made)
            made = triple(a, b, c)
        PyObject_SetAttr(word(write, OTHER), word(write, OTHER_NAME), made)
    Py_DecRef(made)
    marks = word(write, MARKS)
    for k in range(word(marks, SIZE)):
        if attribute(word(write, MARKED), word(marks, ITEMS + k)) != word(write, TRUE):
            PyObject_SetAttr(word(write, MARKED), word(marks, ITEMS + k), word(write, TRUE))
    if word(write, LATE) != word(state, NONE):
        PyDict_SetItem(word(write, LATE), word(write, KEY), word(write, WORTH))
    return True

@part
def is_turned(state, write, value):
    x, y = number_in(state, value, 0), number_in(state, value, 1)
    z, w = number_in(state, value, 2), number_in(state, value, 3)
    size = np.sqrt(x * x + y * y + z * z + w * w)
    if not size > 0.0 or size - size != 0.0:
        return False
    made, is_unit = tuple_of(state, value, 4, x, y, z, w), size == 1.0
    PyObject_SetAttr(word(write, OWNER), word(write, NAME), made)
    if size != 1.0:
        x, y, z, w = x / size, y / size, z / size, w / size
        size = np.sqrt(x * x + y * y + z * z + w * w)
        if size != 1.0:
            x, y, z, w = x / size, y / size, z / size, w / size
    if not is_unit:
        Py_DecRef(made)
        made = tuple_of(state, 0, 4, x, y, z, w)
    PyObject_SetAttr(word(write, OTHER), word(write, OTHER_NAME), made)
    Py_DecRef(made)
    targets = word(write, TARGETS)
    for t in range(word(targets, SIZE)):
        target = numbers(word(targets, ITEMS + t))
        target[0], target[1], target[2], target[3] = w, x, y, z
    return True
"""
"""Parts of the entry: whether a write of a value is done, or changes nothing."""
