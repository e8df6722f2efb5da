"""The loop of the pages: requests at once, ticks in real time."""

from __future__ import annotations

import threading

import pytest

from roboyard.viewer.page.loop import serve
from roboyard.viewer.page.requests import RequestQueue


def test_passed_times_add_up_and_requests_do_not_wait_for_a_tick() -> None:
    passed: list[float] = []
    called: list[str] = []
    requests = RequestQueue(called.append)

    def tick(seconds: float) -> None:
        passed.append(seconds)
        if len(passed) == 3:
            requests.do(lambda: called.append("request"))

    serve(tick, requests, lambda: len(passed) == 8, after_request=lambda: called.append("after"))
    assert called == ["request", "after"]
    assert passed[0] == pytest.approx(0.0, abs=0.01)
    assert sum(passed) > 6 / 60.0  # seven periods, one of which a request shortened


def test_a_failed_request_is_reported_and_the_loop_goes_on() -> None:
    reported: list[str] = []
    after: list[int] = []
    requests = RequestQueue(reported.append)
    stop = threading.Event()

    def fail() -> None:
        raise ZeroDivisionError("no")

    requests.do(fail)
    requests.do(stop.set)
    serve(lambda _: None, requests, stop.is_set, after_request=lambda: after.append(1))
    assert reported == ["request failed: ZeroDivisionError: no"]
    assert len(after) == 1
