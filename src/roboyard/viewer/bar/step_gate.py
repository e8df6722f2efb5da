"""Pause, single steps and speed of a simulation that a script steps, not the page."""

from __future__ import annotations

import threading
from collections.abc import Callable
from time import perf_counter

POLL = 0.05
"""Longest wait before requests and open pages are looked at again (s)."""
PATIENCE = 3.0
"""Time without an open page after which a paused script goes on (s)."""
MAX_DELAY = 0.1
"""Largest delay behind the chosen speed that is caught up (s)."""

Request = Callable[[], None]


class StepGate:
    """Holds the thread that steps a world between two steps. Without an open page it never does."""

    def __init__(self, is_watched: Callable[[], bool], on_change: Callable[[StepGate], None]) -> None:
        """Start open, as fast as possible.

        Args:
            is_watched: returns whether a page is open.
            on_change: called when `playing` or `speed` changed, in any thread.
        """
        self._is_watched, self._on_change = is_watched, on_change
        self._condition = threading.Condition()
        self._steps = 0
        self._requests: list[Request] = []
        self._is_closed = False
        self._anchor: tuple[float, float] | None = None
        """Wall clock and simulated time (s) from which the speed counts."""
        self.playing = True
        self.speed: float | None = None
        """Simulated seconds per second; None: as fast as possible."""

    def play(self, playing: bool) -> None:
        """Let steps pass, or hold the next one; from any thread."""
        with self._condition:
            self.playing, self._anchor, self._steps = playing, None, 0
            self._condition.notify_all()
        self._on_change(self)

    def step(self) -> None:
        """Pause, and let one step pass; from any thread."""
        with self._condition:
            self.playing, self._steps = False, self._steps + 1
            self._condition.notify_all()
        self._on_change(self)

    def set_speed(self, speed: float | None) -> None:
        """Limit simulated seconds per second; None: as fast as possible."""
        with self._condition:
            self.speed, self._anchor = speed, None
            self._condition.notify_all()
        self._on_change(self)

    def do(self, request: Request) -> None:
        """Let the stepping thread call `request` before its next step, also while paused."""
        with self._condition:
            self._requests.append(request)
            self._condition.notify_all()

    def close(self) -> None:
        """Let every step pass from now on."""
        with self._condition:
            self._is_closed = True
            self._condition.notify_all()

    def wait(self, time: float) -> None:
        """Return when the next step may be made; call it in the stepping thread.

        Args:
            time: simulated time (s).
        """
        if self.playing and self.speed is None and not self._requests:
            return
        self._serve()
        unwatched = None
        while not self._is_closed and not self._may_pass():
            now = perf_counter()
            if self._is_watched():
                unwatched = None
            elif unwatched is None:
                unwatched = now
            elif now - unwatched > PATIENCE:
                self.play(True)
                return
            with self._condition:
                self._condition.wait(POLL)
            self._serve()
        if self.playing and self.speed is not None and self._is_watched():
            self._wait_for(time)

    def _may_pass(self) -> bool:
        with self._condition:
            if self.playing:
                return True
            if not self._steps:
                return False
            self._steps -= 1
            return True

    def _serve(self) -> None:
        while self._requests:
            with self._condition:
                request = self._requests.pop(0)
            request()

    def _wait_for(self, time: float) -> None:
        """Wait until the wall clock has caught up with the simulated time (s)."""
        while not self._is_closed and self.playing and self.speed is not None:
            now = perf_counter()
            if self._anchor is None or time < self._anchor[1]:
                self._anchor = now, time
            due = self._anchor[0] + (time - self._anchor[1]) / self.speed
            if now - due > MAX_DELAY:
                self._anchor = now, time
                return
            if due <= now:
                return
            with self._condition:
                self._condition.wait(min(due - now, POLL))
            self._serve()
