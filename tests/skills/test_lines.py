"""Lines that a gripper follows, in even steps."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.skills.lines import SPACING, dense_line, distance_from_line

CORNER = np.array([[0.0, 0.0, 0.0], [0.12, 0.0, 0.0], [0.12, 0.3, 0.0]])


def test_points_are_close_and_keep_the_corners() -> None:
    line = dense_line(CORNER)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps.max() <= SPACING + 1e-12
    assert steps.sum() == pytest.approx(0.42)
    assert all((np.abs(line - corner).max(axis=1) < 1e-12).any() for corner in CORNER)


@pytest.mark.parametrize(
    ("point", "distance"),
    [((0.05, 0.0, 0.0), 0.0), ((0.06, -0.02, 0.0), 0.02), ((0.15, 0.1, 0.04), 0.05), ((0.12, 0.4, 0.0), 0.1)],
)
def test_distance_is_that_of_the_nearest_piece(point: tuple[float, float, float], distance: float) -> None:
    assert distance_from_line(np.array(point), CORNER) == pytest.approx(distance, abs=1e-12)
    assert distance_from_line(np.array(point), dense_line(CORNER)) == pytest.approx(distance, abs=1e-12)
