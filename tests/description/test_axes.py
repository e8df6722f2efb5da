"""Tests of roboyard.description.axes, with the 3-4-5 triangle's closed form."""

from __future__ import annotations

from roboyard.description.axes import unit_axis


def test_an_axis_is_scaled_and_its_length_kept() -> None:
    assert unit_axis((0.0, 3.0, -4.0)) == ((0.0, 0.6, -0.8), 5.0)


def test_unit_axes_stay_as_they_are() -> None:
    almost = (0.6, 0.8, 1e-17)
    assert unit_axis(almost) == (almost, 1.0)
    assert unit_axis([1, 0, 0]) == ((1.0, 0.0, 0.0), 1.0)


def test_zero_has_the_direction_of_x() -> None:
    assert unit_axis((0.0, 0.0, 0.0)) == ((1.0, 0.0, 0.0), 1.0)
