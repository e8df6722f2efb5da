"""A command with many optional arguments as machine code: it calls a function for each one that is given.

Most calls of such a command give one or two of two dozen arguments. A call with one that is neither a
plain number of at least 0 nor a sequence of numbers, as its function takes, or that has no function, goes to
the Python function of the command; see `fast_entries`. Two arguments that belong together
are given to the function of the first as a tuple. An argument that is as it was, which scripts often repeat,
calls nothing where the state, or what is prepared, names the attribute that holds it.

Where the state names requests, a call of one that is there writes all values into it.

A function may prepare a `Write` of its argument: from then on the machine code does what the function would,
until rows of MuJoCo's arrays change (`Engine.prepared`).
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import Any

from roboyard._records import NamedTuple
from roboyard.description.mass_properties import LEAST_RATIO, MIN_INERTIA
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
from roboyard.pybullet.fast.pairs import PAIR, SIGNED, SIGNED_PAIR

IGNORED = "ignored"
"""In place of a function: the argument changes nothing."""


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


class Properties(NamedTuple):
    """State of a command; the machine code has the same order."""

    command: Callable[..., Any]
    changes: tuple[Any, ...]
    """By optional argument: a function of the client, the first arguments and this one, IGNORED or None."""
    lengths: tuple[int, ...]
    """0 where that is a number, SIGNED, PAIR or SIGNED_PAIR; else of its numbers, which become a tuple."""
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
    prepared: dict[Any, Any] | None = None
    """By client and first arguments: for each optional argument a `Write` or None."""
    ignored: str = IGNORED
    ranks: tuple[int, ...] = ()
    """By optional argument: of those given, the one of largest size says which link all of them are of: the
    one that is given, or with a negative number the base."""
    base: int = -1
    requests: str | None = None
    """Attribute of the scene with lists by the first integer, of what has no record yet."""
    request_places: tuple[tuple[int, ...], ...] = ()
    """By optional argument: which elements of such a list become its value."""
    signed_pair: int = SIGNED_PAIR
    """Which is the same object in `lengths`, as all small numbers are."""


_SOURCE = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object and of tuples, in words
COMMAND, CHANGES, LENGTHS, DEFAULTS, FIRST, RECORDS, PRESENT, SCENE = range(3, 11)
NONE, WHOLE, NUMBER, LISTED, PREPARED, IGNORED, RANKS, BASE, REQUESTS, REQUEST_PLACES, PAIRED = range(11, 22)
OWNER, NAME, FACTORS, TARGETS, PLACES, LEAST, OTHER, OTHER_NAME = range(3, 11)
MARKED, MARKS, LATE, KEY, WORTH, TRUE, MOST, ALSO, RISES, TURNS, IS_INERTIA, AMONG = range(11, 23)
TUPLE = CHANGES
{parts(PLAIN, ATTRIBUTE, FOUND, TRIPLE, NUMBER, ITEM, HAS_LENGTH, NUMBER_IN)}
@part
def single(state, value):
    found = plain(state, value)
    return found if found == found else number(value)

@part
def has_numbers(state, values, length):
    if not has_length(values, length):
        return False
    total = 0.0
    for place in range(length):
        found = number_in(state, values, place)
        total += found * found
    return total - total == 0.0

@part
def second_of(state, given, count, place, at):
    return given[place + 1] if place + 1 < count else word(word(state, DEFAULTS), at + 1)

@part
def is_given(state, given, count, place, at):
    defaults = word(state, DEFAULTS)
    if given[place] != word(defaults, at):
        return True
    is_pair = word(word(state, LENGTHS), at) == word(state, PAIRED)
    return is_pair and second_of(state, given, count, place, at) != word(defaults, at + 1)

@part
def fits_change(state, given, count, place, first):
    at, value = ITEMS + place - first, given[place]
    if word(word(state, CHANGES), at) == word(state, NONE):
        return False
    length = PyLong_AsLongLong(word(word(state, LENGTHS), at))
    if length > 0:
        return has_numbers(state, value, length)
    found, least = single(state, value), 0.0
    if length == {SIGNED}:
        return abs(found) < 1e32 and found != single(state, word(word(state, DEFAULTS), at))
    if length < 0:
        second = second_of(state, given, count, place, at)
        if length == {PAIR} and second == word(word(state, DEFAULTS), at + 1):
            return False
        least = 0.0 if length == {PAIR} else -np.inf
        second = single(state, second)
        if not second >= least or second - second != 0.0:
            return False
    return found >= least and found - found == 0.0

@part
def accepts(state, given, count, first):
    for place in range(1, first):
        if word(given[place], KIND) != word(word(state, WHOLE), KIND):
            return False
    place = first
    while place < count:
        at = ITEMS + place - first
        is_here = is_given(state, given, count, place, at)
        if is_here and not fits_change(state, given, count, place, first):
            return False
        is_pair = is_here and PyLong_AsLongLong(word(word(state, LENGTHS), at)) < {SIGNED}
        place += 2 if is_pair else 1
    return True

@part
def record_of(state, given):
    if word(state, RECORDS) == word(state, NONE):
        return 0
    scene = attribute(given[0], word(state, SCENE))
    records = attribute(scene, word(state, RECORDS)) if scene != 0 else 0
    return found(records, given[1]) if records != 0 else 0

@part
def float_of(state, x):
    if x == 0.0 and 1.0 / x > 0.0:  # the most frequent number
        Py_IncRef(word(state, NUMBER))
        return word(state, NUMBER)
    return PyFloat_FromDouble(x)

@part
def taken(state, values, place, x):
    kind, value = word(values, KIND), 0
    if kind == word(word(state, LISTED), KIND):
        value = word(word(values, ITEMS), place)
    elif kind == word(word(state, CHANGES), KIND):
        value = word(values, ITEMS + place)
    if value == 0 or word(value, KIND) != word(word(state, NUMBER), KIND):
        return float_of(state, x)
    Py_IncRef(value)
    return value

@part
def three_of(state, values, x, y, z):
    made = PyTuple_New(3)
    PyTuple_SetItem(made, 0, taken(state, values, 0, x))
    PyTuple_SetItem(made, 1, taken(state, values, 1, y))
    PyTuple_SetItem(made, 2, taken(state, values, 2, z))
    return made

@part
def four_of(state, values, x, y, z, w):
    made = PyTuple_New(4)
    PyTuple_SetItem(made, 0, taken(state, values, 0, x))
    PyTuple_SetItem(made, 1, taken(state, values, 1, y))
    PyTuple_SetItem(made, 2, taken(state, values, 2, z))
    PyTuple_SetItem(made, 3, taken(state, values, 3, w))
    return made

@part
def four(state, x, y, z, w):
    made = PyTuple_New(4)
    PyTuple_SetItem(made, 0, float_of(state, x))
    PyTuple_SetItem(made, 1, float_of(state, y))
    PyTuple_SetItem(made, 2, float_of(state, z))
    PyTuple_SetItem(made, 3, float_of(state, w))
    return made

@part
def request_of(state, given):
    if word(state, REQUESTS) == word(state, NONE):
        return 0
    requests = attribute(attribute(given[0], word(state, SCENE)), word(state, REQUESTS))
    return found(requests, given[1]) if requests != 0 else 0

@part
def places_of(state, given, place, first):
    at = ITEMS + place - first
    is_default = given[place] == word(word(state, DEFAULTS), at)
    return word(state, NONE) if is_default else word(word(state, REQUEST_PLACES), at)

@part
def can_be_requested(state, given, count, first):
    for place in range(first, count):
        places = places_of(state, given, place, first)
        if places != word(state, NONE) and word(places, SIZE) == 0:
            return False
    return True

@part
def requested_value(state, value, length):
    if length < 3:
        return PyFloat_FromDouble(single(state, value))
    x, y, z = number_in(state, value, 0), number_in(state, value, 1), number_in(state, value, 2)
    if length == 3:
        return three_of(state, value, x, y, z)
    return four_of(state, value, x, y, z, number_in(state, value, 3))

@part
def request_change(state, given, count, first, request):
    for place in range(first, count):
        places = places_of(state, given, place, first)
        if places != word(state, NONE):
            length = PyLong_AsLongLong(word(word(state, LENGTHS), ITEMS + place - first))
            made = requested_value(state, given[place], length)
            for k in range(word(places, SIZE)):
                Py_IncRef(made)
                PyList_SetItem(request, PyLong_AsLongLong(word(places, ITEMS + k)), made)
            Py_DecRef(made)

@part
def is_present(state, record, at, value, length):
    name = word(word(state, PRESENT), at)
    present = attribute(record, name) if name != word(state, NONE) else 0
    if present == 0:
        return False
    if length == 0:
        return plain(state, present) == plain(state, value)
    if word(present, KIND) != word(word(state, CHANGES), KIND) or word(present, SIZE) != length:
        return False
    for k in range(length):
        if plain(state, word(present, ITEMS + k)) != number_in(state, value, k):
            return False
    return True

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
def record_of_write(state, writes, given, count, first):
    for place in range(first, count):
        at = ITEMS + place - first
        if is_given(state, given, count, place, at):
            write = write_of(state, writes, at)
            if write == 0 or word(write, AMONG) == word(state, NONE):
                return 0
            owner = word(write, OWNER)
            return owner if found(word(write, AMONG), given[1]) == owner else 0
    return 0

@part
def output(factors, row, x, y, z):
    return factors[row, 0] * x + factors[row, 1] * y + factors[row, 2] * z + factors[row, 3]

@part
def is_known(state, write, value, length):
    present = attribute(word(write, OWNER), word(write, NAME))
    if present == 0:
        return False
    if length == 0 or length == 2:
        first = plain(state, value) if length == 0 else number_in(state, value, 0)
        if plain(state, present) != first:
            return False
        if length == 0:
            return True
        present = attribute(word(write, OWNER), word(write, OTHER_NAME))
        return present != 0 and plain(state, present) == number_in(state, value, 1)
    if word(present, KIND) != word(word(state, CHANGES), KIND) or word(present, SIZE) != length:
        return False
    for k in range(length):
        if plain(state, word(present, ITEMS + k)) != number_in(state, value, k):
            return False
    return True

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
    made = three_of(state, value, x, y, z) if length > 2 else PyFloat_FromDouble(x)
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
    made, is_unit = four_of(state, value, x, y, z, w), size == 1.0
    PyObject_SetAttr(word(write, OWNER), word(write, NAME), made)
    if size != 1.0:
        x, y, z, w = x / size, y / size, z / size, w / size
        size = np.sqrt(x * x + y * y + z * z + w * w)
        if size != 1.0:
            x, y, z, w = x / size, y / size, z / size, w / size
    if not is_unit:
        Py_DecRef(made)
        made = four(state, x, y, z, w)
    PyObject_SetAttr(word(write, OTHER), word(write, OTHER_NAME), made)
    Py_DecRef(made)
    targets = word(write, TARGETS)
    for t in range(word(targets, SIZE)):
        target = numbers(word(targets, ITEMS + t))
        target[0], target[1], target[2], target[3] = w, x, y, z
    return True

@part
def is_done(state, writes, at, record, value, length):
    if record != 0 and is_present(state, record, at, value, length):
        return True
    if length > 4 or (record == 0 and word(state, RECORDS) != word(state, NONE)):
        return False
    write = write_of(state, writes, at)
    if write == 0:
        return False
    if word(write, OWNER) != record and is_known(state, write, value, length):
        return True
    Py_IncRef(write)
    if length < 4:
        done = is_written(state, write, value, length)
    else:
        done = word(write, TURNS) == word(write, TRUE) and is_turned(state, write, value)
    Py_DecRef(write)
    return done

@part
def is_of_base(state, given, count, first):
    largest = 0
    for place in range(first, count):
        at = ITEMS + place - first
        if given[place] != word(word(state, DEFAULTS), at):
            rank = PyLong_AsLongLong(word(word(state, RANKS), at))
            if abs(rank) > abs(largest):
                largest = rank
    return largest < 0

def entry(state, given, count, keywords):
    first = PyLong_AsLongLong(word(state, FIRST))
    fits = keywords == 0 and first < count <= first + word(word(state, CHANGES), SIZE)
    if not fits or not accepts(state, given, count, first):
        return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
    passed = words()
    for place in range(first):
        passed[place] = given[place]
    if is_of_base(state, given, count, first):
        passed[first - 1] = word(state, BASE)
    writes = writes_of(state, passed, first)
    record = record_of_write(state, writes, given, count, first) if writes != 0 else 0
    if record == 0:
        record = record_of(state, given)
    request = request_of(state, given) if record == 0 else 0
    if request != 0:
        if not can_be_requested(state, given, count, first):
            return PyObject_Vectorcall(word(state, COMMAND), given, count, keywords)
        request_change(state, given, count, first, request)
        Py_IncRef(word(state, NONE))
        return word(state, NONE)
    place = first
    while place < count:
        at = ITEMS + place - first
        change, value = word(word(state, CHANGES), at), given[place]
        is_here = is_given(state, given, count, place, at)
        place += 1
        if not is_here or change == word(state, IGNORED):
            continue
        length = PyLong_AsLongLong(word(word(state, LENGTHS), at))
        length = 0 if length == {SIGNED} else length
        Py_IncRef(value)
        if length == 0 and plain(state, value) != plain(state, value):  # no plain number, as NumPy's
            Py_DecRef(value)
            value = PyFloat_FromDouble(number(given[place - 1]))
        if length < 0:
            Py_DecRef(value)
            value, length = PyTuple_New(2), 2
            Py_IncRef(given[place - 1])
            PyTuple_SetItem(value, 0, given[place - 1])
            second = second_of(state, given, count, place - 1, at)
            Py_IncRef(second)
            PyTuple_SetItem(value, 1, second)
            place += 1
        if not is_done(state, writes, at, record, value, length):
            if length > 0:
                made = PyTuple_New(length)
                for k in range(length):
                    PyTuple_SetItem(made, k, PyFloat_FromDouble(number_in(state, value, k)))
                Py_DecRef(value)
                value = made
            passed[first] = value
            done = PyObject_Vectorcall(change, passed, first + 1, 0)
            if done == 0:
                Py_DecRef(value)
                return 0
            Py_DecRef(done)
            writes = writes_of(state, passed, first)  # the function may prepare others
        Py_DecRef(value)
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def property_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


PROPERTIES = Front(property_call, EntrySignature(_SOURCE))
vars(property_call)["front"] = PROPERTIES
