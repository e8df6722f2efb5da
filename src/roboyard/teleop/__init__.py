"""Driving a robot from the terminal: keys, choices, the loop."""

from __future__ import annotations

from roboyard.teleop.key_bindings import KeyBindings
from roboyard.teleop.loop import drive

__all__ = ["KeyBindings", "drive"]
