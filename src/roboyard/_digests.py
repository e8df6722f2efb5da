"""`blake2b` without the rest of `hashlib`, which takes 3 ms to load OpenSSL."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any


def blake2b(data: bytes | memoryview = b"", *, digest_size: int = 64) -> Any:
    """Return the hash that `hashlib.blake2b` returns."""
    return _function()(data, digest_size=digest_size)


@cache
def _function() -> Any:
    try:
        return import_module("_blake2").blake2b
    except ImportError:  # another Python than CPython
        return import_module("hashlib").blake2b
