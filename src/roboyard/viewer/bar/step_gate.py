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
            on_change: called when `playing` or `speed` changed, in any thread, one change after the other; it
                must return quickly.
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

    def is_open(self) -> bool:
        """Return whether `wait` returns at once."""
        return self.playing and self.speed is None and not self._requests

    def wait(self, time: float) -> None:
        """Return when the next step may be made; call it in the stepping thread.

        Args:
            time: simulated time (s).
        """
        if self.is_open():
            return
        self._serve()
        unwatched = None
        while not self._is_closed:
            now = perf_counter()
            if self._is_watched():
                unwatched = None
            elif unwatched is None:
                unwatched = now
            elif now - unwatched > PATIENCE:
                self.play(True)
            with self._condition:
                rest = self._rest(now, time)
                if rest <= 0.0:
                    return
                self._condition.wait(min(rest, POLL))
            self._serve()

    def _serve(self) -> None:
        while self._requests:
            with self._condition:
                request = self._requests.pop(0)
            request()

    def _rest(self, now: float, time: float) -> float:
        """Return the time until the next step (s); 0: it may be made now, and counts as made.

        Call it with the lock: a page may pause or change the speed at any time.

        Args:
            now: wall clock (s).
            time: simulated time (s).
        """
        if not self.playing:
            if not self._steps:
                return POLL
            self._steps -= 1
            return 0.0
        if self.speed is None or not self._is_watched():
            return 0.0
        if self._anchor is None or time < self._anchor[1]:
            self._anchor = now, time
        rest = self._anchor[0] + (time - self._anchor[1]) / self.speed - now
        if rest < -MAX_DELAY:
            self._anchor = now, time
        return max(rest, 0.0)
