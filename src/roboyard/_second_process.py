"""A second process that takes calls over from this one, so that two cores work at a time.

Threads of one process would hold each other up: Python runs one of them at a time, and while one loads a
library, others wait.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any, Generic, TypeVar

from roboyard._threads import VARIABLE, thread_count

T = TypeVar("T")


class NotDone(Exception):
    """The second process did not return a result."""


class Part(Generic[T]):
    """A call that the second process makes once it has made those before."""

    def __init__(
        self, function: Callable[..., T], arguments: tuple[Any, ...], future: Future[T] | None
    ) -> None:
        self._function, self._arguments, self._future = function, arguments, future

    @property
    def under_way(self) -> bool:
        """Whether the second process has begun with it, so that its result is waited for."""
        return self._future is not None and (self._future.running() or self._future.done())

    def result(self) -> T:
        """Return what the function returns; call it here if the second process has not begun, or failed.

        Raises:
            Exception: what the function raises.
        """
        if self._future is not None and not self._future.cancel():
            with suppress(NotDone):
                return self._future.result()
        return self._function(*self._arguments)


class SecondProcess:
    """Makes calls in the order in which they are given, where a second core may be used.

    A context manager: the process ends with it, even in the middle of a call.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._calls = ThreadPoolExecutor(max_workers=1, thread_name_prefix="second-process")

    def __enter__(self) -> SecondProcess:
        """Return the second process, not begun."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        process, self._process = self._process, None
        self._calls.shutdown(wait=False, cancel_futures=True)
        if process is not None:
            process.kill()
            process.wait()
            self._calls.shutdown()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    with suppress(OSError):  # what was not sent is lost with the process
                        pipe.close()

    def begin(self) -> None:
        """Start the process; calls given before are made here when their result is asked for."""
        if self._process is not None or thread_count(2) < 2 or not sys.executable:
            return
        path = os.pathsep.join(entry for entry in sys.path if entry)
        with suppress(OSError):  # no process may be started here
            self._process = subprocess.Popen(  # noqa: S603 - our own module, our own interpreter
                [sys.executable, "-P", "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": path, VARIABLE: "1"},
            )

    def call(self, function: Callable[..., T], *arguments: Any) -> Part[T]:
        """Have a module's function called; its arguments are those of now, even if they change later."""
        future = None
        if self._process is not None:
            try:
                request = pickle.dumps((function, arguments), protocol=5)
            except Exception:  # classes define how they are pickled
                request = None
            if request is not None:
                future = self._calls.submit(_answer, self._process, request)
        return Part(function, arguments, future)


def _answer(process: subprocess.Popen[bytes], request: bytes) -> Any:
    """Send a request; return the result.

    Raises:
        NotDone: the function raised an exception, or the process ended.
    """
    assert process.stdin is not None and process.stdout is not None
    try:
        process.stdin.write(request)
        process.stdin.flush()
        is_done, value = pickle.load(process.stdout)  # noqa: S301 - our own process
    except Exception as error:
        raise NotDone from error
    if not is_done:
        raise NotDone
    return value


def main() -> None:
    """Make calls until the other process ends; nothing but results goes to standard output."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the other process decides
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            function, arguments = pickle.load(sys.stdin.buffer)  # noqa: S301 - our own process
        except EOFError:
            return
        except Exception:
            answer = pickle.dumps((False, None))
        else:
            try:
                answer = pickle.dumps((True, function(*arguments)), protocol=5)
            except Exception:  # it is raised again where the other process makes the call
                answer = pickle.dumps((False, None))
        try:
            answers.write(answer)
            answers.flush()
        except OSError:
            return


if __name__ == "__main__":
    main()
