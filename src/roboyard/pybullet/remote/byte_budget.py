"""The memory that messages of all clients may hold while they arrive."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache

from roboyard.pybullet.face.wire import MAX_BODY, WireError

MAX_BYTES = 2 * MAX_BODY
"""Bytes of all messages that are arriving."""
SMALL_BYTES = 65536
"""Messages up to this size need no reservation."""
TRIM_BYTES = 4 * 1024 * 1024
"""After a larger message, freed memory is returned to the operating system."""


class ByteBudget:
    """Bytes that are reserved and released."""

    def __init__(self) -> None:
        """Start with nothing reserved."""
        self.used = 0

    def reserve(self, count: int) -> None:
        """Reserve bytes.

        Raises:
            WireError: the messages that are arriving hold too much already.
        """
        if count > SMALL_BYTES and self.used + count > MAX_BYTES:
            raise WireError("other clients are sending too much at the moment; try again")
        self.used += count

    def release(self, count: int) -> None:
        """Release reserved bytes."""
        self.used -= count


def give_back(size: int) -> None:
    """Return freed memory to the operating system after a message of `size` bytes, if the C library can."""
    trim = _trim() if size > TRIM_BYTES else None
    if trim is not None:
        trim(0)


@cache
def _trim() -> Callable[[int], object] | None:
    try:
        return ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):  # another C library
        return None
