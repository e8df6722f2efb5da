"""Timing against closed forms, and against dense samples of its own limits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import Box, Pose
from roboyard.description.robot_model import CollisionSphere
from roboyard.planning import Obstacle, Obstacles, SphereModel, Trajectory, sphere_robot
from roboyard.planning.path_search import SearchSpace, time_path

JOINTS = [f"joint{i}" for i in range(1, 8)]
LIMITS = np.array([[2.0] * 4 + [2.6] * 3, [15.0] * 7, [500.0] * 7])


@pytest.fixture(scope="module")
def space(arm: SphereModel) -> SearchSpace:
    from dataclasses import replace

    names = [link.name for link in arm.description.links]
    touching = frozenset((min(a, b), max(a, b)) for a in names for b in names)
    robot = sphere_robot(replace(arm, ignore=touching), JOINTS)
    return SearchSpace.of(robot.arrays, Obstacles().arrays)


def rest_to_rest(distance: float, v: float, a: float, j: float) -> float:
    """Shortest time between rests (Biagiotti and Melchiorri, Trajectory Planning, 3.4)."""
    if v * j >= a * a:
        rise = v / a + a / j
    else:
        rise = 2 * np.sqrt(v / j)
    if distance >= v * rise:
        return distance / v + rise
    if distance >= 2 * a**3 / j**2:
        return a / j + np.sqrt((a / j) ** 2 + 4 * distance / a)
    return 4 * np.cbrt(distance / (2 * j))


def violation(trajectory: Trajectory, limits: np.ndarray, count: int = 20_000) -> float:
    """The largest excess over a limit, relative to it."""
    _, v, a, j = trajectory.at(np.linspace(0, trajectory.duration, count))
    return (
        max(float((np.abs(x).max(axis=0) / row).max()) for x, row in zip((v, a, j), limits, strict=True)) - 1
    )


@pytest.mark.parametrize("distance", [1e-4, 0.01, 0.05, 0.3, 1.0, 5.0])
@pytest.mark.parametrize("v", [0.2, 2.0])
def test_one_segment_takes_the_shortest_time(space: SearchSpace, distance: float, v: float) -> None:
    limits = np.array([[v] * 7, [15.0] * 7, [500.0] * 7])
    path = np.zeros((2, 7))
    path[1] = [distance, -0.5 * distance, 0, 0.2 * distance, 0, 0, 0]
    trajectory = time_path(space, path, limits, tuple(JOINTS))
    assert trajectory.duration == pytest.approx(rest_to_rest(distance, v, 15.0, 500.0), rel=1e-9)
    np.testing.assert_allclose(trajectory.q[-1], path[1], atol=1e-9)
    assert violation(trajectory, limits) < 1e-6


def test_corners_keep_the_limits_and_save_time(space: SearchSpace) -> None:
    random = np.random.default_rng(0)
    saved = []
    for _ in range(40):
        path = random.uniform(-1.5, 1.5, (int(random.integers(3, 9)), 7))
        made = time_path(space, path, LIMITS, tuple(JOINTS))
        stops = time_path(space, path, LIMITS, tuple(JOINTS), corners=0.0)
        assert violation(made, LIMITS) < 1e-6
        for end, knot in ((path[0], 0), (path[-1], -1)):
            np.testing.assert_allclose(made.q[knot], end, atol=1e-9)
            np.testing.assert_allclose(made.v[knot], 0, atol=1e-8)
            np.testing.assert_allclose(made.a[knot], 0, atol=1e-6)
        saved.append(made.duration / stops.duration)
    assert max(saved) <= 1 + 1e-9
    assert np.median(saved) < 0.95


def test_position_is_the_integral_of_velocity(space: SearchSpace) -> None:
    path = np.random.default_rng(1).uniform(-1, 1, (6, 7))
    made = time_path(space, path, LIMITS, tuple(JOINTS))
    t = np.linspace(0, made.duration, 40_001)
    q, v, a, _ = made.at(t)
    for value, rate in ((q, v), (v, a)):
        steps = (rate[1:] + rate[:-1]) / 2 * np.diff(t)[:, None]
        np.testing.assert_allclose(value[0] + np.cumsum(steps, axis=0), value[1:], atol=1e-5)


def test_stopping_follows_the_way_points_exactly(space: SearchSpace) -> None:
    path = np.random.default_rng(2).uniform(-1, 1, (5, 7))
    dense = time_path(space, path, LIMITS, tuple(JOINTS), corners=0.0).dense()
    assert np.linalg.norm(np.diff(dense, axis=0), axis=1).max() <= 0.01 + 1e-9
    for q in dense:
        gaps = []
        for a, b in pairwise(path):
            share = np.clip((q - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            gaps.append(np.linalg.norm(a + share * (b - a) - q))
        assert min(gaps) < 1e-8


def test_no_motion_takes_no_time(space: SearchSpace) -> None:
    made = time_path(space, np.ones((2, 7)), LIMITS, tuple(JOINTS))
    assert made.duration == 0.0
    np.testing.assert_array_equal(made.at(1.0)[0], np.ones(7))


GANTRY = (
    '<robot name="gantry"><link name="base"/><link name="beam"/><link name="ball"/>'
    + "".join(
        f'<joint name="{name}" type="prismatic"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="{axis}"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>'
        for name, parent, child, axis in (("x", "base", "beam", "1 0 0"), ("y", "beam", "ball", "0 1 0"))
    )
    + "</robot>"
)


@pytest.mark.parametrize("steps", [[(1.0, 0.0), (0.0, 0.05)], [(0.0, 0.05), (1.0, 0.0), (0.0, -0.05)]])
def test_a_short_segment_does_not_shift_the_long_one_before_it_into_an_obstacle(
    steps: list[tuple[float, float]],
) -> None:
    """A ball passes a block along a line with 5 mm of clearance; the short segment would end long before."""
    path = np.cumsum([(0.0, 0.0), *steps], axis=0)
    way = float(path[-2, 1])
    block = Box(size=(0.2, 0.02, 0.2))
    for side in (0.035, -0.035):
        model = SphereModel(
            description=load_description(GANTRY),
            spheres={"ball": (CollisionSphere(center=(0.0, 0.0, 0.0), radius=0.02),)},
            ignore=frozenset(),
        )
        obstacle = Obstacle(name="block", shape=block, pose=Pose(position=(0.5, way + side, 0.0)))
        space = SearchSpace.of(sphere_robot(model, ["x", "y"]).arrays, Obstacles([obstacle]).arrays)
        made = time_path(space, path, np.array([[1.0, 1.0], [10.0, 10.0], [500.0, 500.0]]), ("x", "y"))
        q = made.at(np.linspace(0.0, made.duration, 5000))[0]
        away = np.maximum(np.abs(q - [0.5, way + side]) - [0.1, 0.01], 0.0)
        assert np.linalg.norm(away, axis=1).min() > 0.02
        np.testing.assert_allclose(made.q[-1], path[-1], atol=1e-9)


def test_dense_positions_are_close_and_hold_the_knots(space: SearchSpace) -> None:
    path = np.cumsum(np.random.default_rng(3).uniform(-0.5, 0.5, (6, 7)), axis=0)
    trajectory = time_path(space, path, LIMITS, tuple(JOINTS))
    step = 0.01
    dense = trajectory.dense(step)
    assert np.linalg.norm(np.diff(dense, axis=0), axis=1).max() <= step
    wanted = [trajectory.q[:1]]  # the same by `at`, interval by interval
    for t, end in pairwise(trajectory.t):
        speeds = [np.abs(trajectory.at(time)[1]) for time in (t, (t + end) / 2, end)]
        fastest = max(np.linalg.norm(np.maximum(speeds[0], speeds[2])), np.linalg.norm(speeds[1]))
        count = max(1, int(np.ceil(1.1 * fastest * (end - t) / step)))
        wanted.append(trajectory.at(np.linspace(t, end, count + 1)[1:])[0])
    np.testing.assert_allclose(dense, np.concatenate(wanted), atol=1e-9)
