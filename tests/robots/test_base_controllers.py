"""Controllers of bases: integrated motion against circles, limits of wheels, twists limited by stability."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import DT, limits, make, square_margins, state
from scipy.spatial.transform import Rotation

from roboyard.errors import ConfigError
from roboyard.robots.control import GroupState
from roboyard.robots.control.differential_drive import wheel_odometry
from roboyard.robots.control.twist_ramp import next_twist

RADIUS, AXLE = 0.08, 0.5
WHEELS = {"wheel_radius": RADIUS, "wheel_axle_length": AXLE}
RAW = {"command_input_limits": None}


def at(q: np.ndarray, v: np.ndarray) -> GroupState:
    mount = np.eye(4)
    mount[:3, :3] = Rotation.from_euler("z", q[2]).as_matrix()
    mount[:2, 3] = q[:2]
    return GroupState(q=q, v=v, dt=DT, mount=mount)


@pytest.mark.parametrize("steps", [24, 60])
def test_a_held_twist_drives_a_holonomic_base_along_a_closed_polygon(steps: int) -> None:
    """Each step turns by 2 pi / n and moves along the chord, so that n steps return to the start."""
    turn, speed = 2 * np.pi / (steps * DT), 0.6
    bounds = limits(3, velocity=[5, 5, 20])
    controller = make("HolonomicBaseJointController", bounds, max_acceleration=None, **RAW)
    q, v, places = np.array([1.0, -2.0, 0.4]), np.zeros(3), []
    controller.update_goal([speed, 0.0, turn], at(q, v))
    for _ in range(steps):
        v = controller.step(at(q, v)).led
        q = q + DT * v
        places.append(q[:2])
    assert q == pytest.approx([1.0, -2.0, 0.4 + 2 * np.pi], abs=1e-9)
    radius = speed * DT / (2 * np.sin(np.pi / steps))
    middle = np.array([1.0, -2.0]) + radius * np.array([-np.sin(0.4), np.cos(0.4)])
    assert np.linalg.norm(np.array(places) - middle, axis=1) == pytest.approx(np.full(steps, radius))


def test_a_holonomic_base_accelerates_within_each_of_its_limits() -> None:
    bounds = limits(3, velocity=[2, 2, 6])
    controller = make("HolonomicBaseJointController", bounds, max_acceleration=[1.0, 0.5, 3.0], **RAW)
    controller.update_goal([1.0, 1.0, 0.0], state(np.zeros(3)))
    led = np.array([controller.step(at(np.zeros(3), np.zeros(3))).led for _ in range(70)])
    assert led[0] == pytest.approx([1.0 * DT, 0.5 * DT, 0.0])
    assert int(np.argmax(led[:, 0] >= 1.0 - 1e-9)) + 1 == 30
    assert int(np.argmax(led[:, 1] >= 1.0 - 1e-9)) + 1 == 60
    assert led[-1] == pytest.approx([1.0, 1.0, 0.0])


def test_holonomic_velocities_are_scaled_and_limited_by_the_virtual_joints() -> None:
    controller = make(
        "HolonomicBaseJointController", limits(3, velocity=[1.5, 1.0, 3.0]), max_acceleration=None
    )
    controller.update_goal([1.0, -0.5, 2.0], at(np.zeros(3), np.zeros(3)))
    assert controller.goal == pytest.approx([1.5, -0.5, 3.0])
    assert controller.noop_command(at(np.zeros(3), np.zeros(3))) == pytest.approx([0, 0, 0])


@pytest.mark.parametrize(
    ("turn", "expected"), [(3.5, 3.5 - 2 * np.pi), (-3.5, 2 * np.pi - 3.5), (0.25, 0.25)]
)
def test_holonomic_turns_take_the_shorter_way(turn: float, expected: float) -> None:
    bounds = limits(3, lower=-99, upper=99)
    controller = make("HolonomicBaseJointController", bounds, motor_type="position", **RAW)
    controller.update_goal([0, 0, turn], at(np.array([0, 0, 7.0]), np.zeros(3)))
    assert controller.goal[2] == pytest.approx(7.0 + expected)


def test_holonomic_efforts_are_turned_into_the_frame_of_the_virtual_joints() -> None:
    controller = make("HolonomicBaseJointController", limits(3, effort=99), motor_type="effort", **RAW)
    now = at(np.array([0, 0, np.pi / 2]), np.zeros(3))
    controller.update_goal([10.0, 0.0, 2.0], now)
    assert controller.step(now).value == pytest.approx([0.0, 10.0, 2.0], abs=1e-9)


@pytest.mark.parametrize(
    ("bounds", "keys", "message"),
    [
        (limits(2), {}, r"a holonomic base has 3 joints \(x, y, rz\); got 2"),
        (limits(3), {"use_delta_commands": True, "command_output_limits": None}, "must be false"),
        (
            limits(3),
            {"max_acceleration": [1.0, 0.0, 1.0]},
            r"three positive numbers, or null, got \(1\.0, 0\.0",
        ),
    ],
)
def test_wrong_settings_of_a_holonomic_base_are_refused(bounds, keys: dict, message: str) -> None:
    with pytest.raises((ConfigError, ValueError), match=message):
        make("HolonomicBaseJointController", bounds, **keys)


@pytest.mark.parametrize(
    ("bounds", "keys", "message"),
    [
        (limits(3), WHEELS, r"2 joints \(left wheel, right wheel\); got 3"),
        (limits(2), {"wheel_radius": 0.1}, r"must be positive \(m\), got 0\.1 and 0\.0"),
        (limits(2, velocity=[3, 4]), WHEELS, "same velocity limit; they have 3.0 and 4.0"),
    ],
)
def test_wheels_that_do_not_fit_a_differential_drive_are_refused(bounds, keys: dict, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        make("DifferentialDriveController", bounds, **keys)


@pytest.mark.parametrize("twist", [(0.5, 1.2), (-0.3, 0.9), (0.4, -0.5)])
def test_wheel_speeds_roll_along_the_arc_of_the_twist(twist: tuple[float, float]) -> None:
    """Integrated wheel by wheel: each travels its own arc around the common centre of rotation."""
    bounds = limits(2, velocity=50)
    controller = make("DifferentialDriveController", bounds, max_acceleration=None, **WHEELS, **RAW)
    controller.update_goal(twist, state([0, 0]))
    left, right = controller.step(state([0, 0])).led * RADIUS
    v, w = twist
    assert (right - left) / AXLE == pytest.approx(w)
    centre = AXLE / 2 * (left + right) / (right - left)
    assert centre == pytest.approx(v / w)
    assert left == pytest.approx(w * (v / w - AXLE / 2))
    assert wheel_odometry(np.array([left, right]) / RADIUS, RADIUS, AXLE) == pytest.approx(twist)


def test_unit_commands_of_a_differential_drive_reach_the_limit_of_the_wheels() -> None:
    controller = make("DifferentialDriveController", limits(2, velocity=10), **WHEELS)
    for command, wheels in (((1, 0), (10, 10)), ((0, 1), (-10, 10)), ((-1, 0), (-10, -10))):
        controller.update_goal(command, state([0, 0]))
        assert controller.wheel_speeds(controller.goal) == pytest.approx(wheels)


def test_the_slower_limit_of_acceleration_sets_both_speeds_of_a_differential_drive() -> None:
    keys = {"max_acceleration": (1.0, 1.0), **WHEELS, **RAW}
    controller = make("DifferentialDriveController", limits(2, velocity=50), **keys)
    controller.update_goal([0.5, 2.0], state([0, 0]))
    speeds = np.array([controller.odometry(controller.step(state([0, 0])).led) for _ in range(70)])
    growing = speeds[: round(2.0 / DT) - 1]
    assert np.diff(growing[:, 1]) == pytest.approx(np.full(len(growing) - 1, DT))
    assert growing[:, 0] / growing[:, 1] == pytest.approx(np.full(len(growing), 0.25))
    assert speeds[-1] == pytest.approx([0.5, 2.0])


G, HEIGHT, HALF = 9.81, 0.8, 0.2
REACH = 5.0 * DT
MARGINS = square_margins(HALF, HEIGHT, G)


def ramp(now, target, margins=MARGINS) -> np.ndarray:
    given = state([0, 0, 0], balance=None if margins is None else lambda: margins)
    return next_twist(
        np.array(now, float), np.array(target, float), given, lambda change: np.clip(change, -REACH, REACH)
    )


def test_a_straight_start_is_limited_to_the_acceleration_that_tips_the_robot() -> None:
    """A cart of height h on wheels at distance b tips at a = g b / h."""
    assert ramp((0, 0, 0), (9, 0, 0)) == pytest.approx([G * HALF / HEIGHT * DT, 0, 0])
    assert ramp((0, 0, 0), (0.05, 0, 0)) == pytest.approx([0.05, 0, 0])
    assert ramp((0, 0, 0), (9, 0, 0), None) == pytest.approx([REACH, 0, 0])


def test_a_curve_that_would_tip_the_robot_is_driven_slower_on_the_same_radius() -> None:
    """The lateral acceleration v w of a steady curve uses at most 0.7 of g b / h."""
    fast = np.array([2.0, 0.0, 2.5])
    part = MARGINS.steady(fast)
    slow = part * fast
    assert slow[0] * slow[2] == pytest.approx(0.7 * G * HALF / HEIGHT)
    twist = np.zeros(3)
    for _ in range(300):
        twist = ramp(twist, fast)
    assert twist == pytest.approx(slow, rel=1e-3)


def test_a_steady_straight_twist_needs_no_margins() -> None:
    def refuse():
        raise AssertionError("margins were computed")

    now = np.array([0.5, 0.0, 0.0])
    assert next_twist(now, now, state([0, 0, 0], balance=refuse), lambda change: change) == pytest.approx(now)


def test_a_base_beyond_its_margins_still_comes_to_rest() -> None:
    spent = square_margins(HALF, HEIGHT, G, reserve=np.full(4, 2 * HALF))
    twist = np.array([1.0, 0.0, 0.5])
    for k in range(200):
        twist = ramp(twist, (0, 0, 0), spent)
        if k == 0:
            assert twist[0] == pytest.approx(1.0 - 0.1 * REACH)
    assert np.abs(twist).max() < 0.05
