"""Distinct rows in ascending order, against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.shapes.distinct_rows import MOST_ALIKE, sorted_rows


@pytest.mark.parametrize(("count", "most", "others"), [(0, 3, 2), (1, 1, 1), (500, 60, 3), (900, 900, 900)])
def test_rows_are_numbered_as_by_numpy(count: int, most: int, others: int) -> None:
    rng = np.random.default_rng(5)
    rows = np.column_stack([rng.integers(0, n, count) for n in (most, others, others)]).astype(np.int64)
    first, place = sorted_rows(np.ascontiguousarray(rows), most)
    distinct, expected, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    np.testing.assert_array_equal(first, expected)
    np.testing.assert_array_equal(place, inverse.ravel())
    np.testing.assert_array_equal(rows[first], distinct)


def test_many_rows_with_the_same_first_number() -> None:
    """The hub of a fan of triangles, each with a normal of its own."""
    count = 3 * MOST_ALIKE
    rows = np.column_stack([np.arange(count) % 2, np.arange(count)[::-1] // 2, np.zeros(count)])
    rows = np.ascontiguousarray(rows, dtype=np.int64)
    first, place = sorted_rows(rows, 2)
    distinct, expected, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    np.testing.assert_array_equal(first, expected)
    np.testing.assert_array_equal(place, inverse.ravel())
    np.testing.assert_array_equal(rows[first], distinct)
