"""The drive law against characteristic equations and against its stated bounds."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.sim.actuation import gains
from roboyard.sim.actuation.gains import CONTROLLER, JOINT

INERTIA = np.array([1e-4, 0.01, 0.3, 2.0, 40.0])
EFFORT = np.array([5.0, 100.0, 40.0, np.inf, 10.0])
SLIDE = np.array([True, False, False, True, False])


@pytest.mark.parametrize("profile", [JOINT, CONTROLLER])
def test_position_gains_are_damped_at_least_critically(profile: gains.DriveProfile) -> None:
    per_error = gains.effort_per_error(profile, np.where(np.isfinite(EFFORT), EFFORT, 1e3), SLIDE)
    kp = gains.position_stiffness(profile, INERTIA, per_error, SLIDE)
    kd = gains.position_damping(INERTIA, kp)
    for moved, stiffness, damping in zip(INERTIA, kp, kd, strict=True):
        roots = np.roots([moved, damping, stiffness])
        assert roots.real.max() < 0
        assert np.abs(roots.imag).max() < 1e-3 * np.abs(roots).max()


def test_default_joint_gains_with_their_motor_are_critical_at_8_hz() -> None:
    per_error = gains.effort_per_error(JOINT, EFFORT, SLIDE)
    kp = gains.position_stiffness(JOINT, INERTIA, per_error, SLIDE)
    total = INERTIA + gains.motor_inertia(JOINT, kp, INERTIA)
    np.testing.assert_allclose(kp, total * (2 * np.pi * 8.0) ** 2)
    np.testing.assert_allclose(gains.position_damping(total, kp), 2 * kp / (2 * np.pi * 8.0))


def test_stiffness_of_light_joints_is_bounded_by_the_time_step_and_by_saturation() -> None:
    effort = np.array([1e9, 100.0, 1.0])
    inertia, hinge = np.array([1.0, 0.02, 1.0]), np.zeros(3, dtype=bool)
    kp = gains.position_stiffness(JOINT, inertia, gains.effort_per_error(JOINT, effort, hinge), hinge)
    np.testing.assert_allclose(kp, [(60 * np.pi) ** 2, 100.0 / 0.15, (20 * np.pi) ** 2])
    kp = gains.position_stiffness(
        CONTROLLER, inertia, gains.effort_per_error(CONTROLLER, effort, hinge), hinge
    )
    np.testing.assert_allclose(kp, [(60 * np.pi) ** 2, 100.0 / 0.2, 1.0 / 0.03])


def test_velocity_gains_overcome_resistance_and_do_not_saturate_below_a_tenth_of_the_limit() -> None:
    kd = gains.velocity_damping(
        CONTROLLER,
        np.array([0.1, 0.1, 10.0]),
        resistance=np.array([0.0, 60.0, 0.0]),
        effort=100.0,
        largest_velocity=10.0,
    )
    np.testing.assert_allclose(kd, [0.1 * 80 * np.pi, 60.0, 100.0])


def test_scalars_and_arrays_agree() -> None:
    per_error = gains.effort_per_error(JOINT, EFFORT, SLIDE)
    together = gains.position_stiffness(JOINT, INERTIA, per_error, SLIDE)
    for k in range(len(INERTIA)):
        one = gains.position_stiffness(JOINT, float(INERTIA[k]), float(per_error[k]), bool(SLIDE[k]))
        assert one == together[k]
