"""The gate between a script's steps while a page pauses, steps and changes the speed at any time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import pytest

from roboyard.viewer.bar.step_gate import StepGate


class SlowTime(float):
    """A simulated time whose comparison lets another thread run first."""

    compared: threading.Event
    changed: threading.Event

    def __new__(cls, time: float, compared: threading.Event, changed: threading.Event) -> SlowTime:
        slow = super().__new__(cls, time)
        slow.compared, slow.changed = compared, changed
        return slow

    def __lt__(self, other: float) -> bool:
        self.compared.set()
        self.changed.wait(0.3)  # never comes where changes wait for each other
        return float(self) < other


class Steps:
    """A thread that steps, each step 1 ms of simulated time."""

    def __init__(self, gate: StepGate) -> None:
        self.gate, self.count, self.is_over = gate, 0, False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self.is_over:
            self.count += 1
            self.gate.wait(0.001 * self.count)

    def close(self) -> None:
        self.is_over = True
        self.gate.close()
        self._thread.join(5)


@pytest.fixture
def gate() -> Iterator[StepGate]:
    gate = StepGate(lambda: True, lambda _: None)
    yield gate
    gate.close()


@pytest.mark.parametrize("change", [lambda gate: gate.play(False), lambda gate: gate.set_speed(None)])
def test_a_change_between_two_looks_at_the_speed_is_no_error(
    gate: StepGate, change: Callable[[StepGate], None]
) -> None:
    compared, changed = threading.Event(), threading.Event()
    gate.set_speed(0.001)
    gate.wait(0.0)  # the speed counts from here
    errors: list[BaseException] = []

    def step() -> None:
        try:
            gate.wait(SlowTime(1.0, compared, changed))
        except BaseException as error:
            errors.append(error)

    stepping = threading.Thread(target=step)
    stepping.start()
    assert compared.wait(5)
    change(gate)
    changed.set()
    gate.play(True)
    gate.set_speed(None)
    stepping.join(5)
    assert not stepping.is_alive()
    assert errors == []


def test_the_last_of_two_changes_is_shown_last() -> None:
    shown: list[bool] = []
    looked, second = threading.Event(), threading.Event()

    def show(gate: StepGate) -> None:
        playing = gate.playing
        if not looked.is_set():
            looked.set()
            second.wait(0.3)  # never comes where changes wait for each other
        shown.append(playing)

    gate = StepGate(lambda: True, show)
    going_on = threading.Thread(target=lambda: gate.play(True))
    going_on.start()
    assert looked.wait(5)
    gate.play(False)
    second.set()
    going_on.join(5)
    assert shown[-1] is gate.playing is False


def test_a_step_at_a_slow_speed_is_one_step(gate: StepGate, wait: Callable[..., None]) -> None:
    gate.set_speed(0.0001)
    steps = Steps(gate)
    try:
        wait(lambda: steps.count == 2)  # the second one waits for the clock for 10 s
        gate.step()
        wait(lambda: steps.count == 3)
        time.sleep(0.3)
        assert steps.count == 3
        gate.play(False)
        time.sleep(0.3)
        assert steps.count == 3
        gate.step()
        wait(lambda: steps.count == 4)
    finally:
        steps.close()


def test_a_pause_at_a_slow_speed_holds_the_step_that_waits(gate: StepGate, wait: Callable[..., None]) -> None:
    gate.set_speed(0.0001)
    steps = Steps(gate)
    try:
        wait(lambda: steps.count == 2)
        gate.play(False)
        time.sleep(0.3)
        assert steps.count == 2
    finally:
        steps.close()
