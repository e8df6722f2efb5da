"""Calls that a second process takes over."""

from __future__ import annotations

import os
import signal
import time
from operator import truediv

import pytest

from roboyard._second_process import SecondProcess
from roboyard._threads import VARIABLE


@pytest.fixture(autouse=True)
def _cores(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the machine have two cores."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setattr("os.cpu_count", lambda: 2)


def test_another_process_makes_the_calls() -> None:
    with SecondProcess() as second:
        second.begin()
        parts = [second.call(os.getpid), second.call(sorted, [3, 1, 2])]
        while not all(part.under_way for part in parts):
            time.sleep(0.01)
        other, ordered = (part.result() for part in parts)
        assert other != os.getpid() and ordered == [1, 2, 3]
        os.kill(other, 0)  # it waits for more
    with pytest.raises(ProcessLookupError):
        os.kill(other, 0)


def test_a_call_that_has_not_begun_is_made_here() -> None:
    with SecondProcess() as second:
        second.begin()
        second.call(time.sleep, 600.0)
        began = time.monotonic()
        assert second.call(os.getpid).result() == os.getpid()
        assert time.monotonic() - began < 60.0


def test_arguments_are_those_of_the_call() -> None:
    given = [1]
    with SecondProcess() as second:
        second.begin()
        part = second.call(list, given)
        while not part.under_way:
            time.sleep(0.01)
        given.append(2)
        assert part.result() == [1]


def test_exceptions_are_those_of_the_function() -> None:
    with SecondProcess() as second:
        second.begin()
        for _ in range(2):
            part = second.call(truediv, 1, 0)
            while not part.under_way:
                time.sleep(0.01)
            with pytest.raises(ZeroDivisionError):
                part.result()
        assert second.call(truediv, 4, 2).result() == 2.0


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_a_process_that_dies_costs_nothing() -> None:
    with SecondProcess() as second:
        second.begin()
        first = second.call(os.getpid)
        while not first.under_way:
            time.sleep(0.01)
        os.kill(first.result(), signal.SIGKILL)
        for _ in range(3):
            part = second.call(sorted, "ba")
            while not part.under_way:
                time.sleep(0.01)
            assert part.result() == ["a", "b"]


def test_what_cannot_be_sent_is_done_here() -> None:
    with SecondProcess() as second:
        second.begin()
        assert second.call(lambda: os.getpid()).result() == os.getpid()


def test_output_of_a_call_is_no_result(capfd: pytest.CaptureFixture[str]) -> None:
    with SecondProcess() as second:
        second.begin()
        part = second.call(os.write, 1, b"said")
        while not part.under_way:
            time.sleep(0.01)
        assert part.result() == 4
        assert second.call(sorted, "ba").result() == ["a", "b"]
    captured = capfd.readouterr()
    assert captured.out == "" and "said" in captured.err


def test_one_core_needs_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "1")
    with SecondProcess() as second:
        second.begin()
        assert second.call(os.getpid).result() == os.getpid()


def test_it_ends_with_the_block() -> None:
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt), SecondProcess() as second:
        second.begin()
        part = second.call(time.sleep, 600.0)
        while not part.under_way:
            time.sleep(0.01)
        raise KeyboardInterrupt
    assert time.monotonic() - began < 60.0
