"""Controllers: arrays in, drive targets out, one controller a file that begins with its formula."""

from __future__ import annotations

from typing import TypeVar

from roboyard.errors import ConfigError
from roboyard.robots.control.controller import (
    Control,
    Controller,
    ControllerSettings,
    GroupLimits,
    GroupState,
)
from roboyard.robots.control.differential_drive import DifferentialDriveController
from roboyard.robots.control.gripper import MultiFingerGripperController
from roboyard.robots.control.holonomic_base import HolonomicBaseJointController
from roboyard.robots.control.inverse_kinematics import InverseKinematicsController
from roboyard.robots.control.joint import JointController
from roboyard.robots.control.null_joint import NullJointController
from roboyard.robots.control.operational_space import OperationalSpaceController
from roboyard.robots.definition.schema import ADDED_CONTROLLERS

REGISTERED_CONTROLLERS: dict[str, type[Controller]] = {
    cls.__name__: cls
    for cls in (
        JointController,
        InverseKinematicsController,
        OperationalSpaceController,
        HolonomicBaseJointController,
        DifferentialDriveController,
        MultiFingerGripperController,
        NullJointController,
    )
}
"""Class name, as definitions and configurations give it, to class."""
_BUILT_IN = frozenset(REGISTERED_CONTROLLERS)
_Added = TypeVar("_Added", bound=type[Controller])


def register_controller(cls: _Added) -> _Added:
    """Register a controller of your own under its class name, for any group; works as a decorator.

    `add_robot(..., controllers={"arm_left": "MyController"})` then creates it. Registering a class of
    the same name again replaces the earlier one.

    Raises:
        ConfigError: the name is that of one of Roboyard's controllers.
    """
    name = cls.__name__
    if name in _BUILT_IN:
        raise ConfigError(f"{name} is one of Roboyard's controllers; give yours another name")
    REGISTERED_CONTROLLERS[name] = cls
    if name not in ADDED_CONTROLLERS:
        ADDED_CONTROLLERS.append(name)
    return cls


__all__ = [
    "REGISTERED_CONTROLLERS",
    "Control",
    "Controller",
    "ControllerSettings",
    "DifferentialDriveController",
    "GroupLimits",
    "GroupState",
    "HolonomicBaseJointController",
    "InverseKinematicsController",
    "JointController",
    "MultiFingerGripperController",
    "NullJointController",
    "OperationalSpaceController",
    "register_controller",
]
