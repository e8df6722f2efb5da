"""Compiled loops read text where they are at hand, or where compiling them pays."""

from __future__ import annotations

import pytest

from roboyard.native import Kernel
from roboyard.shapes.readers import worth


class Loop(Kernel):
    """A loop that says of itself whether it is stored, and whether it can be."""

    def __init__(self, *, ready: bool, cheap: bool) -> None:
        self.__name__ = "loop"
        self._answers = ready, cheap

    @property
    def is_ready(self) -> bool:
        return self._answers[0]

    @property
    def is_cheap(self) -> bool:
        return self._answers[1]


@pytest.fixture(autouse=True)
def nothing_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worth, "_read_without", {})


def test_a_loop_at_hand_is_used() -> None:
    assert worth.is_worth(Loop(ready=True, cheap=True), 1)
    assert worth.is_worth(len, 1)  # loaded: a function


def test_many_small_texts_pay_for_a_compilation() -> None:
    loop = Loop(ready=False, cheap=True)
    answers = [worth.is_worth(loop, worth.LARGE // 4) for _ in range(5)]
    assert answers == [False, False, False, True, True]


def test_a_loop_that_cannot_be_kept_is_not_compiled() -> None:
    assert not worth.is_worth(Loop(ready=False, cheap=False), 2 * worth.LARGE)
