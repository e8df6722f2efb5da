"""Browser requests, executed in the simulation thread."""

from __future__ import annotations

import logging
import queue
from collections.abc import Callable

from roboyard.errors import RoboyardError

log = logging.getLogger(__name__)

Request = Callable[[], None]


class RequestQueue:
    """A queue that any thread may fill and the simulation thread empties.

    Errors of a request are reported, never raised: one page must not end the pages of others.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        """Start with an empty queue; `report` is called with the message of each error."""
        self._queue: queue.SimpleQueue[Request] = queue.SimpleQueue()
        self._report = report

    def do(self, request: Request) -> None:
        """Queue a request; may be called from any thread."""
        self._queue.put(request)

    def qsize(self) -> int:
        """Return the number of queued requests."""
        return self._queue.qsize()

    def execute_all(self) -> int:
        """Execute all requests queued so far; returns how many succeeded."""
        return sum(self.execute(self._queue.get()) for _ in range(self._queue.qsize()))

    def execute(self, request: Request) -> bool:
        """Execute one request; returns whether it succeeded."""
        try:
            request()
        except RoboyardError as error:
            self._report(str(error))
        except Exception as error:
            log.exception("a request of the page failed")
            self._report(f"request failed: {type(error).__name__}: {error}")
        else:
            return True
        return False

    def wait(self, seconds: float) -> bool:
        """Execute the next request within `seconds`; returns whether there was one and it succeeded."""
        try:
            request = self._queue.get(timeout=seconds)
        except queue.Empty:
            return False
        return self.execute(request)
