"""Keys by which machine code finds what is prepared for rays with a mask of filter groups."""

from __future__ import annotations

LARGEST_MASK = 2**31
"""Rays with a larger one, or a smaller negative one, go to the Python functions."""


def key_of(mask: int, is_numbered: bool) -> int:
    """Return the key for a mask, and for hits by numbers; those of the default mask are 0 and 1."""
    return 2 * (mask + 1) + int(is_numbered)
