"""Lists that machine code reads are the arrays that NumPy makes of them."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.native.objects import arrays_have_the_known_layout
from roboyard.pybullet.connections import CLIENTS
from roboyard.pybullet.face import direct_calls
from roboyard.pybullet.fast import number_lists

pytestmark = pytest.mark.skipif(
    not (direct_calls.CAN_START and arrays_have_the_known_layout()), reason="machine code is not used here"
)


@pytest.fixture(autouse=True)
def _machine_code(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    assert number_lists.LISTS.address()
    monkeypatch.setattr(number_lists, "READER", number_lists.Reader())
    yield
    for number in list(CLIENTS):
        p.disconnect(number)


@pytest.mark.parametrize(
    "rows",
    [[[0, 1.5, 2]], [(1, 2, 3), [4, 5, True * 1.0]], ((-1e300, 2**40, 0.1),) * 50],
    ids=str,
)
def test_rows_are_read(rows: Any) -> None:
    found = number_lists.finite_rows(rows, 3)
    assert found is not None
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, np.array(rows, dtype=float))


@pytest.mark.parametrize(
    "rows",
    [
        [],
        "abc",
        [1, 2, 3],
        [[1, 2, 3], [1, 2]],
        [[1, 2, "3"]],
        [[1, 2, np.float64(3)]],
        [[1, 2, float("nan")]],
        [[1, 2, float("inf")]],
        [[1, 2, 2**70]],
        np.zeros((3, 3)),
        None,
    ],
    ids=str,
)
def test_other_rows_are_left_to_numpy(rows: Any) -> None:
    assert number_lists.finite_rows(rows, 3) is None


def test_whole_numbers_up_to_a_limit_are_read() -> None:
    values = [*range(300), 2**40, 7]
    found = number_lists.integers_up_to(values, 2**40)
    assert found is not None
    assert found.tolist() == values
    others: Any = [*values, 2**40 + 1], [1, -1], [1.0], [True], [2**70], ["1"], [None], []
    for wrong in others:
        assert number_lists.integers_up_to(wrong, 2**40) is None
    assert number_lists.integers_up_to((1, 300), 299) is None


@pytest.mark.parametrize("is_cheap", [True, False])
def test_machine_code_that_is_not_stored_is_compiled_after_many_numbers(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, is_cheap: bool
) -> None:
    front = SimpleNamespace(is_stored=False, is_cheap=is_cheap, address=number_lists.LISTS.address)
    monkeypatch.setattr(number_lists, "LISTS", front)
    monkeypatch.setattr(number_lists, "MOST_NUMBERS", 60)
    read = []
    for _ in range(9):
        found = number_lists.finite_rows([[1.0, 2.0, 3.0]] * 3, 3)
        read.append(found is not None)
    assert read == [False] * 6 + [is_cheap] * 3
    assert caplog.text.count("compiling the reader of lists") == is_cheap


def test_lists_are_not_kept() -> None:
    value, row = 12345.5, [1.5, 2.5, 3.5]
    rows, wrong = [row] * 4, [row, row, [1.0, 2.0, object()]]
    counts = []
    for _ in range(3):
        for _ in range(100):
            number_lists.finite_rows(rows, 3)
            number_lists.finite_rows(wrong, 3)
            number_lists.integers_up_to([1, 2, value], 5)  # type: ignore[list-item]
        gc.collect()
        counts.append([sys.getrefcount(one) for one in (value, row, rows, wrong)])
    assert counts[0] == counts[1] == counts[2]


@pytest.mark.parametrize(
    "pixels", [[300, -1, 2.7] * 4, (7, 8, 255) * 4, [1000, 2, 3] * 4, bytes(range(12))], ids=str
)
def test_textures_are_those_of_numpy(pixels: Any) -> None:
    p.connect(p.DIRECT)
    client: Any = CLIENTS[0]
    texture = client.scene.textures.add(np.zeros((1, 1, 4), np.uint8))
    p.changeTexture(texture, pixels, 2, 2)
    image = client.scene.textures.image(texture, client.scene.world)
    expected = np.asarray(list(pixels)).astype(np.int64).astype(np.uint8).reshape(2, 2, 3)
    np.testing.assert_array_equal(image[..., :3], expected)
    assert (image[..., 3] == 255).all()
