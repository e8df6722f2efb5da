"""Reading what scripts pass: vectors of any sequence type, whole numbers, names of files."""

from __future__ import annotations

from collections.abc import Iterable
from operator import index
from typing import Any

from roboyard.pybullet.face.errors import failure

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
_PLAIN = (tuple, list)


def floats(values: Iterable[float], count: int, message: str) -> tuple[float, ...]:
    """`count` numbers as floats.

    Raises:
        error: with PyBullet's `message`, for another count or something that is no sequence.
        TypeError: an element is no number.
    """
    try:
        found = tuple(values)
    except TypeError:
        raise failure(message, f"{count} numbers are needed, got {values!r}") from None
    if len(found) != count:
        raise failure(message, f"{count} numbers are needed, got {len(found)}: {found!r}")
    return tuple(number(value) for value in found)


def number(value: Any) -> float:
    """A float; unlike `float()` it refuses text."""
    if type(value) is float:
        return value
    if isinstance(value, str | bytes):
        raise TypeError(f"must be real number, not {type(value).__name__}")
    return float(value)


def vector3(values: Iterable[float], message: str) -> Vector3:
    if type(values) in _PLAIN and len(values) == 3:  # type: ignore[arg-type]
        x, y, z = values
        if type(x) is type(y) is type(z) is float:
            return x, y, z
    x, y, z = floats(values, 3, message)
    return x, y, z


def quaternion(values: Iterable[float], message: str) -> Quaternion:
    """Four numbers as given, not normalised."""
    if type(values) in _PLAIN and len(values) == 4:  # type: ignore[arg-type]
        x, y, z, w = values
        if type(x) is type(y) is type(z) is type(w) is float:
            return x, y, z, w
    x, y, z, w = floats(values, 4, message)
    return x, y, z, w


def whole(value: Any) -> int:
    """An int; refuses floats, as PyBullet does."""
    return index(value)


def indices(values: Iterable[int], message: str = "expected a sequence of joint indices") -> list[int]:
    """Whole numbers from any sequence, as PyBullet reads them: cut floats, and -1 for what is no number."""
    try:
        return [value if type(value) is int else _cut(value) for value in values]
    except TypeError:
        raise failure(message) from None


def _cut(value: Any) -> int:
    try:
        return -1 if isinstance(value, str | bytes) else int(value)
    except (TypeError, ValueError):
        return -1


def text(value: Any) -> str:
    """A str; refuses paths and bytes, as PyBullet does."""
    if not isinstance(value, str):
        raise TypeError(f"must be str, not {type(value).__name__}")
    return value
