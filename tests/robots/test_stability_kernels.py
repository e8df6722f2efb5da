"""The compiled sums of balance against plain ones."""

from __future__ import annotations

import numpy as np
import pytest
import reference_stability as plain

from roboyard.robots.stability import kernels
from roboyard.robots.stability.zmp import BalanceMargins


def hull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    points = np.column_stack([points, np.zeros(len(points))])
    edges, middle = np.empty((len(points) + 1, 3)), np.empty(2)
    found = kernels.hull_edges(points, len(points), edges[:, :2], edges[:, 2], middle)
    return (edges[:found, :2], edges[:found, 2], middle) if found else None


def by_angle(found: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    normals, bounds, _ = found
    rows = np.column_stack([normals, bounds])
    return rows[np.argsort(np.arctan2(normals[:, 1], normals[:, 0]))]


@pytest.mark.parametrize("seed", range(40))
def test_hulls(seed: int) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(random.integers(1, 20), 2))
    if seed % 2:
        points = np.round(points)  # duplicate and collinear points
    expected, found = plain.hull_edges(points), hull(points)
    assert (expected is None) == (found is None)
    if expected is not None and found is not None:
        assert by_angle(found) == pytest.approx(by_angle(expected), abs=1e-12)
        assert found[2] == pytest.approx(expected[2], abs=1e-12)


def test_collinear_and_few_points_have_no_hull() -> None:
    assert hull(np.array([[0, 0], [1, 1], [2, 2], [3, 3]], float)) is None
    assert hull(np.zeros((1, 2))) is None
    assert hull(np.zeros((0, 2))) is None


@pytest.mark.parametrize("seed", range(60))
def test_a_step_towards_a_goal(seed: int) -> None:
    random = np.random.default_rng(seed)
    joints, edges = int(random.integers(1, 8)), int(random.integers(3, 7))
    balance = BalanceMargins(
        com_shift=random.normal(size=(edges, joints)),
        zmp_shift=random.normal(size=(edges, joints)) * random.integers(0, 2, joints),
        com_margin=random.normal(0.3, 0.5, edges),
        zmp_margin=random.uniform(0.01, 0.5, edges),
        edge=np.ones(edges),
        lost=np.zeros(edges),
        reserve=np.zeros(edges),
        swing=random.normal(0.0, 0.3, edges),
        outwards=np.zeros((edges, 2)),
        height=0.1,
        moment=np.zeros(2),
    )
    q, goal = random.normal(size=(2, joints))
    reference, speed = q + random.normal(0.0, 0.05, joints), random.normal(0.0, 0.5, joints)
    goal = np.where(random.random(joints) < 0.3, reference, goal)
    rise, fastest = random.uniform(0.5, 5.0, joints), random.uniform(0.2, 2.0, joints)
    expected = plain.follow(reference, speed, q, goal, rise, fastest, 1 / 30, balance)
    way, allowed = goal - reference, np.ones(joints, dtype=bool)
    kernels.limit_acceleration(
        *(rise, fastest, speed, way, q, reference, balance.com_shift, balance.zmp_shift, balance.com_margin),
        *(balance.zmp_margin, balance.swing, allowed),
    )
    kernels.advance(reference, speed, goal, way, allowed, rise, fastest, 1 / 30)
    assert reference == pytest.approx(expected[0], abs=1e-12)
    assert speed == pytest.approx(expected[1], abs=1e-12)


@pytest.mark.parametrize("way", [0.1, -0.1, 0.033, 0.7])
def test_a_reference_stops_at_its_goal_with_its_acceleration(way: float) -> None:
    """The way to a stop counts whole steps: v dt / 2 more than v² / 2a."""
    speeds = [0.0, *_speeds(way, 30.0, 6.0), 0.0]
    assert np.abs(np.diff(speeds)).max() < 30.0 / 30 * 1.2  # the last two steps share what is left


def _speeds(way: float, rise: float, fastest: float) -> list[float]:
    """Return the speeds of a reference on its way to a goal, as differences of its positions."""
    reference, speed, goal = np.zeros(1), np.zeros(1), np.array([way])
    positions = [0.0]
    while positions[-1] != way:
        allowed = np.ones(1, dtype=bool)
        limits = np.array([rise]), np.array([fastest])
        kernels.advance(reference, speed, goal, goal - reference, allowed, *limits, 1 / 30)
        positions.append(float(reference[0]))
    return (np.diff(positions) * 30).tolist()


def test_lowest_points() -> None:
    """A ball touches below its middle, a tilted box with its lower edge."""
    tilted = np.array([[np.cos(0.5), 0, np.sin(0.5)], [0, 1, 0], [-np.sin(0.5), 0, np.cos(0.5)]])
    out, touches = np.empty((24, 3)), np.array([1, 1, 0], dtype=np.int32)
    count = kernels.lowest_points(
        np.array([0, 1, 2]), np.array([True, False, False]), touches, np.zeros(3, dtype=np.int32),
        np.array([[0, 0, 0, 0.2, 0.2, 0.2], [0, 0, 0.1, 0.5, 0.3, 0.1], [0, 0, 0, 1, 1, 1]], float),
        np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]),
        np.stack([np.eye(3).ravel(), tilted.ravel(), np.eye(3).ravel()]), out,
    )  # fmt: skip
    assert out[0] == pytest.approx([1.0, 2.0, 2.8])
    low = np.array([[x, y, z] for y in (-0.3, 0.3) for x, z in [(0.5, 0.0)]]) @ tilted.T + [0, 0, 1]
    assert count == 3
    assert sorted(map(tuple, out[1:3].round(12))) == sorted(map(tuple, low.round(12)))
