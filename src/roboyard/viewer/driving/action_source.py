"""Convert a page's keys, joysticks and handles to actions of a robot.

Keys have the meaning that they have in the terminal (`roboyard.teleop.KeyBindings`), but act while they are
held. Unlike there, keys and joysticks move the base of a holonomic robot too, and each end effector may
have a target pose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.robots.control.task import TaskController
from roboyard.teleop import KeyBindings
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots import Robot

KEY_NAMES = {"ArrowUp": "up", "ArrowDown": "down", "ArrowLeft": "left", "ArrowRight": "right"}
"""Name of a key in the browser to its name in the terminal."""
TAP_KEYS = frozenset("123456t")
"""Keys that act once when pressed, not while held."""
BASE_KEYS = {
    "i": (0, 1.0), "k": (0, -1.0), ",": (1, 1.0), ".": (1, -1.0), "j": (2, 1.0), "l": (2, -1.0),
}  # fmt: skip
"""Key to direction (0 forward, 1 left, 2 counter-clockwise) and sign."""
DEFAULT_SPEED = 0.4
"""Fraction of the base's maximum speed."""

HELP = """\
| keys | |
|---|---|
| i k , . | base: forward, back, left, right |
| j l | base: turn left, turn right |
| arrows, p ; | end effector: x + -, y + -, z + - |
| n b o u v c | end effector: about x + -, y + -, z + - |
| 3 4 | previous, next arm |
| ] [ | selected joint: + - |
| 1 2 | previous, next joint |
| t | open or close the gripper |
| 5 6 | previous, next gripper |
| r | reset |

End effectors move along the axes of the robot's base: x forward, y left. Keys w a s d q e move the camera.
"""


class ActionSource:
    """The actions of one robot, one per control step, from a page's inputs."""

    def __init__(self, robot: Robot) -> None:
        """Read the robot's controllers; make a new source when they change."""
        self.robot = robot
        self.key_bindings = KeyBindings(robot)
        self.speed = DEFAULT_SPEED
        """Fraction of the maximum speed of the base at a held key or a full deflection of a joystick, and of
        joints in planned motions."""
        self.targets: dict[str, Array] = {}
        """Joint group to the (4, 4) target pose of its end effector in the robot's base frame (m)."""
        self.steered: str | None = None
        """Joint group that keys moved with the last action."""
        self._base: tuple[str, int] | None = _base_of(robot)

    @property
    def arms(self) -> tuple[str, ...]:
        """Joint groups whose end effector can have a target pose."""
        return tuple(name for name, *_ in self.key_bindings.arms)

    @property
    def joysticks(self) -> tuple[str, ...]:
        """Names of the joysticks for this robot's base."""
        if self._base is None:
            return ()
        return ("move", "turn") if self._base[0] == "holonomic" else ("drive",)

    def end_effector_pose(self, group: str) -> Array:
        """Return the (4, 4) pose of a group's end effector in the robot's base frame (m)."""
        found = self.robot.groups[group]
        controller = found.controller
        assert isinstance(controller, TaskController)
        return controller.tip(self.robot.loop.state_of(found))

    def press(self, key: str) -> None:
        """Handle a key press, for keys that act once."""
        name = KEY_NAMES.get(key, key)
        if name in TAP_KEYS:
            self.key_bindings.press(name)

    def reset(self) -> None:
        """Open the grippers and drop all target poses."""
        self.key_bindings.reset()
        self.targets.clear()

    def action(
        self, held: Iterable[str] = (), joysticks: Mapping[str, tuple[float, float]] | None = None
    ) -> Array:
        """Return the (action_dim,) action of the next control step.

        Args:
            held: names of the held keys in the browser.
            joysticks: joystick to its deflection to the right and up, each from -1 to 1.
        """
        names = [KEY_NAMES.get(key, key) for key in held]
        parts = self.robot.controller_action_idx
        selected = self.key_bindings.arms[self.key_bindings.arm] if self.key_bindings.arms else None
        for name in names:
            if name in TAP_KEYS or (self._base is not None and name in BASE_KEYS):
                continue
            self.key_bindings.press(name)
        action = self.key_bindings.action()
        self.steered = None
        if selected is not None and action[parts[selected[0]]].any():
            self.steered = selected[0]
            self.targets.pop(self.steered, None)
        for group, target in tuple(self.targets.items()):
            action[parts[group]] = self._task_command(group, target)
        self._move_base(action, names, joysticks or {})
        return action

    def _move_base(
        self, action: Array, names: list[str], joysticks: Mapping[str, tuple[float, float]]
    ) -> None:
        if self._base is None:
            return
        kind, start = self._base
        command = np.zeros(3)
        for name in names:
            if name in BASE_KEYS:
                direction, sign = BASE_KEYS[name]
                command[direction] += sign
        right, up = joysticks.get("move", joysticks.get("drive", (0.0, 0.0)))
        turn, _ = joysticks.get("turn", (right, 0.0) if kind == "differential" else (0.0, 0.0))
        command += [up, -right if kind == "holonomic" else 0.0, -turn]
        command = self.speed * np.clip(command, -1.0, 1.0)
        if kind == "holonomic":
            action[start : start + 3] = command
        else:
            action[start : start + 2] = command[[0, 2]]

    def _task_command(self, group: str, target: Array) -> Array:
        """Return the command towards the (4, 4) `target` in the base frame, within the command limits."""
        found = self.robot.groups[group]
        controller: Any = found.controller
        state = self.robot.loop.state_of(found)
        origin = controller.tip(state)
        if controller.settings.goal_update_mode == "target" and controller.goal is not None:
            origin = state.mount @ controller.target(state)
        mode, value = controller.settings.mode, np.zeros(6)
        value[:3] = target[:3, 3] if mode == "absolute_pose" else target[:3, 3] - origin[:3, 3]
        turn = target[:3, :3]
        value[3:] = vector_of_matrix(
            turn if mode.endswith(("_pose", "absolute_ori")) else turn @ origin[:3, :3].T
        )
        scaling = controller.scaling
        command = scaling.invert(value[: controller.command_dim])
        return command if scaling.low is None else np.clip(command, scaling.low, scaling.high)

    def status(self) -> str:
        """Return the selected joint, arm and gripper in one line."""
        parts = self.key_bindings.status().split(", ")
        return ", ".join(part for part in parts if not part.startswith("wheels"))


def _base_of(robot: Robot) -> tuple[str, int] | None:
    """Return the kind of the base and the start of its command in the action; None: no velocity base."""
    for name, controller in robot.controllers.items():
        kind, start = type(controller).__name__, robot.controller_action_idx[name].start
        if kind == "DifferentialDriveController":
            return "differential", start
        if kind == "HolonomicBaseJointController" and controller.control_type == "velocity":
            return "holonomic", start
    return None
