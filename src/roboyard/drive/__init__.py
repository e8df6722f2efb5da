"""Driving a robot from the terminal: keys, choices, the loop."""

from __future__ import annotations

from roboyard.drive.loop import drive
from roboyard.drive.teleop import Teleop

__all__ = ["Teleop", "drive"]
