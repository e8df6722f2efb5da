"""Callbacks of the controls of a page, called in the order in which the pages changed them.

viser calls plain functions in a thread pool: of two changes in quick succession the older one may come last,
with the value of the newer one or its own, and two clicks at once may count as one.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable
from typing import Any

log = logging.getLogger(__name__)

Callback = Callable[[Any], Awaitable[None]]


def in_order(call: Callable[[Any], object]) -> Callback:
    """Return a callback for `on_update` and `on_click` that passes each event on, in order.

    Args:
        call: receives the event in the server's event loop; it must return quickly.
    """

    async def on_event(event: Any) -> None:
        # a coroutine runs in the event loop, in order
        try:
            call(event)
        except Exception:
            log.exception("a control of the page failed")

    return on_event


def of_pages(call: Callable[[Any], object]) -> Callback:
    """Return a callback as `in_order` does, that ignores changes by this program: only pages count."""
    return in_order(lambda event: call(event) if event.client_id is not None else None)


def carried_out_by(do: Callable[[Callable[[], None]], None]) -> Callable[[Callable[[], None]], Callback]:
    """Return a function that makes callbacks of changes, as `of_pages` does; `do` carries a change out."""
    return lambda change: of_pages(lambda _: do(change))
