"""OperationalSpaceController: the tip moves like a damped spring about a goal pose, by joint efforts.

    e = [p* - p; e_R],  ẋ = J q̇,  a = kp e - kd ẋ,  kd = 2 ζ √kp
    Λ = (J M⁻¹ Jᵀ)⁻¹,  τ = Jᵀ Λ a + (1 - Jᵀ Λ J M⁻¹) M (kp₀ wrap(q_reset - q) - 2 √kp₀ q̇) + b

e_R is the rotation vector from the present to the goal orientation (OmniGibson: half the sum of cross
products of the axes, which vanishes at half a turn). All in the base frame's axes. Λ is taken of J M⁻¹ Jᵀ +
ε 1, so that arms of fewer than six joints and singular postures stay finite. `decouple_pos_ori` uses one Λ
for positions and one for orientations. b, the effort of gravity, Coriolis and centrifugal forces, is on by
default (OmniGibson disables gravity of the arm instead). Where a robot may tip over, e is limited
(`keep_balance`, see `roboyard.robots.stability.zmp`).
Source: Khatib, A unified approach for motion and force control, IEEE RA 3(1), 1987.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import field_validator

from roboyard.errors import ConfigError
from roboyard.kinematics import ChainArrays, jacobian
from roboyard.robots.control.controller import Control, ControllerSettings, GroupLimits, GroupState, MotorType
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.robots.control.task import TaskController, TaskSettings
from roboyard.transforms import Array

SOFTNESS = 1e-4
"""ε, relative to the trace of J M⁻¹ Jᵀ."""
SLOWEST_DAMPING = 1.0
"""Smallest assumed damping of tips (1/s)."""

Gain = float | tuple[float, ...]
Bounds = tuple[float, float]


class OperationalSpaceSettings(TaskSettings):
    """Keys of an OperationalSpaceController."""

    kp: Gain = 150.0
    """Stiffness (1/s²): one number or six."""
    damping_ratio: Gain = 1.0
    """Damping ratio: one number or six."""
    kp_null: Gain = 10.0
    """Stiffness of the null space (1/s²): one number, or one for each joint."""
    kp_limits: Bounds = (10.0, 300.0)
    """Bounds of a stiffness that the action sets. It sets none here: gains are constant, as OmniGibson
    requires too, and may lie outside.
    """
    damping_ratio_limits: Bounds = (0.0, 2.0)
    """Bounds of a damping ratio that the action sets; see `kp_limits`."""
    kp_null_limits: Bounds = (0.0, 50.0)
    """Bounds of a stiffness of the null space that the action sets; see `kp_limits`."""
    decouple_pos_ori: bool = False
    """Use separate inertias for position and orientation."""
    use_cc_compensation: bool = True
    """Add the effort of gravity, Coriolis and centrifugal forces."""
    keep_balance: bool = True
    """Keep a robot on wheels from tipping over."""

    @field_validator("kp", "damping_ratio", "kp_null")
    @classmethod
    def _not_negative(cls, value: Gain) -> Gain:
        if np.min(value) < 0:
            raise ValueError(f"must not be negative, got {value}")
        return value

    @field_validator("kp_limits", "damping_ratio_limits", "kp_null_limits")
    @classmethod
    def _in_order(cls, value: Bounds) -> Bounds:
        if not 0.0 <= value[0] <= value[1]:
            raise ValueError(f"must be a lower and an upper bound of at least 0, got {list(value)}")
        return value


class OperationalSpaceController(TaskController):
    """Drives an arm's end effector by joint efforts."""

    Settings: ClassVar[type[ControllerSettings]] = OperationalSpaceSettings
    settings: OperationalSpaceSettings  # pyright: ignore[reportIncompatibleVariableOverride]
    needs_mass_matrix: ClassVar[bool] = True

    def __init__(
        self, limits: GroupLimits, settings: OperationalSpaceSettings, *, chain: ChainArrays, rest: Array
    ) -> None:
        """Create the controller of a chain; arguments and errors as `TaskController`."""
        super().__init__(limits, settings, chain=chain, rest=rest)
        self.keeps_balance = settings.keep_balance  # type: ignore[misc]
        self._kp = _spread(settings.kp, 6, "kp")
        self._kd = 2.0 * np.sqrt(self._kp) * _spread(settings.damping_ratio, 6, "damping_ratio")
        self._kp_null = _spread(settings.kp_null, limits.size, "kp_null")
        self._kd_null = 2.0 * np.sqrt(self._kp_null)
        self._turns = np.where(chain.period > 0, chain.period, 0.0)

    @property
    def control_type(self) -> MotorType:
        """Joints are driven by effort."""
        return "effort"

    def _control(self, state: GroupState) -> Control:
        mass = state.mass_matrix
        assert mass is not None
        tip, goal = self.tip(state), state.mount @ self.target(state)
        J = jacobian(self.chain, state.q)
        axes = state.mount[:3, :3]
        J = np.concatenate([axes @ J[:3], axes @ J[3:]])
        error = np.concatenate([goal[:3, 3] - tip[:3, 3], vector_of_matrix(goal[:3, :3] @ tip[:3, :3].T)])
        spring, damper = self._kp * error, self._kd * (J @ state.v)
        if self.is_orientation_free:
            J, spring, damper = J[:3], spring[:3], damper[:3]
        inverse_mass_Jt = np.linalg.solve(mass, J.T)
        task_mass = _softened_inverse(J @ inverse_mass_Jt)
        balance = None if state.balance is None else state.balance()
        if balance is not None:
            pull = inverse_mass_Jt @ (task_mass @ spring)
            spring = spring * balance.pull(pull, state.v / max(float(self._kd.min()), SLOWEST_DAMPING))
        acceleration = spring - damper
        if self.settings.decouple_pos_ori and len(J) == 6:
            force = np.concatenate(
                [
                    _softened_inverse(J[:3] @ inverse_mass_Jt[:, :3]) @ acceleration[:3],
                    _softened_inverse(J[3:] @ inverse_mass_Jt[:, 3:]) @ acceleration[3:],
                ]
            )
        else:
            force = task_mass @ acceleration
        away = self.preferred - state.q
        away = np.where(self._turns > 0, (away + np.pi) % (2 * np.pi) - np.pi, away)
        posture = mass @ (self._kp_null * away - self._kd_null * state.v)
        effort = J.T @ force + posture - J.T @ (task_mass @ (inverse_mass_Jt.T @ posture))
        if state.bias is not None and self.settings.use_cc_compensation:
            effort = effort + state.bias
        return Control(kind="effort", value=effort)


def _softened_inverse(matrix: Array) -> Array:
    size = len(matrix)
    return np.linalg.inv(matrix + np.eye(size) * (SOFTNESS * np.trace(matrix) / size))


def _spread(value: Gain, size: int, key: str) -> Array:
    array = np.asarray(value, dtype=float)
    if array.shape not in ((), (size,)):
        raise ConfigError(f"{key}: must be one number or {size}, got {array.size}")
    return np.array(np.broadcast_to(array, (size,)))
