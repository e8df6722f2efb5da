"""Arguments that belong together with the next one, in tables of machine code that changes properties."""

from __future__ import annotations

PAIR, SIGNED_PAIR = -2, -3
"""In place of an argument's length: it and the next are numbers of at least 0, or any numbers."""
