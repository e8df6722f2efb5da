"""Scaling of commands: clipped to input limits, then scaled to output limits.

c ← clip(c, in_lo, in_hi), then (c - (in_hi + in_lo)/2) · (out_hi - out_lo)/(in_hi - in_lo) + (out_hi +
out_lo)/2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError
from roboyard.transforms import Array


def _limit_setting(value: Any) -> Any:
    """Return a validated setting: None, "default", or (low, high) with numbers or (n,) arrays."""
    if value is None or (isinstance(value, str) and value == "default"):
        return value
    wrong = ValueError(
        f'must be "default", null, or [low, high] of numbers or lists of numbers, got {value!r}'
    )
    if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != 2:
        raise wrong
    try:
        low, high = (np.asarray(side, dtype=float) for side in value)
    except (TypeError, ValueError):
        raise wrong from None
    if low.ndim > 1 or high.ndim > 1 or not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise wrong
    return low, high


LimitSetting = Annotated[Any, BeforeValidator(_limit_setting)]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Scaling:
    """Affine map from commands to goals."""

    low: Array | None
    """(n,) smallest command; None: commands are not clipped."""
    high: Array | None
    """(n,) largest command; None: commands are not clipped."""
    middle: Array | float
    """(n,) middle of the input limits."""
    factor: Array | float
    """(n,) width of the output limits, per width of the input limits."""
    offset: Array | float
    """(n,) middle of the output limits."""

    @classmethod
    def from_settings(
        cls,
        input_limits: Any,
        output_limits: Any,
        size: int,
        default_output: tuple[ArrayLike, ArrayLike] | None,
    ) -> Scaling:
        """Return the scaling of a controller's settings.

        Args:
            input_limits: setting `command_input_limits`.
            output_limits: setting `command_output_limits`.
            size: n, the length of a command.
            default_output: (n,) or scalar limits for the setting "default".

        Raises:
            ConfigError: the limits do not fit a command, or are not in order.
        """
        if isinstance(output_limits, str):
            output_limits = default_output
        if isinstance(input_limits, str):
            input_limits = (-1.0, 1.0)
        if input_limits is None:
            return cls(low=None, high=None, middle=0.0, factor=1.0, offset=0.0)
        low, high = _spread(input_limits, size, "command_input_limits")
        if output_limits is None:
            return cls(low=low, high=high, middle=0.0, factor=1.0, offset=0.0)
        if not (high > low).all():
            raise ConfigError(
                f"command_input_limits: each low must be less than its high, got {low.tolist()}, "
                f"{high.tolist()}"
            )
        out_low, out_high = _spread(output_limits, size, "command_output_limits")
        bounded = np.isfinite(out_low) & np.isfinite(out_high)
        # continuous joints have no limits to scale to: their commands are not scaled
        out_low, out_high = np.where(bounded, out_low, low), np.where(bounded, out_high, high)
        return cls(
            low=low,
            high=high,
            middle=(high + low) / 2,
            factor=np.abs(out_high - out_low) / (high - low),
            offset=(out_high + out_low) / 2,
        )

    def apply(self, command: Array) -> Array:
        """Return the (n,) goal of an (n,) command."""
        if self.low is None or self.high is None:
            return command
        return (
            np.minimum(np.maximum(command, self.low), self.high) - self.middle
        ) * self.factor + self.offset

    def invert(self, value: Array) -> Array:
        """Return the (n,) command of an (n,) goal, not clipped."""
        if self.low is None:
            return value
        factor = np.where(np.asarray(self.factor) == 0.0, 1.0, self.factor)
        return (value - self.offset) / factor + self.middle


def _spread(limits: Any, size: int, what: str) -> tuple[Array, Array]:
    try:
        low, high = (np.array(np.broadcast_to(np.asarray(side, dtype=float), (size,))) for side in limits)
    except ValueError:
        shapes = [np.shape(side) for side in limits]
        raise ConfigError(f"{what}: shapes {shapes} do not fit a command of {size} numbers") from None
    return low, high
