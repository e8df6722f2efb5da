"""Packages, extras, folders, robots and the speed of this machine: the checks of `roboyard doctor`."""

from roboyard.diagnosis.check import Check
from roboyard.diagnosis.folders import folder_checks
from roboyard.diagnosis.packages import package_checks
from roboyard.diagnosis.robots import robot_checks
from roboyard.diagnosis.speed import speed_checks

__all__ = ["Check", "folder_checks", "package_checks", "robot_checks", "speed_checks"]
