"""A command with many optional arguments as machine code: it calls a function for each one that is given.

Most calls of such a command give one or two of two dozen arguments. A call with one that is neither a
plain number of at least 0 nor a sequence of numbers, as its function takes, or that has no function, goes to
the Python function of the command; see `fast_entries`. Two arguments that belong together
are given to the function of the first as a tuple. An argument that is as it was, which scripts often repeat,
calls nothing where the state, or what is prepared, names the attribute that holds it.

Where the state names requests, a call of one that is there writes all values into it; see
`properties.requests`.

A function may prepare a `properties.writes.Write` of its argument: from then on the machine code does what
the function would, until rows of MuJoCo's arrays change (`Engine.prepared`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

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
from roboyard.pybullet.fast.pairs import PAIR, SIGNED, SIGNED_PAIR
from roboyard.pybullet.fast.properties.requests import REQUESTS
from roboyard.pybullet.fast.properties.writes import WRITES

IGNORED = "ignored"
"""In place of a function: the argument changes nothing."""


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
TUPLE = CHANGES
{parts(PLAIN, ATTRIBUTE, FOUND, TRIPLE, NUMBER, ITEM, HAS_LENGTH, NUMBER_IN)}{WRITES}{REQUESTS}
@part
def single(state, value):
    found = plain(state, value)
    return found if found == found else number(value)

@part
def has_numbers(state, values, length):
    kind, fits = word(values, KIND), False
    if kind == word(word(state, LISTED), KIND) or kind == word(word(state, TUPLE), KIND):
        fits = word(values, SIZE) == length
    else:
        fits = has_length(values, length)
    if not fits:
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
def is_present(state, record, at, value, length):
    name = word(word(state, PRESENT), at)
    present = attribute(record, name) if name != word(state, NONE) else 0
    if present == 0:
        return False
    if length == 0:
        return plain(state, present) == plain(state, value)
    return are_equal(state, present, value, length)

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
def is_done(state, writes, at, record, value, length):
    if record != 0 and is_present(state, record, at, value, length):
        return True
    if length > 4 or (record == 0 and word(state, RECORDS) != word(state, NONE)):
        return False
    write = write_of(state, writes, at)
    if write == 0:
        return False
    Py_IncRef(write)
    if word(write, OWNER) != record and is_known(state, write, value, length):
        done = True
    elif length < 4:
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

@part
def are_changed(state, given, count, first, passed, writes, record):
    place = first
    if writes != 0:
        Py_IncRef(writes)  # reading a number may reset the simulation
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
            if writes != 0:
                Py_DecRef(writes)
            writes = 0
            if done == 0:
                Py_DecRef(value)
                return False
            Py_DecRef(done)
            if place < count:
                writes = writes_of(state, passed, first)  # the function may prepare others
            if writes != 0:
                Py_IncRef(writes)
        Py_DecRef(value)
    if writes != 0:
        Py_DecRef(writes)
    return True

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
    if record != 0:
        Py_IncRef(record)  # a function may replace it
    are_done = are_changed(state, given, count, first, passed, writes, record)
    if record != 0:
        Py_DecRef(record)
    if not are_done:
        return 0
    Py_IncRef(word(state, NONE))
    return word(state, NONE)
"""


def property_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


PROPERTIES = Front(property_call, EntrySignature(_SOURCE))
vars(property_call)["front"] = PROPERTIES
