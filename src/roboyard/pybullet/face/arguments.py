"""Checking the arguments of scripts: vectors of any sequence type, integers, names of files."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import isfinite
from operator import index
from typing import Any

from roboyard.pybullet.face.errors import failure

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
_PLAIN = (tuple, list)
_NUMBERS = (float, int)
_TEXTS = (str, bytes)


def floats(values: Iterable[float], count: int, message: str) -> tuple[float, ...]:
    """Return `count` numbers as floats.

    Raises:
        error: with PyBullet's `message`; the length differs, or it is not a sequence.
        TypeError: an element is not a number.
    """
    try:
        found = tuple(values)
    except TypeError:
        raise failure(message, f"expected {count} numbers, got {values!r}") from None
    if len(found) != count:
        raise failure(message, f"expected {count} numbers, got {len(found)}: {found!r}")
    return found if set(map(type, found)) == {float} else tuple(number(value) for value in found)


def number(value: Any) -> float:
    """Return a float; unlike `float()` it rejects text.

    Raises:
        TypeError: the value is not a number.
    """
    if type(value) is float:
        return value
    if isinstance(value, _TEXTS):
        raise TypeError(f"must be real number, not {type(value).__name__}")
    return float(value)


def vector3(values: Iterable[float], message: str) -> Vector3:
    """Return three numbers as floats.

    Raises:
        error: with `message`; the length differs.
        TypeError: an element is not a number.
    """
    if type(values) in _PLAIN and len(values) == 3:  # type: ignore[arg-type]
        x, y, z = values
        if type(x) is type(y) is type(z) is float:
            return x, y, z
        if type(x) in _NUMBERS and type(y) in _NUMBERS and type(z) in _NUMBERS:
            return 1.0 * x, 1.0 * y, 1.0 * z
    x, y, z = floats(values, 3, message)
    return x, y, z


def quaternion(values: Iterable[float], message: str) -> Quaternion:
    """Return four numbers as floats, not normalised.

    Raises:
        error: with `message`; the length differs.
        TypeError: an element is not a number.
    """
    if type(values) in _PLAIN and len(values) == 4:  # type: ignore[arg-type]
        x, y, z, w = values
        if type(x) is type(y) is type(z) is type(w) is float:
            return x, y, z, w
        if type(x) in _NUMBERS and type(y) in _NUMBERS and type(z) in _NUMBERS and type(w) in _NUMBERS:
            return 1.0 * x, 1.0 * y, 1.0 * z, 1.0 * w
    x, y, z, w = floats(values, 4, message)
    return x, y, z, w


def vector3_or(values: Any, default: Vector3) -> Vector3:
    """Return three numbers as floats; the default for None, another length or no sequence, as PyBullet does.

    Raises:
        TypeError: an element is not a number.
    """
    return default if values is default or not _has_length(values, 3) else vector3(values, "")


def quaternion_or(values: Any, default: Quaternion) -> Quaternion:
    """Return four numbers as floats; the default for None, another length or no sequence, as PyBullet does.

    Raises:
        TypeError: an element is not a number.
    """
    return default if values is default or not _has_length(values, 4) else quaternion(values, "")


def _has_length(values: Any, length: int) -> bool:
    try:
        return len(values) == length
    except TypeError:
        return False


def check_finite(message: str, **given: float | Iterable[float]) -> None:
    """Refuse numbers and vectors that are not finite, by name.

    Raises:
        error: with PyBullet's `message`.
    """
    for name, value in given.items():
        if (type(value) is float and isfinite(value)) or (type(value) is tuple and are_finite(value)):
            continue
        numbers = value if isinstance(value, Iterable) else (value,)
        if not all(map(isfinite, numbers)):
            raise failure(message, f"{name} must be finite, got {value}")


def are_finite(values: tuple[Any, ...]) -> bool:
    """Return whether all are finite floats, as far as one sum shows; where False, look closer."""
    try:
        total = sum(values)
    except TypeError:
        return False
    return type(total) is float and total - total == 0.0


whole: Callable[[Any], int] = index
"""Returns an int; floats are rejected with TypeError, as in PyBullet."""


def indices(values: Iterable[int], message: str = "expected a sequence of joint indices") -> list[int]:
    """Return integers from any sequence, as PyBullet does: floats truncated, -1 for anything else.

    Raises:
        error: with `message`; it is not a sequence.
    """
    try:
        return [value if type(value) is int else _truncated(value) for value in values]
    except TypeError:
        raise failure(message, f"got {values!r}") from None


def _truncated(value: Any) -> int:
    try:
        return -1 if isinstance(value, str | bytes) else int(value)
    except (TypeError, ValueError, OverflowError):
        return -1


def text(value: Any) -> str:
    """Return a str; paths and bytes are rejected, as in PyBullet.

    Raises:
        TypeError: the value is not a str.
    """
    if not isinstance(value, str):
        raise TypeError(f"must be str, not {type(value).__name__}: {value!r}")
    return value
