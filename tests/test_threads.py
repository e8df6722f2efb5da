"""How many threads a task uses."""

from __future__ import annotations

import pytest

from roboyard._threads import VARIABLE, thread_count


@pytest.mark.parametrize(("given", "most"), [("1", 1), ("0", 1), ("2", 2), ("many", 3), ("", 3), ("9", 3)])
def test_the_variable_bounds_them(monkeypatch: pytest.MonkeyPatch, given: str, most: int) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(8)), raising=False)
    monkeypatch.setenv(VARIABLE, given)
    assert thread_count(3) == most


def test_no_more_than_one_a_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0}, raising=False)
    assert thread_count(2) == 1
