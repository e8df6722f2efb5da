"""setRealTimeSimulation: the world steps on its own, as fast as the clock on the wall."""

from __future__ import annotations

import logging
import threading
from time import perf_counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboyard.pybullet.client import Client

log = logging.getLogger(__name__)

MOST_BEHIND = 0.1
"""s: what the world is behind the clock by more than this is given up"""
PAUSE = 0.002
"""s between two looks at the clock"""


class Clock:
    """Steps a client's world in a thread of its own while it is told to run."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._thread: threading.Thread | None = None
        self._leave = threading.Event()

    def run(self, running: bool) -> None:
        """Start, or stop after the step under way."""
        if running and self._thread is None:
            self._leave = threading.Event()
            self._thread = threading.Thread(
                target=self._tick, args=(self._leave,), name="roboyard-clock", daemon=True
            )
            self._thread.start()
        elif not running:
            self._leave.set()
            self._thread = None

    def close(self) -> None:
        """Stop and wait for it."""
        thread = self._thread
        self.run(False)
        if thread is not None:
            thread.join(timeout=2.0)

    def _tick(self, leave: threading.Event) -> None:
        client = self._client
        stood, last = 0.0, perf_counter()
        while not leave.wait(PAUSE):
            now = perf_counter()
            stood = min(stood + now - last, MOST_BEHIND)
            last = now
            step = client.parameters.time_step
            while step > 0 and stood >= step and not leave.is_set():
                stood -= step
                try:
                    client.stepSimulation()
                except Exception:
                    log.exception("real-time simulation stops")
                    return
