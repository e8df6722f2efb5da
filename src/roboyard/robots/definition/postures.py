"""Reset, tucked and untucked postures of a definition, as vectors in the robot's joint order.

Definition files hold postures breadth first (PhysX's order); the robot's vectors are depth first (MuJoCo's).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import RobotDescription
from roboyard.errors import ConfigError
from roboyard.kinematics.joint_order import breadth_first_joint_names, reorder
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.transforms import Array

ResetMode = Literal["tuck", "untuck"]


def tuck_posture(
    definition: RobotDefinition, description: RobotDescription, joint_names: Sequence[str], mode: ResetMode
) -> Array | None:
    """Return the tucked or untucked posture of a definition.

    Args:
        definition: with or without a `mobile_manipulation` block.
        description: of the same robot.
        joint_names: (n,) order of the result.
        mode: "tuck" or "untuck".

    Returns:
        (n,) joint positions (rad or m); None without the block.
    """
    block = definition.mobile_manipulation
    if block is None:
        return None
    tucked = mode == "tuck"
    values = block.tucked_default_joint_pos if tucked else block.untucked_default_joint_pos
    if block.joint_names is None:
        return _from_file(values, description, joint_names)
    by_name = dict(zip(block.joint_names, values, strict=True))
    return np.array([by_name.get(name, 0.0) for name in joint_names])


def reset_posture(
    definition: RobotDefinition,
    description: RobotDescription,
    joint_names: Sequence[str],
    *,
    given: ArrayLike | None = None,
    mode: ResetMode = "untuck",
) -> Array | None:
    """Return the posture of a reset: `given`, else `default_joint_pos`, else the posture of `mode`.

    Args:
        definition: of the robot.
        description: of the robot.
        joint_names: (n,) order of `given` and of the result.
        given: (n,) joint positions (rad or m).
        mode: "tuck" or "untuck".

    Returns:
        (n,) joint positions (rad or m); None where the definition has none.

    Raises:
        ConfigError: `given` has another length or is not finite.
    """
    if given is not None:
        posture = np.array(given, dtype=float)
        if posture.shape != (len(joint_names),) or not np.isfinite(posture).all():
            raise ConfigError(
                f"reset_joint_pos must be {len(joint_names)} finite numbers in the order of joint_names, "
                f"got {posture.tolist()} of shape {posture.shape}"
            )
        return posture
    if definition.default_joint_pos:
        return _from_file(definition.default_joint_pos, description, joint_names)
    return tuck_posture(definition, description, joint_names, mode)


def file_postures(
    definition: RobotDefinition, description: RobotDescription, joint_names: Sequence[str]
) -> dict[str, Array]:
    """Return every posture of a definition by its key in the file.

    Args:
        definition: of the robot.
        description: of the robot.
        joint_names: (n,) order of the results.

    Returns:
        Key to (n,) joint positions (rad or m); keys that the file does not have are absent.
    """
    found: dict[str, Array | None] = {
        "mobile_manipulation.untucked_default_joint_pos": tuck_posture(
            definition, description, joint_names, "untuck"
        ),
        "mobile_manipulation.tucked_default_joint_pos": tuck_posture(
            definition, description, joint_names, "tuck"
        ),
    }
    if definition.default_joint_pos:
        found = {
            "default_joint_pos": _from_file(definition.default_joint_pos, description, joint_names),
            **found,
        }
    return {key: posture for key, posture in found.items() if posture is not None}


def _from_file(values: Sequence[float], description: RobotDescription, joint_names: Sequence[str]) -> Array:
    """Return a definition file's (n,) breadth-first vector in the order of `joint_names`."""
    return np.array(values)[reorder(breadth_first_joint_names(description), joint_names)]
