"""Single keys from a terminal, whose settings are restored however the program ends."""

from __future__ import annotations

import atexit
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any

from roboyard.errors import ConfigError

_SEQUENCES = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
ESCAPE_TIME = 0.03
"""Time after which an escape byte is the Esc key and not the start of a sequence (s)."""


class RawKeys:
    """Reads keys as they are pressed, without echo; a context manager. Ctrl-C still interrupts."""

    def __init__(self, descriptor: int | None = None) -> None:
        """Use the terminal on a file descriptor (standard input by default).

        Raises:
            ConfigError: it is not a terminal.
        """
        self._descriptor: int = _standard_input() if descriptor is None else descriptor
        if self._descriptor < 0 or not os.isatty(self._descriptor):
            raise ConfigError(
                f"driving by keys needs a terminal, got file descriptor {self._descriptor}; "
                "use --control-mode random without a terminal"
            )
        self._saved: list[Any] | None = None
        self._on_termination: Any = None
        self._rest = b""
        self._since = 0.0

    def __enter__(self) -> RawKeys:
        """Switch the terminal to single keys without echo."""
        import termios
        import tty

        self._saved = termios.tcgetattr(self._descriptor)
        atexit.register(self.restore)
        if threading.current_thread() is threading.main_thread():
            self._on_termination = signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
        tty.setcbreak(self._descriptor)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the terminal and the handler of SIGTERM."""
        self.restore()
        atexit.unregister(self.restore)
        if self._on_termination is not None:
            signal.signal(signal.SIGTERM, self._on_termination)

    def restore(self) -> None:
        """Restore the settings of the terminal."""
        import termios

        if self._saved is not None:
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._saved)
            self._saved = None

    def read(self) -> list[str]:
        """Return the keys pressed since the last call, in order, without blocking.

        Letters are in lower case; other keys are "up", "down", "left", "right" and "escape".
        """
        while select.select([self._descriptor], [], [], 0.0)[0]:
            got = os.read(self._descriptor, 1024)
            if not got:
                return [*self._decode(final=True), "escape"]  # the terminal was closed
            self._rest += got
            self._since = time.monotonic()
        return self._decode(final=time.monotonic() - self._since > ESCAPE_TIME)

    def _decode(self, *, final: bool) -> list[str]:
        keys, self._rest = decode(self._rest, final=final)
        return keys


def _standard_input() -> int:
    try:
        return sys.stdin.fileno()
    except (OSError, ValueError):
        return -1


def decode(data: bytes, *, final: bool) -> tuple[list[str], bytes]:
    """Return the keys in bytes read from a terminal, and the rest that may be the start of another key.

    Args:
        data: the bytes.
        final: an unfinished sequence will not be continued.
    """
    keys: list[str] = []
    k = 0
    while k < len(data):
        if data[k : k + 1] != b"\x1b":
            keys.append(chr(data[k]).lower())
            k += 1
            continue
        rest = data[k + 1 : k + 3]
        if len(rest) == 2 and rest[:1] in (b"[", b"O"):
            end = k + 2
            while end < len(data) and not 0x40 <= data[end] <= 0x7E:
                end += 1
            if end == len(data) and not final:
                return keys, data[k:]
            if data[end : end + 1] in _SEQUENCES:
                keys.append(_SEQUENCES[data[end : end + 1]])
            k = end + 1
        elif rest in (b"", b"[", b"O") and not final:
            return keys, data[k:]
        else:
            keys.append("escape")
            k += 1
    return keys, b""


KeySource = Callable[[], list[str]]
"""Returns the keys pressed since its last call."""
