"""Scaling of commands: the stated formula, its inverse, and limits that do not fit."""

from __future__ import annotations

import numpy as np
import pytest
from controller_states import limits, make, state

from roboyard.errors import ConfigError
from roboyard.robots.control import ControllerSettings
from roboyard.robots.control.action_space import ActionSpace
from roboyard.robots.control.scaling import Scaling

LOW, HIGH = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 4.0, 3.0])
OUT_LOW, OUT_HIGH = np.array([-0.5, 10.0, -3.0]), np.array([1.5, 30.0, 5.0])


def scaling(given, result, size: int = 3, default=(-1.0, 1.0)) -> Scaling:
    settings = ControllerSettings(command_input_limits=given, command_output_limits=result)
    return Scaling.from_settings(settings.command_input_limits, settings.command_output_limits, size, default)


def test_inputs_are_mapped_linearly_between_the_limits_and_clipped_beyond() -> None:
    one = scaling((LOW, HIGH), (OUT_LOW, OUT_HIGH))
    for k, fraction in enumerate((0.25, -3.0, 1.5)):
        command = LOW + fraction * (HIGH - LOW)
        expected = np.interp(command[k], [LOW[k], HIGH[k]], [OUT_LOW[k], OUT_HIGH[k]])
        assert one.apply(command)[k] == pytest.approx(expected)


def test_the_inverse_of_a_scaling_returns_the_command() -> None:
    one = scaling((LOW, HIGH), (OUT_LOW, OUT_HIGH))
    commands = np.random.default_rng(0).uniform(LOW, HIGH, (20, 3))
    for command in commands:
        assert one.invert(one.apply(command)) == pytest.approx(command)


def test_a_range_of_no_width_inverts_to_a_finite_command_within_the_input_limits() -> None:
    locked = scaling("default", (0.25, 0.25), size=2)
    assert locked.apply(np.array([0.7, -0.7])) == pytest.approx([0.25, 0.25])
    assert locked.invert(np.array([0.25, 0.25])) == pytest.approx([0.0, 0.0])


def test_commands_without_input_limits_are_neither_clipped_nor_scaled() -> None:
    raw = scaling(None, (OUT_LOW, OUT_HIGH))
    command = np.array([100.0, -7.0, 0.5])
    assert raw.apply(command) == pytest.approx(command)
    assert raw.invert(command) == pytest.approx(command)


def test_commands_without_output_limits_are_only_clipped() -> None:
    clipped = scaling((LOW, HIGH), None)
    assert clipped.apply(np.array([-4.0, 1.0, 9.0])) == pytest.approx([-1.0, 1.0, 3.0])


def test_joints_without_limits_are_not_scaled_while_others_are() -> None:
    bounds = limits(3, lower=[-1.0, -np.inf, 0.0], upper=[3.0, np.inf, np.inf])
    controller = make("JointController", bounds)
    controller.update_goal([0.5, 0.5, 0.5], state(np.zeros(3)))
    assert controller.goal == pytest.approx([2.0, 0.5, 0.5])


@pytest.mark.parametrize(
    ("given", "result", "message"),
    [
        (
            ([0, 0], [1, 1]),
            None,
            r"command_input_limits: shapes \[\(2,\), \(2,\)\] do not fit a command of 3",
        ),
        ((-1, 1), ([0.0, 1.0], 2.0), r"command_output_limits: shapes .* do not fit a command of 3"),
        (
            (1, 1),
            (0, 1),
            r"command_input_limits: each low must be less than its high, got \[1\.0, 1\.0, 1\.0\]",
        ),
        ((2, -2), "default", "each low must be less than its high"),
    ],
)
def test_limits_that_do_not_fit_a_command_are_refused(given, result, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        scaling(given, result)


@pytest.mark.parametrize("value", ["usual", 3, (1,), (0, 1, 2), ("a", "b"), (0, np.inf), ([[0]], [[1]])])
def test_settings_that_are_no_pair_of_finite_limits_are_refused(value) -> None:
    with pytest.raises(ValueError, match='must be "default", null, or'):
        ControllerSettings(command_input_limits=value)


def test_action_spaces_sample_within_their_bounds_and_contain_only_actions_within_them() -> None:
    space = ActionSpace(
        low=np.array([-2.0, -np.inf, 0.5]), high=np.array([-1.0, np.inf, np.inf]), slices={"a": slice(0, 3)}
    )
    drawn = np.array([space.sample(np.random.default_rng(seed)) for seed in range(300)])
    assert all(space.contains(action) for action in drawn)
    assert drawn[:, 0].min() < -1.95 and drawn[:, 0].max() > -1.05
    assert np.abs(drawn[:, 1]).max() <= 1.0
    assert not space.contains([-1.5, 0.0])
    assert not space.contains([-0.5, 0.0, 1.0])
    assert space.contains([-1.0, 1e9, 0.5])
