"""Signatures of compiled loops: numbers and arrays."""

from __future__ import annotations

from functools import cache, cached_property
from typing import Any

import numpy as np

from roboyard._records import dataclass

DTYPES = {
    "f8": "float64",
    "f4": "float32",
    "i8": "int64",
    "u8": "uint64",
    "i4": "int32",
    "u4": "uint32",
    "u1": "uint8",
}
"""Abbreviation to the name of NumPy's type."""


@dataclass(frozen=True)
class Argument:
    """One argument: a number, or an array."""

    dtype: str
    """`float64`, `int32`, ..."""
    dimensions: int
    """0 for a number."""
    is_contiguous: bool = False
    """Whether the array is in C order without gaps; its strides are then not passed."""

    def problem_with(self, value: Any) -> str:
        """Return why a value cannot be passed, "" where it can."""
        given = getattr(value, "ndim", 0)
        if given != self.dimensions:
            return f"has {given} dimensions instead of {self.dimensions}"
        if given and value.dtype != self.dtype:
            return f"is {value.dtype} instead of {self.dtype}"
        if self.is_contiguous and not value.flags.c_contiguous:
            return "is not in C order; use numpy.ascontiguousarray"
        return ""


@dataclass(frozen=True)
class Record:
    """One argument: a named tuple of arrays and numbers."""

    made_by: type
    """Its class."""
    names: tuple[str, ...]
    fields: tuple[Argument, ...]

    @cached_property
    def _of_arrays(self) -> tuple[tuple[int, Any, bool], ...]:
        """Dimensions, type and whether it must be contiguous of each field."""
        return tuple((field.dimensions, np.dtype(field.dtype), field.is_contiguous) for field in self.fields)

    def problem_with(self, value: Any) -> str:
        """Return why a value cannot be passed, "" where it can."""
        if type(value) is not self.made_by:
            return f"is a {type(value).__name__} instead of a {self.made_by.__name__}"
        for (dimensions, dtype, is_contiguous), field in zip(self._of_arrays, value, strict=True):
            if type(field) is not np.ndarray:
                if dimensions or type(field) is not int:
                    break
            elif (
                field.ndim != dimensions
                or field.dtype is not dtype
                or not dimensions
                or (is_contiguous and not field.flags.c_contiguous)
            ):
                break
        else:
            return ""
        for name, wanted, field in zip(self.names, self.fields, value, strict=True):
            problem = wanted.problem_with(field)
            if problem:
                return f"{name} {problem}"
        return ""


class Words(np.ndarray):
    """(n,) addresses of the arrays of several records, and the integers among their fields."""

    bundle: Bundle | None = None
    records: tuple[Any, ...] = ()
    """The records, whose arrays stay as long as this does."""
    parts: tuple[list[int], ...] = ()
    """The addresses and integers of each record."""


@dataclass(frozen=True)
class Bundle:
    """One argument for several of the loop: records of arrays and integers that many calls have in common.

    A call reads only those fields that the loop uses, and none of Python's objects.
    """

    records: tuple[Record, ...]

    def __post_init__(self) -> None:
        """Raise TypeError where a field is a number that is no integer."""
        for one in self.records:
            if any(not field.dimensions and field.dtype.startswith("f") for field in one.fields):
                raise TypeError(f"a {one.made_by.__name__} has a number that is no integer")

    def of(self, *values: Any, before: Words | None = None) -> Words:
        """Return records as the argument of a loop.

        Args:
            values: the records.
            before: an earlier result, of which records that are the same need no check.

        Raises:
            TypeError: they are other ones.
        """
        if len(values) != len(self.records):
            raise TypeError(f"{len(values)} records instead of {len(self.records)}")
        known = before if before is not None and before.bundle is self else None
        parts: list[list[int]] = []
        for place, (wanted, value) in enumerate(zip(self.records, values, strict=True)):
            if known is not None and value is known.records[place]:
                parts.append(known.parts[place])
                continue
            problem = wanted.problem_with(value)
            if problem:
                raise TypeError(problem)
            pairs = zip(wanted.fields, value, strict=True)
            parts.append([id(field) if argument.dimensions else int(field) for argument, field in pairs])
        made = np.array([word for part in parts for word in part], np.int64).view(Words)
        made.bundle, made.records, made.parts = self, values, tuple(parts)
        return made

    def problem_with(self, value: Any) -> str:
        """Return why a value cannot be passed, "" where it can."""
        return "" if type(value) is Words and value.bundle == self else "is not of this bundle"


@dataclass(frozen=True)
class Signature:
    """Arguments and result of a loop."""

    arguments: tuple[Argument | Record | Bundle, ...]
    returns: str
    """`float64` or `int64` where it returns a number, "" where it returns nothing."""
    fast_math: bool = False
    """Whether the order of sums and products may be changed."""
    no_nan: bool = False
    """Whether no number is ever undefined, which lets minima and maxima be fast."""
    releases_gil: bool = False
    """Whether other Python threads run meanwhile."""
    from_start: bool = False
    """Whether no index counts from the end of an array."""
    joins_lines: bool = False
    """Whether equal operations on neighbouring numbers that are written out become vector instructions."""

    @property
    def count(self) -> int:
        """Number of arguments of the loop in Python."""
        return sum(len(a.records) if isinstance(a, Bundle) else 1 for a in self.arguments)

    def problem_with(self, values: tuple[Any, ...]) -> str:
        """Return why values cannot be passed, "" where they can."""
        if len(values) != len(self.arguments):
            return f"{len(values)} arguments instead of {len(self.arguments)}"
        for place, (wanted, value) in enumerate(zip(self.arguments, values, strict=True)):
            problem = wanted.problem_with(value)
            if problem:
                return f"argument {place} {problem}"
        return ""


@dataclass(frozen=True)
class Numbers:
    """A number, or a vector of a fixed length."""

    dtype: str
    """`float64`; `float32` where it is rounded to 32 bits."""
    length: int
    """0 for a number."""


@dataclass(frozen=True)
class FrontSignature:
    """Arguments and results of a front."""

    arguments: tuple[Numbers, ...]
    results: tuple[Numbers, ...]
    ignored: str
    """Name of a keyword that changes nothing, "" for none."""
    names: tuple[str, ...] = ()
    """Names of the arguments, which may be keywords."""
    fast_math: bool = False
    no_nan: bool = False


@dataclass(frozen=True)
class EntrySignature:
    """A front that is the source of its own entry, `entry(callee, given, count, keywords)`."""

    source: str
    """Python that numba can compile.

    It may call all of `python_functions.PYTHON`, `_loop`, which is the core, `words()`, which gives 64 words
    of memory that last until it returns, `word(address, place)`, and `matrix`, `numbers` and `integers` for
    the float64 and int64 arrays at an address. Functions that it calls are decorated with `part`.
    """


@dataclass(frozen=True)
class CallbackSignature:
    """Arguments and result of a function that C calls."""

    arguments: tuple[str, ...]
    """`int64`, `int32` or `float64`."""
    returns: str
    otherwise: str
    """Name of the C function that is called where the result is negative."""
    fast_math: bool = True
    no_nan: bool = False


def record(made_by: type, text: str) -> Record:
    """Return a named tuple as an argument; `text` has the types of its fields, as a signature has.

    Raises:
        TypeError: the tuple has another number of fields.
    """
    fields = tuple(_argument(word) for word in text.split())
    names: tuple[str, ...] = getattr(made_by, "_fields", ())
    if len(fields) != len(names):
        raise TypeError(f"{made_by.__name__} has {len(names)} fields, {text!r} has {len(fields)}")
    return Record(made_by, names, fields)


def parse_signature(*parts: str | Record | Bundle) -> Signature:
    """Return the signature of texts such as "f8[:,:] i4[::1] f8 -> f8" and of records between them."""
    arguments: list[Argument | Record | Bundle] = []
    returns = ""
    for part in parts:
        if isinstance(part, (Record, Bundle)):
            arguments.append(part)
            continue
        before, _, after = part.partition("->")
        arguments += [_argument(word) for word in before.split()]
        returns = DTYPES[after.strip()] if after.strip() else ""
    return Signature(tuple(arguments), returns)


@cache
def _argument(word: str) -> Argument:
    name, _, axes = word.partition("[")
    is_contiguous = axes.endswith("::1]")
    return Argument(DTYPES[name], axes.count(":") - is_contiguous, is_contiguous)
