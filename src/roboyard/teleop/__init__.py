"""Driving a robot from the terminal: keys, choices, the loop."""

from __future__ import annotations

from roboyard.teleop.key_bindings import Teleop
from roboyard.teleop.loop import drive

__all__ = ["Teleop", "drive"]
