"""`blake2b` without the rest of `hashlib`, which takes 3 ms to load OpenSSL."""

from __future__ import annotations

try:
    from _blake2 import blake2b
except ImportError:  # another Python than CPython
    from hashlib import blake2b

__all__ = ["blake2b"]
