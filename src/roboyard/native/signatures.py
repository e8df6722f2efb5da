"""Signatures of compiled loops: numbers and arrays."""

from __future__ import annotations

from typing import Any

from roboyard._records import dataclass

DTYPES = {"f8": "float64", "f4": "float32", "i8": "int64", "u8": "uint64", "i4": "int32", "u1": "uint8"}
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


@dataclass(frozen=True)
class Signature:
    """Arguments and result of a loop."""

    arguments: tuple[Argument, ...]
    returns_number: bool
    """Whether it returns a float64; otherwise it returns nothing."""
    fast_math: bool = False
    """Whether the order of sums and products may be changed."""
    releases_gil: bool = False
    """Whether other Python threads run meanwhile."""

    def problem_with(self, values: tuple[Any, ...]) -> str:
        """Return why values cannot be passed, "" where they can."""
        if len(values) != len(self.arguments):
            return f"{len(values)} arguments instead of {len(self.arguments)}"
        for place, (wanted, value) in enumerate(zip(self.arguments, values, strict=True)):
            given = getattr(value, "ndim", 0)
            if given != wanted.dimensions:
                return f"argument {place} has {given} dimensions instead of {wanted.dimensions}"
            if given and value.dtype != wanted.dtype:
                return f"argument {place} is {value.dtype} instead of {wanted.dtype}"
            if wanted.is_contiguous and not value.flags.c_contiguous:
                return f"argument {place} is not in C order; use numpy.ascontiguousarray"
        return ""


def parse_signature(text: str) -> Signature:
    """Return the signature that `text` describes, such as "f8[:,:] i4[::1] f8 -> f8"."""
    before, _, after = text.partition("->")
    return Signature(tuple(_argument(word) for word in before.split()), after.strip() == "f8")


def _argument(word: str) -> Argument:
    name, _, axes = word.partition("[")
    is_contiguous = axes.endswith("::1]")
    return Argument(DTYPES[name], axes.count(":") - is_contiguous, is_contiguous)
