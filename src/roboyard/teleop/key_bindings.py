"""From keys to actions, with OmniGibson's bindings.

An action is zero but for what the keys of this step say, and for binary grippers, which keep their last
command. A terminal does not tell when a key is let go: a key acts for one step, and again with each repeat
of a held key.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from roboyard.transforms import Array

if TYPE_CHECKING:
    from collections.abc import Callable

    from roboyard.robots import Robot

JOINT_STEP, PRISMATIC_SHARE = 0.1, 0.2
DRIVE_STEP, TURN_STEP = 0.4, 0.2
IK_STEP, OSC_STEP = 0.1, 0.25
REPEAT_TIME = 0.6
"""s within which another press of the gripper's key is the repeat of a held one"""
TASK_KEYS = {
    "up": (0, 1.0), "down": (0, -1.0), "left": (1, 1.0), "right": (1, -1.0), "p": (2, 1.0), ";": (2, -1.0),
    "n": (3, 1.0), "b": (3, -1.0), "o": (4, 1.0), "u": (4, -1.0), "v": (5, 1.0), "c": (5, -1.0),
}  # fmt: skip
"""Key to component of the hand's command and sign."""
DRIVE_KEYS = {"i": (0, DRIVE_STEP), "k": (0, -DRIVE_STEP), "j": (1, TURN_STEP), "l": (1, -TURN_STEP)}

HELP = """\
  1 2   previous, next joint                 ] [   selected joint + and -
  3 4   previous, next hand                  arrows   hand x + - (up, down), y + - (left, right)
  p ;   hand z + -      n b   about x + -    o u   about y + -      v c   about z + -
  5 6   previous, next gripper               t   open or close it
  i k   drive on, back  j l   turn left, right
  m   next sensor's picture   r   reset      Esc   quit
"""


class KeyBindings:
    """What the keys mean for one robot."""

    def __init__(self, robot: Robot, clock: Callable[[], float] = time.monotonic) -> None:
        """Look at the robot's controllers; `clock` (s) tells repeats of a held key from new presses."""
        self._robot = robot
        self._clock = clock
        self._toggled = -np.inf
        parts = robot.controller_action_idx
        self.joints: list[tuple[str, int, float]] = []
        """Selectable single entries: name, place in the action, step."""
        self.hands: list[tuple[str, int, int, float]] = []
        """Group, start and length of its command, step."""
        self.grippers: list[tuple[str, int]] = []
        """Binary grippers: group, place."""
        self.wheels: list[int] = []
        """Starts of differential drives' commands."""
        slides = {joint.name for joint in robot.body.joints if joint.type == "prismatic"}
        for name, group in robot.groups.items():
            controller, start = group.controller, parts[name].start
            size, settings = controller.command_dim, controller.settings
            kind = type(controller).__name__
            if kind in ("InverseKinematicsController", "OperationalSpaceController"):
                step = OSC_STEP if kind.startswith("Operational") else IK_STEP
                self.hands.append((name, start, size, step))
            elif kind == "DifferentialDriveController":
                self.wheels.append(start)
            elif kind == "MultiFingerGripperController" and getattr(settings, "mode", "") == "binary":
                self.grippers.append((name, start))
            elif kind != "NullJointController":
                delta = bool(getattr(settings, "use_delta_commands", False))
                careful = delta and controller.control_type == "position"
                for k in range(size):
                    joint = group.joints[k] if size == len(group.joints) else name
                    step = JOINT_STEP * (PRISMATIC_SHARE if careful and joint in slides else 1.0)
                    self.joints.append((joint, start + k, step))
        self.joint = self.hand = self.gripper = 0
        """Which of them is selected."""
        self._open = np.ones(len(self.grippers))
        self._pending = np.zeros(robot.action_dim)

    def reset(self) -> None:
        """Open all grippers, forget keys; selections stay."""
        self._open[:] = 1.0
        self._pending[:] = 0.0

    def set_gripper(self, index: int, *, is_open: bool) -> None:
        """Open or close one of `grippers` with the next action."""
        self._open[index] = 1.0 if is_open else -1.0

    def press(self, key: str) -> bool:
        """Take a key; False where it means nothing here."""
        if key in "12" and self.joints:
            self.joint = (self.joint + (1 if key == "2" else -1)) % len(self.joints)
        elif key in "34" and self.hands:
            self.hand = (self.hand + (1 if key == "4" else -1)) % len(self.hands)
        elif key in "56" and self.grippers:
            self.gripper = (self.gripper + (1 if key == "6" else -1)) % len(self.grippers)
        elif key in "[]" and self.joints:
            _, place, step = self.joints[self.joint]
            self._pending[place] = step if key == "]" else -step
        elif key == "t" and self.grippers:
            now = self._clock()
            if now - self._toggled > REPEAT_TIME:
                self._open[self.gripper] *= -1.0
            self._toggled = now
        elif key in TASK_KEYS and self.hands:
            component, sign = TASK_KEYS[key]
            _, start, size, step = self.hands[self.hand]
            if component >= size:
                return False
            self._pending[start + component] = sign * step
        elif key in DRIVE_KEYS and self.wheels:
            component, value = DRIVE_KEYS[key]
            for start in self.wheels:
                self._pending[start + component] = value
        else:
            return False
        return True

    def action(self) -> Array:
        """(action_dim,) for the next step; the keys so far are used up."""
        out = self._pending.copy()
        for (_, place), value in zip(self.grippers, self._open, strict=True):
            out[place] = value
        self._pending[:] = 0.0
        return out

    def status(self) -> str:
        """What is selected, on one line."""
        parts = []
        if self.joints:
            parts.append(f"joint {self.joints[self.joint][0]}")
        if self.hands:
            parts.append(f"hand {self.hands[self.hand][0]}")
        if self.grippers:
            way = "open" if self._open[self.gripper] > 0 else "closed"
            parts.append(f"gripper {self.grippers[self.gripper][0]} {way}")
        if self.wheels:
            parts.append("wheels i k j l")
        return ", ".join(parts) or "nothing here moves by keys"
