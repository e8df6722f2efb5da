"""Actions of a robot from keys, with OmniGibson's key bindings.

An action is zero except for the entries of the keys pressed since the last action, and for binary grippers,
which keep their last command. A terminal does not report when a key is released: a key acts for one step, and
again with each repeat of a held key.
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
"""Step of a joint's command, and the share of it for prismatic joints under delta control."""
DRIVE_STEP, TURN_STEP = 0.4, 0.2
"""Commands of a differential drive, forward and turning."""
IK_STEP, OSC_STEP = 0.1, 0.25
"""Steps of an end effector's command under inverse kinematics and operational space control."""
REPEAT_TIME = 0.6
"""Time within which another press of the gripper's key counts as the repeat of a held key (s)."""
TASK_KEYS = {
    "up": (0, 1.0), "down": (0, -1.0), "left": (1, 1.0), "right": (1, -1.0), "p": (2, 1.0), ";": (2, -1.0),
    "n": (3, 1.0), "b": (3, -1.0), "o": (4, 1.0), "u": (4, -1.0), "v": (5, 1.0), "c": (5, -1.0),
}  # fmt: skip
"""Key to component of the end effector's command and sign."""
DRIVE_KEYS = {"i": (0, DRIVE_STEP), "k": (0, -DRIVE_STEP), "j": (1, TURN_STEP), "l": (1, -TURN_STEP)}
"""Key to component of the differential drive's command and value."""

HELP = """\
  1 2   previous, next joint                 ] [   selected joint + and -
  3 4   previous, next arm                   arrows   move x + - (up, down), y + - (left, right)
  p ;   move z + -      n b   rotate x + -   o u   rotate y + -     v c   rotate z + -
  5 6   previous, next gripper               t   open or close it
  i k   forward, back   j l   turn left, right
  m   next sensor's picture   r   reset      Esc   quit
"""
"""Help text of the keys."""


class KeyBindings:
    """The keys of one robot: which entries of its action they change."""

    def __init__(self, robot: Robot, clock: Callable[[], float] = time.monotonic) -> None:
        """Derive the bindings from a robot's controllers.

        Args:
            robot: the robot.
            clock: returns the time (s), to distinguish repeats of a held key from new presses.
        """
        self._robot = robot
        self._clock = clock
        self._toggled = -np.inf
        parts = robot.controller_action_idx
        self.joints: list[tuple[str, int, float]] = []
        """Joints that can be selected: name, index in the action, step."""
        self.arms: list[tuple[str, int, int, float]] = []
        """Groups that move an end effector: name, start and length of the command, step."""
        self.grippers: list[tuple[str, int]] = []
        """Binary grippers: group, index in the action."""
        self.wheels: list[int] = []
        """Start of each differential drive's command in the action."""
        slides = {joint.name for joint in robot.body.joints if joint.type == "prismatic"}
        for name, group in robot.groups.items():
            controller, start = group.controller, parts[name].start
            size, settings = controller.command_dim, controller.settings
            kind = type(controller).__name__
            if kind in ("InverseKinematicsController", "OperationalSpaceController"):
                step = OSC_STEP if kind.startswith("Operational") else IK_STEP
                self.arms.append((name, start, size, step))
            elif kind == "DifferentialDriveController":
                self.wheels.append(start)
            elif kind == "MultiFingerGripperController" and getattr(settings, "mode", "") == "binary":
                self.grippers.append((name, start))
            elif kind != "NullJointController":
                delta = bool(getattr(settings, "use_delta_commands", False))
                slow_slides = delta and controller.control_type == "position"
                for k in range(size):
                    joint = group.joints[k] if size == len(group.joints) else name
                    step = JOINT_STEP * (PRISMATIC_SHARE if slow_slides and joint in slides else 1.0)
                    self.joints.append((joint, start + k, step))
        self.joint = self.arm = self.gripper = 0
        """Index of the selected joint, arm and gripper."""
        self._open = np.ones(len(self.grippers))
        self._pending = np.zeros(robot.action_dim)

    def reset(self) -> None:
        """Open all grippers and discard pending keys; the selection stays."""
        self._open[:] = 1.0
        self._pending[:] = 0.0

    def set_gripper(self, index: int, *, is_open: bool) -> None:
        """Open or close one of `grippers` with the next action."""
        self._open[index] = 1.0 if is_open else -1.0

    def press(self, key: str) -> bool:
        """Process a key and return whether it is bound for this robot."""
        if key in "12" and self.joints:
            self.joint = (self.joint + (1 if key == "2" else -1)) % len(self.joints)
        elif key in "34" and self.arms:
            self.arm = (self.arm + (1 if key == "4" else -1)) % len(self.arms)
        elif key in "56" and self.grippers:
            self.gripper = (self.gripper + (1 if key == "6" else -1)) % len(self.grippers)
        elif key in "[]" and self.joints:
            _, index, step = self.joints[self.joint]
            self._pending[index] = step if key == "]" else -step
        elif key == "t" and self.grippers:
            now = self._clock()
            if now - self._toggled > REPEAT_TIME:
                self._open[self.gripper] *= -1.0
            self._toggled = now
        elif key in TASK_KEYS and self.arms:
            component, sign = TASK_KEYS[key]
            _, start, size, step = self.arms[self.arm]
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
        """Return the (action_dim,) action of the next step, and discard the keys pressed so far."""
        out = self._pending.copy()
        for (_, index), value in zip(self.grippers, self._open, strict=True):
            out[index] = value
        self._pending[:] = 0.0
        return out

    def status(self) -> str:
        """Return the selected joint, arm and gripper on one line."""
        parts = []
        if self.joints:
            parts.append(f"joint {self.joints[self.joint][0]}")
        if self.arms:
            parts.append(f"arm {self.arms[self.arm][0]}")
        if self.grippers:
            state = "open" if self._open[self.gripper] > 0 else "closed"
            parts.append(f"gripper {self.grippers[self.gripper][0]} {state}")
        if self.wheels:
            parts.append("wheels i k j l")
        return ", ".join(parts) or "no joints, arms, grippers or wheels to control by keys"
