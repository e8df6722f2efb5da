"""Threads that draw parts of one picture, so that it uses several cores."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from functools import lru_cache
from time import monotonic
from typing import TYPE_CHECKING, TypeVar

from roboyard._threads import VARIABLE, thread_count

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

T = TypeVar("T")

MOST = 4
"""Most threads of one picture: each looks at all triangles, so more gain little."""
LEAST_PIXELS = 40000
"""Smaller pictures are drawn in less time than threads take to start."""
TRIED_AGAIN = 24
"""Pictures from one that is drawn the other way to the next."""
NEWEST = 0.3
"""Weight of the newest picture in the mean time."""
MOST_SLOWER = 1.5
"""Most that a picture's time may be of the mean before: other programs interrupt single pictures."""
WORTH_IT = 0.95
"""Largest share of the time of one part for which several are worth the work of further cores."""

_pool: ThreadPoolExecutor | None = None


def part_count(pixels: int) -> int:
    """Return in how many parts a picture of so many pixels is drawn.

    It is 1 outside the main thread: programs that draw in threads of their own use the cores that way.
    """
    if pixels < LEAST_PIXELS or threading.current_thread() is not threading.main_thread():
        return 1
    return _threads(os.environ.get(VARIABLE), int(monotonic()))


@lru_cache(1)
def _threads(given: str | None, second: int) -> int:
    """Return the number of threads, asked for once a second: the system's answer takes as long as a row.

    Args:
        given: text of the environment variable that it depends on.
        second: of the clock.
    """
    del given, second
    return thread_count(MOST)


class Pace:
    """Chooses in how many parts pictures of one kind are drawn: whichever took less time of late.

    Where other programs use the other cores, one part is faster. Pictures are the same either way.
    """

    def __init__(self) -> None:
        """Start without a measured picture."""
        self._seconds: dict[int, float] = {}
        self._drawn = 0

    def parts(self, most: int) -> int:
        """Return the number of parts of the next picture: 1 or `most`.

        Of the first picture it is 1, since to start threads may take longer than to draw it.
        """
        self._drawn += 1
        if most == 1 or self._drawn == 1:
            return 1
        if most not in self._seconds:
            return most
        if 1 not in self._seconds:
            return 1
        several = self._seconds[most] <= WORTH_IT * self._seconds[1]
        if self._drawn % TRIED_AGAIN == 0:
            several = not several
        return most if several else 1

    def note(self, parts: int, seconds: float) -> None:
        """Note how long a picture took; the first is not counted: it may have compiled loops."""
        if self._drawn > 1:
            before = self._seconds.get(parts, seconds)
            seconds = min(seconds, MOST_SLOWER * before)
            self._seconds[parts] = before + NEWEST * (seconds - before)


def even_bands(height: int, parts: int) -> list[tuple[int, int]]:
    """Return ranges of rows, two for each part where there are several: those that are faster take more."""
    count = 2 * parts if parts > 1 else 1
    return [(k * height // count, (k + 1) * height // count) for k in range(count)]


def in_parts(calls: Sequence[Callable[[], T]]) -> list[T]:
    """Return the results of calls that run at the same time; the first runs in this thread.

    Calls that no thread has begun with when this one is done run in this one, so that a busy machine is not
    waited for.
    """
    global _pool
    if len(calls) == 1:
        return [calls[0]()]
    if _pool is None:
        from concurrent.futures import ThreadPoolExecutor

        _pool = ThreadPoolExecutor(MOST - 1, thread_name_prefix="picture")
    futures: list[Future[T]] = [_pool.submit(call) for call in calls[1:]]
    try:
        found = [calls[0]()]
        results: dict[int, T] = {}
        for k in reversed(range(len(futures))):
            if futures[k].cancel():
                results[k] = calls[k + 1]()
        return found + [results[k] if k in results else futures[k].result() for k in range(len(futures))]
    finally:
        for future in futures:
            if not future.cancel():
                future.exception()


def _forget() -> None:
    """Start new threads in a process that was forked: those of its parent do not run there."""
    global _pool
    _pool = None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
