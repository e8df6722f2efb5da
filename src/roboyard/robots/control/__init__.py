"""Controllers: arrays in, drive targets out, one controller a file that begins with its formula."""

from __future__ import annotations

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
]
