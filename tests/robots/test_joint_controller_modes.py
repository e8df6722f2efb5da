"""Joint controllers: each mode against its formula, integrated where the formula is an equation of motion."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import DT, limits, make, state
from scipy.spatial.transform import Rotation

from roboyard.errors import ConfigError

STEP = 1e-3
MASS = np.array([[2.0, 0.4], [0.4, 1.5]])
BIAS = np.array([3.0, -1.0])
RAW = {"command_input_limits": None}


def simulated(controller, q, v, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Integrate M q'' = tau - b under a controller."""
    q, v = np.array(q, float), np.array(v, float)
    for _ in range(round(seconds / STEP)):
        effort = controller.step(state(q, v, dt=STEP, mass_matrix=MASS, bias=BIAS)).value
        v = v + STEP * np.linalg.solve(MASS, effort - BIAS)
        q = q + STEP * v
    return q, v


@pytest.mark.parametrize("seconds", [0.05, 0.2, 0.6])
def test_an_impedance_returns_like_a_critically_damped_spring(seconds: float) -> None:
    """x(t) = x0 (1 + w t) exp(-w t) for both joints, coupled masses and gravity compensated."""
    controller = make("JointController", limits(2, effort=1e3), use_impedances=True, pos_kp=64.0)
    start = np.array([0.3, -0.2])
    controller.step(state(np.zeros(2), mass_matrix=MASS, bias=BIAS))
    q, _ = simulated(controller, start, [0, 0], seconds)
    assert q == pytest.approx(start * (1 + 8 * seconds) * np.exp(-8 * seconds), abs=3e-3)


def test_the_damping_ratio_of_an_impedance_sets_its_overshoot() -> None:
    keys = {"use_impedances": True, "pos_kp": 100.0, "pos_damping_ratio": 0.3}
    controller = make("JointController", limits(2, effort=1e4), **keys)
    controller.step(state(np.zeros(2), mass_matrix=MASS, bias=BIAS))
    half_period = np.pi / (10 * np.sqrt(1 - 0.3**2))
    q, _ = simulated(controller, [0.2, 0.1], [0, 0], half_period)
    overshoot = np.exp(-0.3 * np.pi / np.sqrt(1 - 0.3**2))
    assert q == pytest.approx(-overshoot * np.array([0.2, 0.1]), rel=0.03)


def test_a_velocity_impedance_approaches_its_speed_exponentially() -> None:
    keys = {"motor_type": "velocity", "use_impedances": True, "vel_kp": 6.0, **RAW}
    controller = make("JointController", limits(2, effort=1e3), **keys)
    controller.update_goal([1.0, -2.0], state(np.zeros(2)))
    _, v = simulated(controller, [0, 0], [0, 0], 0.25)
    assert v == pytest.approx(np.array([1.0, -2.0]) * (1 - np.exp(-6.0 * 0.25)), rel=5e-3)


def test_compensation_of_bias_forces_can_be_switched_off() -> None:
    keys = {"use_impedances": True, "use_cc_compensation": False}
    controller = make("JointController", limits(2), **keys)
    now = state([0.1, 0.1], mass_matrix=MASS, bias=BIAS)
    assert controller.step(now).value == pytest.approx([0.0, 0.0])


@pytest.mark.parametrize(("setting", "expected"), [(None, [1, 2]), (False, [1, 2]), (True, [4, 1])])
def test_raw_efforts_are_compensated_only_on_request(setting, expected) -> None:
    keys = {"motor_type": "effort", "use_gravity_compensation": setting, **RAW}
    controller = make("JointController", limits(2), **keys)
    now = state(np.zeros(2), bias=BIAS)
    controller.update_goal([1.0, 2.0], now)
    assert controller.step(now).value == pytest.approx(expected)


def test_targets_are_averaged_over_the_filter_size() -> None:
    controller = make("JointController", limits(1), motor_type="effort", smoothing_filter_size=4, **RAW)
    goals = [0.0, 8.0, -4.0, 2.0, 6.0, 6.0, 6.0]
    found = []
    for goal in goals:
        controller.update_goal([goal], state([0.0]))
        found.append(float(controller.step(state([0.0])).value[0]))
    expected = [np.mean(goals[max(0, k - 3) : k + 1]) for k in range(len(goals))]
    assert found == pytest.approx(expected)
    controller.reset()
    controller.update_goal([9.0], state([0.0]))
    assert controller.step(state([0.0])).value == pytest.approx([9.0])


def test_changes_of_velocities_are_relative_to_the_measured_ones_and_clipped() -> None:
    keys = {"motor_type": "velocity", "use_delta_commands": True, "command_output_limits": None, **RAW}
    controller = make("JointController", limits(2), **keys)
    controller.update_goal([0.5, 5.0], state([0, 0], [1.0, 1.0]))
    assert controller.goal == pytest.approx([1.5, 3.0])


def test_changes_of_efforts_add_up_to_the_last_goal() -> None:
    keys = {"motor_type": "effort", "use_delta_commands": True, "command_output_limits": None, **RAW}
    controller = make("JointController", limits(2), **keys)
    for _ in range(3):
        controller.update_goal([1.5, -5.0], state([0, 0], [9.0, 9.0]))
    assert controller.goal == pytest.approx([4.5, -10.0])


def test_only_the_joints_of_a_rotation_triple_are_composed() -> None:
    bounds = limits(5, lower=-4, upper=4)
    keys = {"use_delta_commands": True, "command_output_limits": None, **RAW}
    controller = make("JointController", bounds, compute_delta_in_quat_space=[[1, 2, 4]], **keys)
    q, change = np.array([0.5, 0.2, -0.3, 0.1, 0.9]), np.array([0.1, 0.3, 0.2, -0.4, 0.25])
    controller.update_goal(change, state(q))
    turned = Rotation.from_euler("xyz", change[[1, 2, 4]]) * Rotation.from_euler("xyz", q[[1, 2, 4]])
    assert controller.goal[[0, 3]] == pytest.approx((q + change)[[0, 3]])
    assert Rotation.from_euler("xyz", controller.goal[[1, 2, 4]]).as_matrix() == pytest.approx(
        turned.as_matrix()
    )


def test_a_rotation_triple_beyond_the_group_is_refused() -> None:
    keys = {"use_delta_commands": True, "command_output_limits": None}
    with pytest.raises(ConfigError, match=r"compute_delta_in_quat_space: \(0, 1, 3\) exceeds the 3 joints"):
        make("JointController", limits(3), compute_delta_in_quat_space=[[0, 1, 3]], **keys)


def test_goals_beyond_the_position_limits_are_clipped() -> None:
    controller = make("JointController", limits(2, lower=[-1, 0], upper=[0.5, 3]), **RAW)
    controller.update_goal([4.0, -4.0], state(np.zeros(2)))
    assert controller.goal == pytest.approx([0.5, 0.0])


@pytest.mark.parametrize("motor_type", ["position", "velocity", "effort"])
@pytest.mark.parametrize("delta", [False, True])
def test_the_no_op_command_leaves_the_goal_of_a_moving_joint_unchanged(motor_type: str, delta: bool) -> None:
    keys = {"command_output_limits": None, **RAW} if delta else {}
    controller = make("JointController", limits(2), motor_type=motor_type, use_delta_commands=delta, **keys)
    now = state([0.2, -0.4])
    if motor_type == "position":
        controller.update_goal([0.25, 0.125], now)
    else:
        controller.step(now)
    before = controller.goal.copy()
    controller.update_goal(controller.noop_command(now), now)
    assert controller.goal == pytest.approx(before)


def test_a_null_controller_holds_velocities_and_efforts_too() -> None:
    for motor_type, kind in (("velocity", "velocity"), ("effort", "effort")):
        controller = make("NullJointController", limits(2), motor_type=motor_type, default_goal=(0.5, -20.0))
        control = controller.step(state([0, 0], [0.5, -3.0]))
        assert control.kind == kind
        assert control.value == pytest.approx([0.5, -3.0 if kind == "velocity" else -10.0])
        assert controller.noop_command(state([0, 0])).shape == (0,)


def test_the_default_goal_of_a_null_controller_is_a_copy() -> None:
    controller = make("NullJointController", limits(2))
    controller.default_goal[:] = 1.0
    assert controller.default_goal == pytest.approx([0.0, 0.0])
    with pytest.raises(ConfigError, match=r"default_goal: has shape \(3,\); the group has 2 joints"):
        make("NullJointController", limits(2), default_goal=(0.0, 0.0, 0.0))


def test_velocity_limits_hold_for_the_corrected_target() -> None:
    controller = make("JointController", limits(1, velocity=1.0), motor_type="velocity", **RAW)
    controller.update_goal([0.9], state([0.0]))
    values = [float(controller.step(state([0.0], [0.0], dt=DT)).value[0]) for _ in range(10)]
    assert max(values) == 1.0
    assert values[0] == pytest.approx(min(1.0, 0.9 + 5 * DT * 0.9))
