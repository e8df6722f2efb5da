"""Long lists of numbers as arrays, read by machine code where it is stored; else by NumPy.

NumPy takes about 50 ns for each number of nested lists; after many of them the machine code is compiled.
Numbers of other types than float and int, rows of other lengths, and numbers that are not finite are left to
NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard._lazy import LazyLogger
from roboyard._records import NamedTuple
from roboyard.native.builtin import bound_function
from roboyard.native.entry_parts import PLAIN, WHOLE, parts
from roboyard.native.fronts import Front
from roboyard.native.signatures import EntrySignature
from roboyard.pybullet.face.direct_calls import CAN_START

_SMALL = 256
"""Python has one object of each smaller number from 0, which lie side by side."""
_STRIDE = 32
MOST_NUMBERS = 1_000_000
"""Numbers that are read without machine code before it is compiled."""
_log = LazyLogger("roboyard")


class ListState(NamedTuple):
    """State of the machine code, which has the same order."""

    none: None = None
    number: float = 0.0
    whole: int = 0
    listed: list[Any] = []  # noqa: RUF012 - of which the type is read
    nothing: tuple[()] = ()
    empty: Any = np.empty
    dtype: Any = np.int64
    has_small: bool = False
    """Whether small whole numbers are where their addresses say."""
    true: bool = True


_SOURCE = f"""
KIND, SIZE, ITEMS = 1, 2, 3  # of any object, tuples and lists, in words
NONE, NUMBER, WHOLE, LISTED, NOTHING, EMPTY, DTYPE, HAS_SMALL, TRUE = range(3, 12)
{parts(PLAIN, WHOLE)}
@part
def size_of(state, values):
    kind = word(values, KIND)
    is_tuple = kind == word(word(state, NOTHING), KIND)
    return word(values, SIZE) if is_tuple or kind == word(word(state, LISTED), KIND) else -1

@part
def start_of(state, values):
    is_tuple = word(values, KIND) == word(word(state, NOTHING), KIND)
    return values + 8 * ITEMS if is_tuple else word(values, ITEMS)

@part
def has_rows(state, rows, width, into):
    if size_of(state, rows) != len(into):
        return False
    first, total = start_of(state, rows), 0.0
    for row in range(len(into)):
        values = word(first, row)
        if size_of(state, values) != width:
            return False
        start = start_of(state, values)
        for k in range(width):
            into[row, k] = plain(state, word(start, k))
            total += into[row, k]
    return total - total == 0.0

@part
def has_integers(state, values, most, into):
    if size_of(state, values) != len(into):
        return False
    first, kind, zero = start_of(state, values), word(word(state, WHOLE), KIND), word(state, WHOLE)
    limit = {_SMALL * _STRIDE} if word(state, HAS_SMALL) == word(state, TRUE) else 0
    for place in range(len(into)):
        value = word(first, place)
        offset = value - zero
        if 0 <= offset < limit and offset & {_STRIDE - 1} == 0:
            found = offset >> {_STRIDE.bit_length() - 1}
        elif word(value, KIND) == kind:
            found = whole(value)  # negative for very large ones
        else:
            return False
        if not 0 <= found <= most:
            return False
        into[place] = found
    return True

@part
def made_of(state, values, width, most):
    passed, size = words(), size_of(state, values)
    if size < 0:
        return 0
    if width > 0:
        passed[0] = PyTuple_New(2)
        PyTuple_SetItem(passed[0], 0, PyLong_FromLongLong(size))
        PyTuple_SetItem(passed[0], 1, PyLong_FromLongLong(width))
        made = PyObject_Vectorcall(word(state, EMPTY), passed, 1, 0)
    else:
        passed[0], passed[1] = PyLong_FromLongLong(size), word(state, DTYPE)
        made = PyObject_Vectorcall(word(state, EMPTY), passed, 2, 0)
    Py_DecRef(passed[0])
    if made == 0:
        PyErr_Clear()
        return 0
    if width > 0:
        is_read = has_rows(state, values, width, matrix(made))
    else:
        is_read = has_integers(state, values, most, integers(made))
    if is_read:
        return made
    Py_DecRef(made)
    return 0

def entry(state, given, count, keywords):
    made = made_of(state, given[0], whole(given[1]), whole(given[2])) if count == 3 else 0
    if made == 0:
        made = word(state, NONE)
        Py_IncRef(made)
    return made
"""


def list_call() -> None:
    """Do nothing: the machine code is stored beside the code of this file."""


LISTS = Front(list_call, EntrySignature(_SOURCE))
vars(list_call)["front"] = LISTS


def finite_rows(values: Sequence[Any], width: int) -> NDArray[np.float64] | None:
    """Return rows of finite numbers as a new array (n, width); None where they may be others."""
    return _read(values, width, 0)


def integers_up_to(values: Sequence[int], most: int) -> NDArray[np.int64] | None:
    """Return whole numbers from 0 to `most` as a new array (n,); None where they may be others."""
    return _read(values, 0, most)


class Reader:
    """The machine code: loaded for the first list where it is stored, else compiled after many numbers."""

    def __init__(self) -> None:
        """Look for nothing yet."""
        self.call: Callable[[Any, int, int], Any] | None = None
        self._numbers = 0

    def count(self, numbers: int) -> None:
        """Count numbers that are read without machine code; load or compile that when it is time."""
        before = self._numbers
        self._numbers += numbers
        is_due = before < MOST_NUMBERS <= self._numbers
        if not CAN_START or not (is_due or before == 0):
            return
        if not LISTS.is_stored:
            if not is_due or not LISTS.is_cheap:
                return
            _log.warning("compiling the reader of lists for this machine: once, about 5 seconds")
        address = LISTS.address()
        if address:
            has_small = all(id(number) == id(0) + _STRIDE * number for number in range(_SMALL))
            self.call = bound_function("read_numbers", address, ListState(has_small=has_small))


READER = Reader()


def _read(values: Any, width: int, most: int) -> Any:
    if type(values) not in (list, tuple) or not values:
        return None
    if READER.call is None:
        READER.count(len(values) * max(width, 1))
    return None if READER.call is None else READER.call(values, width, most)
