"""Threads that call commands take turns, as with PyBullet, whose functions keep the interpreter's lock.

Commands that are functions of Python hold a lock. Machine code does not take it: one thread alone enters it,
and a call from another one ends that, once no command runs that machine code called.
"""

from __future__ import annotations

import os
import sys
from _thread import RLock, get_ident
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import sleep
from typing import Any

RUNNING, OWNER = range(2)
"""Places in `Turns.machine`."""
_POLL_PERIOD = 0.0002  # s


class Turns:
    """The lock of commands, and which thread enters machine code."""

    def __init__(self) -> None:
        """Begin without threads."""
        self.lock = RLock()
        """Held by each call through Python."""
        self.callers: set[int] = set()
        """The threads that have called through Python."""
        self.machine: Any = None
        """(2,) int64 once NumPy is there: how many commands run that machine code called, and the thread that
        enters it."""
        if hasattr(os, "register_at_fork"):  # a child has no other thread that could end its turn
            os.register_at_fork(
                before=self.lock.acquire,
                after_in_parent=self.lock.release,
                after_in_child=self._begin_in_child,
            )

    def call(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Any:
        """Return the result of a function in this thread's turn."""
        self.callers.add(get_ident())
        with self.lock:
            return function(*args, **kwargs)

    def in_machine(self) -> Any:
        """Return `machine`."""
        if self.machine is None:
            import numpy as np  # loaded by now, in parts (`load_numpy`)

            self.machine = np.zeros(2, np.int64)
        return self.machine

    def own(self) -> None:
        """Let this thread alone enter machine code."""
        self.in_machine()[OWNER] = get_ident()

    def is_shared(self) -> bool:
        """Return whether more than one thread that has called is still there."""
        return len(self.callers) > 1 and len(self.callers & sys._current_frames().keys()) > 1

    def has_owner(self) -> bool:
        """Return whether the thread that enters machine code is still there."""
        return int(self.machine[OWNER]) in sys._current_frames()

    def wait_for_machine(self) -> None:
        """Return once no command runs that machine code called."""
        while self.machine[RUNNING]:
            sleep(_POLL_PERIOD)

    @contextmanager
    def given_up(self) -> Iterator[None]:
        """Let other threads call commands while this one waits for something else within a command."""
        depth, running = 0, 0
        while self._release():
            depth += 1
        machine = self.machine
        if machine is not None and machine[OWNER] == get_ident():
            running, machine[RUNNING] = int(machine[RUNNING]), 0
        try:
            yield
        finally:
            for _ in range(depth):
                self.lock.acquire()
            if machine is not None and running:
                machine[RUNNING] += running

    def _release(self) -> bool:
        try:
            self.lock.release()
        except RuntimeError:  # this thread does not hold it
            return False
        return True

    def _begin_in_child(self) -> None:
        if self.machine is not None and self.machine[OWNER] != get_ident():
            self.machine[RUNNING] = 0
        self.lock.release()


TURNS = Turns()
