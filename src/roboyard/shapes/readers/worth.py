"""When text is read by compiled loops: where they are at hand, or much was read without them."""

from __future__ import annotations

from typing import Any

from roboyard.native import Kernel

SMALL = 10_000
"""Bytes of all texts up to which one is read without compiled loops."""
LARGE = 500_000
"""Bytes read without a loop, by one process, from which it is worth its compilation, which happens once."""
_read_without: dict[str, int] = {}
_seen = 0


def is_large(size: int) -> bool:
    """Return whether a text (bytes), together with all before it, is one for which loops may be loaded."""
    global _seen
    _seen += size
    return _seen >= SMALL


def is_worth(loop: Any, size: int) -> bool:
    """Return whether a compiled loop should read a text of this size (bytes)."""
    if not isinstance(loop, Kernel) or loop.is_ready:
        return True
    name = loop.__name__
    _read_without[name] = _read_without.get(name, 0) + size
    return _read_without[name] >= LARGE and loop.is_cheap
