"""Control of a robot from the terminal: key bindings, choices, the control loop."""

from __future__ import annotations

from roboyard.teleop.key_bindings import KeyBindings
from roboyard.teleop.loop import drive

__all__ = ["KeyBindings", "drive"]
