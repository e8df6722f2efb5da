"""Notices that strangers can cause: one at once, the rest of the same kind later as a count."""

from __future__ import annotations

import sys
from time import monotonic

from roboyard.untrusted.text import one_line

PERIOD = 60.0
"""Time for which further notices of a kind are only counted (s)."""
_MAX_KINDS = 100


class RepeatedNotices:
    """Prints notices to standard error."""

    def __init__(self, program: str) -> None:
        """Start without notices.

        Args:
            program: what each line starts with.
        """
        self._program = program
        self._kinds: dict[str, tuple[float, int]] = {}
        """Kind to the time of its last line and the notices since."""

    def say(self, kind: str, detail: str) -> None:
        """Print "program: kind: detail", or count it where one of the kind was printed within the period."""
        now = monotonic()
        last, count = self._kinds.get(kind, (now - PERIOD, 0))
        if now - last < PERIOD:
            self._kinds[kind] = last, count + 1
            return
        if len(self._kinds) >= _MAX_KINDS:
            self._kinds.clear()
        self._kinds[kind] = now, 0
        more = f" (and {count} more since the last of these lines)" if count else ""
        print(f"{self._program}: {kind}: {one_line(detail)}{more}", file=sys.stderr, flush=True)
