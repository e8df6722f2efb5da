"""setRealTimeSimulation: the world steps in real time, in a thread of its own."""

from __future__ import annotations

import logging
import threading
from time import perf_counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

log = logging.getLogger(__name__)

MAX_DELAY = 0.1
"""Largest delay behind real time that is caught up (s)."""
NAME = "roboyard-clock"
"""Name of the thread."""
POLL_PERIOD = 0.002
"""Time between two checks of the clock (s)."""


class Clock:
    """Steps a client's world in real time while it runs."""

    def __init__(self, client: Client) -> None:
        """Create a stopped clock."""
        self._client = client
        self._thread: threading.Thread | None = None
        self._leave = threading.Event()

    def run(self, running: bool) -> None:
        """Start, or stop after the current step."""
        if running and self._thread is None:
            self._leave = threading.Event()
            self._thread = threading.Thread(target=self._tick, args=(self._leave,), name=NAME, daemon=True)
            self._thread.start()
        elif not running:
            self._leave.set()
            self._thread = None

    def may_step(self) -> bool:
        """Return False in the thread of a clock that was stopped while it waited for its turn."""
        thread = threading.current_thread()
        return thread.name != NAME or thread is self._thread

    def close(self) -> None:
        """Stop, and wait for the thread."""
        thread = self._thread
        self.run(False)
        if thread is not None:
            thread.join(timeout=2.0)

    def _tick(self, leave: threading.Event) -> None:
        client = self._client
        delay, last = 0.0, perf_counter()
        while not leave.wait(POLL_PERIOD):
            now = perf_counter()
            delay = min(delay + now - last, MAX_DELAY)
            last = now
            step = client.parameters.time_step
            while step > 0 and delay >= step and not leave.is_set():
                delay -= step
                try:
                    client.stepSimulation()
                except Exception:
                    log.exception("real-time simulation stopped")
                    return
