"""What pages ask for, done in the thread that steps the world."""

from __future__ import annotations

import logging
import queue
from collections.abc import Callable

from roboyard.errors import RoboyardError

log = logging.getLogger("roboyard.viewer")

Wish = Callable[[], None]


class RequestQueue:
    """A queue that any thread may fill and one thread empties.

    What goes wrong in a wish is told, never raised: one page must not end the page of everyone.
    """

    def __init__(self, complain: Callable[[str], None]) -> None:
        """Begin without wishes; `complain` is told what went wrong."""
        self._queue: queue.SimpleQueue[Wish] = queue.SimpleQueue()
        self._complain = complain

    def do(self, wish: Wish) -> None:
        """Have something done at the next look; may be called from any thread."""
        self._queue.put(wish)

    def qsize(self) -> int:
        """How many wait."""
        return self._queue.qsize()

    def fulfil_all(self) -> int:
        """Do all that were there when this was called; how many went well."""
        return sum(self.fulfil(self._queue.get()) for _ in range(self._queue.qsize()))

    def fulfil(self, wish: Wish) -> bool:
        """Do it; whether it went well."""
        try:
            wish()
        except RoboyardError as error:
            self._complain(str(error))
        except Exception as error:
            log.exception("a wish of the page failed")
            self._complain(f"that did not work: {type(error).__name__}: {error}")
        else:
            return True
        return False

    def wait(self, seconds: float) -> bool:
        """Sleep, but for a wish that arrives, which is done; whether one was and went well."""
        try:
            wish = self._queue.get(timeout=seconds)
        except queue.Empty:
            return False
        return self.fulfil(wish)
