"""Reset, tucked and untucked postures of a definition, as vectors in the robot's joint order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from roboyard.errors import ConfigError
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.transforms import Array

ResetMode = Literal["tuck", "untuck"]


def tuck_posture(definition: RobotDefinition, joint_names: Sequence[str], mode: ResetMode) -> Array | None:
    """(n,) the tucked or untucked posture; None without the block."""
    block = definition.mobile_manipulation
    if block is None:
        return None
    tucked = mode == "tuck"
    values = block.tucked_default_joint_pos if tucked else block.untucked_default_joint_pos
    if block.joint_names is None:
        return np.array(values)
    by_name = dict(zip(block.joint_names, values, strict=True))
    return np.array([by_name.get(name, 0.0) for name in joint_names])


def reset_posture(
    definition: RobotDefinition,
    joint_names: Sequence[str],
    *,
    given: ArrayLike | None = None,
    mode: ResetMode = "untuck",
) -> Array | None:
    """(n,) what is given, else `default_joint_pos`, else the posture of `mode`, else None.

    Raises:
        ConfigError: the vector given has another length.
    """
    if given is not None:
        posture = np.array(given, dtype=float)
        if posture.shape != (len(joint_names),) or not np.isfinite(posture).all():
            raise ConfigError(
                f"reset_joint_pos: give {len(joint_names)} finite numbers; got shape {posture.shape}"
            )
        return posture
    if definition.default_joint_pos:
        return np.array(definition.default_joint_pos)
    return tuck_posture(definition, joint_names, mode)
