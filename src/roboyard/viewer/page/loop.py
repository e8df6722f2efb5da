"""The loop of a page that executes its requests and moves on, until it is stopped."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

from roboyard.viewer.page.requests import RequestQueue

TICK = 1.0 / 60.0
"""Period at which the page's requests are executed (s)."""


def serve(
    tick: Callable[[float], None],
    requests: RequestQueue,
    is_over: Callable[[], bool],
    *,
    after_request: Callable[[], None] = lambda: None,
) -> None:
    """Call `tick` every 1/60 s with the time that passed (s), and execute requests at once in between.

    Args:
        tick: moves on by the passed time.
        requests: requests of the page.
        is_over: whether the loop ends.
        after_request: called after a request between two ticks succeeded.
    """
    last = perf_counter()
    while not is_over():
        now = perf_counter()
        tick(now - last)
        last = now
        rest = TICK - (perf_counter() - now)
        if rest > 0 and requests.wait(rest):
            after_request()
