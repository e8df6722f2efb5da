"""Grippers: targets by mode and motor, inverted commands, postures that do not fit, detection of grasps."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import limits, make, state

from roboyard.errors import ConfigError
from roboyard.robots.control import GroupLimits, MultiFingerGripperController
from roboyard.robots.control.gripper import GripperSettings

NAME = "MultiFingerGripperController"
REST = state([0.02, 0.01])


def fingers(**changed) -> GroupLimits:
    return limits(
        2, **{"lower": [0.0, -0.01], "upper": [0.05, 0.03], "velocity": 0.2, "effort": 12, **changed}
    )


def target(command, bounds: GroupLimits | None = None, **keys) -> np.ndarray:
    controller = make(NAME, bounds or fingers(), **keys)
    controller.update_goal(command, REST)
    return controller.step(REST).value


@pytest.mark.parametrize(
    ("keys", "command", "expected"),
    [
        ({}, 0.4, [0.05, 0.03]),
        ({}, -0.4, [0.0, -0.01]),
        ({"open_qpos": (0.04, 0.02), "closed_qpos": (0.01, 0.0)}, 1.0, [0.04, 0.02]),
        ({"open_qpos": (0.04, 0.02), "closed_qpos": (0.01, 0.0)}, -1.0, [0.01, 0.0]),
        ({}, 0.0, [0.05, 0.03]),
        ({"inverted": True}, 0.0, [0.0, -0.01]),
        ({"inverted": True}, -0.1, [0.05, 0.03]),
        ({"inverted": True}, 0.1, [0.0, -0.01]),
        ({"motor_type": "effort"}, 1.0, [12, 12]),
        ({"motor_type": "velocity"}, -1.0, [-0.2, -0.2]),
        ({"mode": "smooth", "motor_type": "effort"}, 0.25, [3, 3]),
        ({"mode": "smooth"}, -1.0, [-0.005, -0.005]),
        ({"mode": "independent"}, [1.0, 0.0], [0.05, 0.01]),
        ({"mode": "independent", "motor_type": "velocity"}, [0.5, -0.5], [0.1, -0.1]),
        ({"mode": "independent", "inverted": True}, [1.0, 0.0], [0.0, 0.01]),
        ({"mode": "smooth", "command_input_limits": None}, 0.01, [0.01, 0.01]),
        ({"mode": "smooth", "command_input_limits": (0, 1)}, 0.5, [0.0175, 0.0175]),
        ({"mode": "smooth", "command_input_limits": (0, 1), "inverted": True}, 0.25, [0.02875, 0.02875]),
    ],
)
def test_targets_by_mode_and_motor(keys: dict, command, expected) -> None:
    bounds = fingers()
    clipped = np.array(expected, float)
    if keys.get("motor_type", "position") == "position":
        clipped = np.clip(clipped, bounds.lower, bounds.upper)
    assert target(command, bounds, **keys) == pytest.approx(clipped)


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("mode", ["binary", "smooth", "independent"])
def test_the_no_op_command_of_a_gripper_repeats_its_target(mode: str, inverted: bool) -> None:
    controller = make(NAME, fingers(lower=0.0, upper=0.05), mode=mode, inverted=inverted)
    for value in (0.75, -0.75):
        controller.update_goal(np.full(controller.command_dim, value), REST)
        before = controller.step(REST).value.copy()
        controller.update_goal(controller.noop_command(REST), REST)
        assert controller.step(REST).value == pytest.approx(before)


def test_before_the_first_command_fingers_stay_where_they_are() -> None:
    controller = make(NAME, fingers(), mode="independent")
    assert controller.step(REST).value == pytest.approx(REST.q)
    fast = make(NAME, fingers(), mode="independent", motor_type="velocity")
    assert fast.step(REST).value == pytest.approx([0, 0])


@pytest.mark.parametrize("motor_type", ["velocity", "effort"])
def test_fingers_within_the_tolerance_of_a_limit_are_driven_only_away_from_it(motor_type: str) -> None:
    bounds, top = fingers(lower=0.0, upper=0.05), 0.2 if motor_type == "velocity" else 12.0
    controller = make(NAME, bounds, motor_type=motor_type, limit_tolerance=0.005)
    controller.update_goal([1.0], REST)
    assert controller.step(state([0.044, 0.046])).value == pytest.approx([top, 0.0])
    controller.update_goal([-1.0], REST)
    assert controller.step(state([0.046, 0.004])).value == pytest.approx([-top, 0.0])


@pytest.mark.parametrize(
    ("bounds", "keys", "message"),
    [
        (fingers(upper=np.inf), {}, r"open_qpos: the fingers have no limits \[inf, inf\]; give 2 values"),
        (fingers(lower=-np.inf), {"open_qpos": (0, 0)}, "closed_qpos: the fingers have no limits"),
        (fingers(), {"open_qpos": (0.0,)}, "open_qpos: must have 2 values, one for each finger, got 1"),
        (
            fingers(),
            {"closed_qpos": (0, 0), "motor_type": "velocity"},
            "closed_qpos: has no effect with motor_type 'velocity'; remove it",
        ),
        (fingers(), {"motor_type": "velocity", "isaac_kp": 5.0}, r"isaac_kp=5\.0 has no effect"),
    ],
)
def test_postures_that_do_not_fit_the_fingers_are_refused(bounds, keys: dict, message: str) -> None:
    with pytest.raises((ConfigError, ValueError), match=message):
        make(NAME, bounds, **keys)


def test_continuous_fingers_with_given_postures_open_and_close() -> None:
    bounds = fingers(lower=-np.inf, upper=np.inf)
    keys = {"open_qpos": (1.0, 1.0), "closed_qpos": (0.0, 0.0)}
    assert target(1.0, bounds, **keys) == pytest.approx([1.0, 1.0])
    assert target(-1.0, bounds, **keys) == pytest.approx([0.0, 0.0])


def grasp(q, v, command: float = -1.0, steps: int = 5, **keys) -> bool | None:
    controller = make(NAME, fingers(lower=0.0, upper=0.05), **keys)
    assert isinstance(controller, MultiFingerGripperController)
    controller.update_goal(np.full(controller.command_dim, command), REST)
    for _ in range(steps):
        controller.step(state(q, v))
    return controller.is_grasping()


@pytest.mark.parametrize(
    ("q", "v", "keys", "expected"),
    [
        ([0.02, 0.02], [0, 0], {}, True),
        ([0.02, 0.02], [-0.05, 0], {}, False),
        ([0.001, 0.001], [0, 0], {}, None),
        ([0.02, 0.02], [0, 0], {"mode": "independent"}, None),
        ([0.02, 0.02], [0, 0], {"limit_tolerance": 0.01}, None),
        ([0.02, 0.02], [0, 0], {"motor_type": "velocity"}, True),
        ([0.0495, 0.0495], [0, 0], {}, False),
        ([0.02, 0.02], [0, 0], {"motor_type": "effort"}, True),
        ([0.02, 0.02], [0, 0], {"open_qpos": (0.05, 0.05), "closed_qpos": (0.0, 0.02)}, None),
    ],
)
def test_grasps_are_detected_from_position_speed_and_target(q, v, keys: dict, expected) -> None:
    assert grasp(q, v, **keys) is expected


def test_a_grasp_needs_rest_on_the_average_of_five_steps() -> None:
    controller = make(NAME, fingers(lower=0.0, upper=0.05))
    assert isinstance(controller, MultiFingerGripperController)
    controller.update_goal([-1.0], REST)
    found = []
    for speed in (-0.09, 0, 0, 0, 0, 0):
        controller.step(state([0.02, 0.02], [speed, 0]))
        found.append(controller.is_grasping())
    assert found == [False, False, False, False, True, True]
    controller.reset()
    assert controller.is_grasping() is False


DOWN = {"lower": [-0.8, -0.8], "upper": [0.0, 0.0]}
MIXED = {"lower": [0.0, -0.8], "upper": [0.8, 0.0]}


@pytest.mark.parametrize(
    ("bounds", "opening", "keys", "command", "expected"),
    [
        (DOWN, (-1, -1), {}, 1.0, [-0.8, -0.8]),
        (DOWN, (-1, -1), {}, -1.0, [0.0, 0.0]),
        (DOWN, (-1, -1), {"inverted": True}, 1.0, [0.0, 0.0]),
        (DOWN, (-1, -1), {"mode": "smooth"}, 0.5, [-0.6, -0.6]),
        (DOWN, (-1, -1), {"mode": "independent"}, [1.0, -0.5], [-0.8, -0.2]),
        (DOWN, (-1, -1), {"mode": "independent", "command_input_limits": None}, [-0.3, -0.1], [-0.3, -0.1]),
        (DOWN, (-1, -1), {"motor_type": "velocity"}, 1.0, [-0.2, -0.2]),
        (DOWN, (-1, 0), {}, 1.0, [-0.8, 0.0]),
        (MIXED, (1, -1), {}, 1.0, [0.8, -0.8]),
        (MIXED, (1, -1), {"mode": "smooth"}, 0.5, [0.6, -0.6]),
        (MIXED, (1, -1), {"mode": "independent", "motor_type": "velocity"}, [1, 1], [0.2, -0.2]),
        (MIXED, (1, -1), {"open_qpos": (0.5, -0.4)}, 1.0, [0.5, -0.4]),
    ],
)
def test_fingers_that_open_downwards_open_with_larger_commands(
    bounds, opening, keys, command, expected
) -> None:
    settings = GripperSettings.model_validate(keys)
    controller = MultiFingerGripperController(fingers(**bounds), settings, opening=opening)
    inside = state([0.02, -0.4]) if bounds is MIXED else state([-0.4, -0.3])
    controller.update_goal(np.atleast_1d(command), inside)
    value = controller.step(inside).value.copy()
    assert value == pytest.approx(np.array(expected, float))
    controller.update_goal(controller.noop_command(inside), inside)
    assert controller.step(inside).value == pytest.approx(value)


def test_jaws_with_opposite_axes_detect_a_grasp() -> None:
    settings = GripperSettings()
    controller = MultiFingerGripperController(fingers(**MIXED), settings, opening=(1, -1))
    controller.update_goal([-1.0], state([0.4, -0.4]))
    for _ in range(5):
        controller.step(state([0.3, -0.3]))
    assert controller.is_grasping() is True
