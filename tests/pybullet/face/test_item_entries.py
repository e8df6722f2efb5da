"""Debug drawings in machine code: the items of the Python functions, which end in time."""

from __future__ import annotations

from collections.abc import Iterator
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.face.entries import FRONT
from roboyard.pybullet.fast import fast_commands, item_entries

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)
A, B = [0, 0.5, 1], (1.0, 2, 3)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert FRONT.address()
    assert all(front.address() for front in (item_entries.LINE, item_entries.TEXT, item_entries.POINTS))
    monkeypatch.setattr(fast_commands, "FEW", 0)
    direct_calls.START.enter(waits=False)
    p.connect(p.DIRECT)
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


def items() -> Any:
    client: Any = CLIENTS[0]
    return client.debug_items


CALLS: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    (name, given, keywords)
    for name, given in (
        ("addUserDebugLine", (A, B, [1, 0, 0], 2)),
        ("addUserDebugLine", ([np.float64(1), 2, 3.5], np.array(B), [np.float32(1), 0, 0], 2)),
        ("addUserDebugText", ("text", A, B, 2)),
        ("addUserDebugPoints", ([A, B], ([1, 0, 0], (0, 0.5, 1)), 2)),
    )
    for keywords in (
        {},
        {"lifeTime": 0},
        {"lifeTime": 100},
        {"lifeTime": 0.5},
        {"lifeTime": -1.0},
        {"lifeTime": float("nan")},
        {"lifeTime": "1"},
        {"lifeTime": None},
        {"lifeTime": 5.0, "parentObjectUniqueId": 3, "parentLinkIndex": 1},
    )
]
CALLS += [
    ("addUserDebugPoints", given, {})
    for given in (
        ([A], [B]),
        ((A, B), (B, A), 3.5),
        (np.array([A, B]), [A, B]),
        ([np.array(A)], [B]),
        ([A, B], [A]),
        ([A, [1, 2]], [A, B]),
        ([A, [1, 2, "3"]], [A, B]),
        ([A, [1, 2, float("nan")]], [A, B]),
        ([], []),
        ("ab", [A, B]),
        ([1, 2, 3], [1, 2, 3]),
        ([A], [B], "2"),
        ([A], [B], 1, 0, -1, -1, 0.5),
        ([A],),
    )
]


CALLS += [
    ("addUserDebugText", ("text", A), {"textOrientation": turn, "textSize": 2})
    for turn in (
        *([0, 0, 0, 1], (0.1, 0.2, 0.3, 0.9), np.array([0, 1.0, 0, 0]), [0, 0, 1], "abcd"),
        *([0, 0, 0, float("inf")], [0, 0, 0, None], 1.0),
    )
]


@pytest.mark.parametrize(("name", "given", "keywords"), CALLS)
def test_items_are_those_of_the_python_functions(
    name: str, given: tuple[Any, ...], keywords: dict[str, Any]
) -> None:
    answers, now = [], monotonic()
    for call in (getattr(p, name), getattr(p, name).__self__):
        try:
            number = call(*given, **keywords)
        except Exception as problem:
            answers.append((type(problem), str(problem)))
            continue
        (item,) = [item for key, item in items().drawings() if key == number]
        ending = None if item.expires is None else round(item.expires - now, 0)
        answers.append((type(item), repr(item[:-1]), ending))
        assert items().has_expiring == (ending is not None)
        p.removeUserDebugItem(number)
    assert answers[0] == answers[1]


def test_items_end_after_their_life_time() -> None:
    kept = p.addUserDebugLine(A, B)
    ends = [p.addUserDebugLine(A, B, lifeTime=0.02), p.addUserDebugText("text", A, lifeTime=0.02)]
    later = p.addUserDebugText("text", A, lifeTime=60)
    assert [key for key, _ in items().drawings()] == [kept, *ends, later]
    sleep(0.03)
    assert [key for key, _ in items().drawings()] == [kept, later]


def test_points_are_copies_and_replace_others() -> None:
    positions, colors = [[0.0, 1, 2], [3, 4, 5]], [[1, 0, 0], (0, 0, 1)]
    number = p.addUserDebugPoints(positions, colors)
    positions[0][0] = 7
    ((key, item),) = items().drawings()
    assert (key, item.positions.tolist()) == (number, [[0, 1, 2], [3, 4, 5]])
    assert item.rgb.tolist() == [[1, 0, 0], [0, 0, 1]]
    assert p.addUserDebugPoints(positions, colors, replaceItemUniqueId=number) == number
    ((_, item),) = items().drawings()
    assert item.positions.tolist() == positions


@pytest.mark.parametrize(
    "given",
    [
        ("name",),
        ("name", 1, 0),
        ("name", -2, np.float64(2), 1),
        ("", 0.0, 1.0, 2**70),
        (b"name", 0, 1),
        ("name", "0"),
        ("name", None),
        (),
        ("name", 0, 1, float("inf")),
    ],
    ids=repr,
)
def test_sliders_are_those_of_the_python_function(given: tuple[Any, ...]) -> None:
    answers = []
    for call in (p.addUserDebugParameter, p.addUserDebugParameter.__self__):
        try:
            number = call(*given)
        except Exception as problem:
            answers.append((type(problem), str(problem)))
            continue
        before = items().revision
        answers.append((repr(items().parameters[number]), p.readUserDebugParameter(number)))
        p.removeUserDebugItem(number)
        assert number not in items().parameters
        assert items().revision == before + 1
    assert answers[0] == answers[1]


def test_all_sliders_are_removed() -> None:
    assert [p.addUserDebugParameter("a"), p.addUserDebugLine(A, B), p.addUserDebugParameter("b")] == [0, 1, 2]
    p.removeAllUserDebugItems()
    assert [*items().parameters] == [0, 2]
    p.removeAllUserParameters()
    assert not items().parameters
