"""Ctrl-C that is never lost: compiled extensions may clear the exception raised in their calls."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any


class Interrupts:
    """Remembers Ctrl-C while it is entered; a context manager.

    The first Ctrl-C raises `KeyboardInterrupt` at once, as usual; where that is lost, `check`
    raises it again.
    Outside of the main thread, which alone receives signals, nothing changes.
    """

    def __init__(self) -> None:
        """Begin without an interrupt."""
        self._pending = False
        self._before: Any = None

    def __enter__(self) -> Interrupts:
        """Take over SIGINT, unless a program handles it in its own way."""
        main = threading.current_thread() is threading.main_thread()
        if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._before = signal.signal(signal.SIGINT, self._on_interrupt)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give SIGINT back."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
            self._before = None

    def _on_interrupt(self, number: int, frame: FrameType | None) -> None:
        self._pending = True
        raise KeyboardInterrupt

    def check(self) -> None:
        """Raise `KeyboardInterrupt` where one was lost."""
        if self._pending:
            raise KeyboardInterrupt
