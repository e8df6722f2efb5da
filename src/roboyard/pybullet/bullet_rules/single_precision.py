"""Numbers and quaternions as Bullet's 32-bit floats and rotation matrices return them."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan, sqrt
from struct import Struct, error

Numbers = tuple[float, ...]
_FLOATS = {n: Struct(f"{n}f") for n in (1, 3, 4, 7, 8, 14)}


def rounded(*numbers: float) -> Numbers:
    """Return 1, 3, 4, 7, 8 or 14 numbers rounded to 32-bit floats; infinite if too large.

    Raises:
        TypeError: an argument is not a number.
    """
    pack = _FLOATS[len(numbers)]
    try:
        return pack.unpack(pack.pack(*numbers))
    except error as problem:
        raise TypeError(f"numbers are needed: {problem}") from None
    except OverflowError:
        return (nan,) * len(numbers)


def canonical_quaternion(quaternion: Sequence[float]) -> Numbers:
    """Return `canonical` of a quaternion (x, y, z, w)."""
    return canonical(*quaternion)


def canonical(x: float, y: float, z: float, w: float) -> Numbers:
    """Return x, y, z, w with length 1 and the sign that Bullet reads from a rotation matrix.

    w is positive if the matrix has a positive trace (w² > 1/4), otherwise the largest of x, y, z is. NaN for
    length 0.
    """
    length = sqrt(x * x + y * y + z * z + w * w)
    if length == 0.0:
        return (nan,) * 4
    if 4.0 * w * w > length * length:
        leading = w
    else:
        leading = max(x, y, z, key=abs)
    length = -length if leading < 0.0 else length
    return x / length, y / length, z / length, w / length


def matrix_signed(x: float, y: float, z: float, w: float) -> tuple[float, float, float, float]:
    """Return a quaternion, of its own length, with the sign that Bullet reads from its rotation matrix.

    See `canonical`. Entries of the matrix are compared, so that rounding decides between equal sizes as it
    does there.
    """
    if w > 0.5:
        return x, y, z, w
    length = x * x + y * y + z * z + w * w
    if length == 0.0:
        return x, y, z, w
    scale = 2.0 / length
    xx, yy, zz = x * (x * scale), y * (y * scale), z * (z * scale)
    a, b, c = 1.0 - (yy + zz), 1.0 - (xx + zz), 1.0 - (xx + yy)
    if a + b + c > 0.0:
        leading = w
    elif a < b:
        leading = z if b < c else y
    else:
        leading = z if a < c else x
    if leading < 0.0:
        return 0.0 - x, 0.0 - y, 0.0 - z, 0.0 - w
    return x, y, z, w
