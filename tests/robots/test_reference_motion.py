"""References of joints against closed forms: trapezoidal profiles, stability margins, velocity tracking."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import limits, square_margins, state

from roboyard.robots.control.controller import acceleration
from roboyard.robots.control.rate_limiter import RateLimiter
from roboyard.robots.control.velocity_tracking import VelocityTracking

STEP = 1e-3


def motion(limiter: RateLimiter, goal: float, seconds: float, **more) -> np.ndarray:
    """Return the references of one joint that follows them exactly."""
    q, found = 0.0, []
    for _ in range(round(seconds / STEP)):
        q = float(limiter.follow(np.array([goal]), state([q], dt=STEP, **more))[0])
        found.append(q)
    return np.array(found)


@pytest.mark.parametrize(
    ("velocity", "effort", "inertia", "expected"),
    [
        (3.0, 10.0, None, 15.0),
        (3.0, 10.0, 1.0, 4.0),
        (3.0, 10.0, 0.01, 15.0),
        (0.5, 100.0, 40.0, 1.0),
    ],
)
def test_accelerations_are_limited_by_speed_and_by_effort(velocity, effort, inertia, expected) -> None:
    bounds = limits(1, velocity=velocity, effort=effort)
    assert acceleration(bounds, None if inertia is None else np.array([inertia])) == pytest.approx([expected])


@pytest.mark.parametrize(
    ("gravity", "expected"), [(0.0, 4.0), (-5.0, 4.0), (9.0, 0.8), (-9.0, 0.8), (12.0, 0.2)]
)
def test_a_load_leaves_less_effort_to_brake_it(gravity: float, expected: float) -> None:
    """Of 10 N m, 0.4 without a load, 0.8 of the rest with one, and 0.02 where it exceeds them; at 1 kg m²."""
    found = acceleration(limits(1, velocity=3.0, effort=10.0), np.ones(1), np.array([gravity]))
    assert found == pytest.approx([expected])


@pytest.mark.parametrize(("distance", "velocity"), [(1.8, 1.0), (0.1, 1.0), (-1.2, 0.4)])
def test_a_motion_takes_as_long_as_the_trapezoidal_profile(distance: float, velocity: float) -> None:
    a, d = velocity / 0.2, abs(distance)
    cruises = d > velocity**2 / a
    duration = d / velocity + velocity / a if cruises else 2 * np.sqrt(d / a)
    way = motion(RateLimiter(limits(1, velocity=velocity)), distance, duration + 0.1)
    arrived = np.flatnonzero(way == distance)[0] * STEP
    assert arrived == pytest.approx(duration, abs=0.02)
    speed = np.abs(np.diff(way, prepend=0.0)).max() / STEP
    assert speed == pytest.approx(velocity if cruises else np.sqrt(d * a), rel=0.02)
    assert np.abs(way).max() == d


def test_a_goal_behind_a_moving_reference_is_reached_after_braking() -> None:
    limiter = RateLimiter(limits(1, velocity=1.0))
    forwards = motion(limiter, 1.5, 0.5)
    assert limiter.reference is not None
    turned = [float(limiter.follow(np.zeros(1), state([0.4], dt=STEP))[0]) for _ in range(1500)]
    braking_way = 1.0**2 / (2 * 5.0)
    assert max(turned) - forwards[-1] == pytest.approx(braking_way, rel=0.02)
    assert turned[-1] == 0.0


def test_after_a_reset_a_reference_starts_at_the_measured_position_at_rest() -> None:
    limiter = RateLimiter(limits(2))
    limiter.follow(np.array([1.0, 1.0]), state([0.0, 0.0]))
    limiter.reset()
    assert limiter.reference is None
    first = limiter.follow(np.array([0.5, 0.5]), state([0.5, -0.5], dt=STEP))
    assert first == pytest.approx([0.5, -0.5 + 15.0 * STEP**2])


def test_the_shift_of_the_zero_moment_point_limits_the_acceleration() -> None:
    """A joint that shifts the zero-moment point by s a is accelerated by no more than margin / s."""
    margins = square_margins(0.05, 1.0, 9.81, zmp_shift=np.array([[0.02], [0.0], [-0.02], [0.0]]))
    way = motion(RateLimiter(limits(1, velocity=1.0)), 1.5, 1.0, balance=lambda: margins)
    speeds = np.diff(way, prepend=0.0) / STEP
    assert np.abs(np.diff(speeds)).max() / STEP == pytest.approx(0.05 / 0.02, rel=1e-3)


def test_a_joint_stops_where_the_centre_of_mass_reaches_its_limit() -> None:
    shift, margin = 0.1, 0.06
    present = {"q": 0.0}

    def balance():
        out = margin - shift * np.array([present["q"], 0.0, -present["q"], 0.0])
        return square_margins(
            0.2, 1.0, 9.81, com_shift=shift * np.array([[1.0], [0], [-1], [0]]), com_margin=out
        )

    limiter = RateLimiter(limits(1, velocity=1.0))
    for _ in range(2000):
        now = state([present["q"]], dt=STEP, balance=balance)
        present["q"] = float(limiter.follow(np.array([1.5]), now)[0])
    assert present["q"] == pytest.approx(margin / shift, abs=5e-3)
    for _ in range(2000):
        now = state([present["q"]], dt=STEP, balance=balance)
        present["q"] = float(limiter.follow(np.array([-0.2]), now)[0])
    assert present["q"] == -0.2


def driven(load: float, target: float, *, kd: float = 20.0, mass: float = 1.0, seconds: float = 6.0) -> float:
    """Return the final speed of m v' = kd (u - v) - load under a tracking controller (rad/s)."""
    tracking, v = VelocityTracking(np.array([3.0])), 0.0
    for _ in range(round(seconds / STEP)):
        u = float(tracking.control(np.array([target]), state([0.0], [v], dt=STEP)).value[0])
        v += STEP * (kd * (u - v) - load) / mass
    return v


@pytest.mark.parametrize("load", [-8.0, 0.0, 5.0, 11.0])
def test_a_loaded_drive_reaches_its_speed_without_steady_error(load: float) -> None:
    assert driven(load, 1.0) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("load", [20.0, -40.0])
def test_the_correction_of_a_speed_is_at_most_a_fifth_of_the_limit(load: float) -> None:
    rest_error = abs(load) / 20.0 - 0.2 * 3.0
    assert abs(driven(load, 1.0) - 1.0) == pytest.approx(rest_error, rel=1e-3)


def test_positions_are_held_only_at_rest_and_until_the_next_command() -> None:
    tracking = VelocityTracking(np.array([3.0, 3.0]))
    zero = np.zeros(2)
    assert tracking.control(zero, state([0.1, 0.2], [0.0, 0.02])).kind == "velocity"
    held = tracking.control(zero, state([0.1, 0.2], [0.0, 0.009]))
    assert held.kind == "position"
    assert tracking.control(zero, state([0.3, 0.3], [1.0, 1.0])).value == pytest.approx(held.value)
    assert tracking.control(np.array([0.5, 0.0]), state([0.3, 0.3])).kind == "velocity"
    assert tracking.control(zero, state([0.3, 0.3])).value == pytest.approx([0.3, 0.3])


def test_without_holding_a_drive_at_zero_speed_stays_a_velocity_drive() -> None:
    tracking = VelocityTracking(np.array([3.0]), hold_position=False)
    control = tracking.control(np.zeros(1), state([0.4], [0.0]))
    assert control.kind == "velocity" and control.value == pytest.approx([0.0])
    assert control.led == pytest.approx([0.0])
