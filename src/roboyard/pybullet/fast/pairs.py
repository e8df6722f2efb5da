"""Kinds of numbers in tables of machine code that changes properties, in place of an argument's length."""

from __future__ import annotations

SIGNED, PAIR, SIGNED_PAIR = -1, -2, -3
"""Any number below 1e32 but the default; or an argument that belongs together with the next one: both are
given and numbers of at least 0, or any numbers of which one may be missing."""
