"""Drive a robot from the browser: keys, joysticks, end effector handles, grippers, videos, saved states."""

from __future__ import annotations

from roboyard.viewer.driving.page import DrivingPage

__all__ = ["DrivingPage"]
