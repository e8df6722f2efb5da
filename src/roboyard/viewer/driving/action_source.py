"""From what is held, pulled and dragged on a page to actions of a robot.

Keys mean what they mean in the terminal (`roboyard.teleop.KeyBindings`), but act for as long as they are
held.
On a
page the base of a holonomic robot has keys and sticks too, and each hand may have a pose to go to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.robots.control.rotations import inverse, vector_of_matrix
from roboyard.robots.control.task import TaskController
from roboyard.teleop import KeyBindings
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.robots import Robot

NAMES = {"ArrowUp": "up", "ArrowDown": "down", "ArrowLeft": "left", "ArrowRight": "right"}
"""Names of keys in a browser, and in the terminal."""
ONCE = frozenset("123456t")
"""Keys that act when they go down and not while they are held."""
BASE_KEYS = {
    "i": (0, 1.0), "k": (0, -1.0), ",": (1, 1.0), ".": (1, -1.0), "j": (2, 1.0), "l": (2, -1.0),
}  # fmt: skip
"""Key to direction (on, to the left, turning to the left) and sign."""
SPEED = 0.4
"""Of the base's largest speed, where nobody chose another."""

HELP = """\
| keys | |
|---|---|
| i k , . | base: on, back, left, right |
| j l | base: turn left, turn right |
| arrows, p ; | hand: x + -, y + -, z + - |
| n b o u v c | hand: about x + -, y + -, z + - |
| 3 4 | previous, next hand |
| ] [ | selected joint: + - |
| 1 2 | previous, next joint |
| t | open or close the gripper |
| 5 6 | previous, next gripper |
| r | reset |

Directions of a hand are those of the robot's base: x to the front, y to the left. Keys w a s d q e move the
camera.
"""


class ActionSource:
    """What a page asks of one robot, as one action a control step."""

    def __init__(self, robot: Robot) -> None:
        """Look at the robot's controllers; make a new pilot when they change."""
        self.robot = robot
        self.teleop = KeyBindings(robot)
        self.speed = SPEED
        """Share of the base's largest speed that a held key or a full pull means."""
        self.targets: dict[str, Array] = {}
        """Group to the (4, 4) pose, in the robot's base frame, that its hand is to go to."""
        self._base: tuple[str, int] | None = _base_of(robot)

    @property
    def hands(self) -> tuple[str, ...]:
        """Groups that can be given a pose."""
        return tuple(name for name, *_ in self.teleop.hands)

    @property
    def joysticks(self) -> tuple[str, ...]:
        """Names of the sticks that this robot has a use for."""
        if self._base is None:
            return ()
        return ("move", "turn") if self._base[0] == "holonomic" else ("drive",)

    def tip(self, group: str) -> Array:
        """(4, 4) pose of a hand in the robot's base frame."""
        found = self.robot.groups[group]
        controller = found.controller
        assert isinstance(controller, TaskController)
        return controller.tip(self.robot.loop.state_of(found))

    def press(self, key: str) -> None:
        """A key went down; for those that act once."""
        name = NAMES.get(key, key)
        if name in ONCE:
            self.teleop.press(name)

    def reset(self) -> None:
        """Open the grippers, forget where hands were to go."""
        self.teleop.reset()
        self.targets.clear()

    def action(
        self, held: Iterable[str] = (), joysticks: Mapping[str, tuple[float, float]] | None = None
    ) -> Array:
        """(action_dim,) for the next control step.

        Args:
            held: keys that are down, by their names in the browser.
            sticks: stick to its pull, right and up.
        """
        names = [NAMES.get(key, key) for key in held]
        parts = self.robot.controller_action_idx
        hand = self.teleop.hands[self.teleop.hand] if self.teleop.hands else None
        for name in names:
            if name in ONCE or (self._base is not None and name in BASE_KEYS):
                continue
            self.teleop.press(name)
        action = self.teleop.action()
        if hand is not None and action[parts[hand[0]]].any():
            self.targets.pop(hand[0], None)
        for group, target in tuple(self.targets.items()):
            action[parts[group]] = self._towards(group, target)
        self._move_base(action, names, joysticks or {})
        return action

    def _move_base(
        self, action: Array, names: list[str], joysticks: Mapping[str, tuple[float, float]]
    ) -> None:
        if self._base is None:
            return
        kind, start = self._base
        wanted = np.zeros(3)
        for name in names:
            if name in BASE_KEYS:
                direction, sign = BASE_KEYS[name]
                wanted[direction] += sign
        right, up = joysticks.get("move", joysticks.get("drive", (0.0, 0.0)))
        turn, _ = joysticks.get("turn", (right, 0.0) if kind == "differential" else (0.0, 0.0))
        wanted += [up, -right if kind == "holonomic" else 0.0, -turn]
        wanted = self.speed * np.clip(wanted, -1.0, 1.0)
        if kind == "holonomic":
            action[start : start + 3] = wanted
        else:
            action[start : start + 2] = wanted[[0, 2]]

    def _towards(self, group: str, target: Array) -> Array:
        """The command that makes `target` (in the base frame) the goal, or as far as one command reaches."""
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
        """What keys act upon, on one line."""
        told = self.teleop.status()
        return ", ".join(part for part in told.split(", ") if not part.startswith("wheels"))


def _base_of(robot: Robot) -> tuple[str, int] | None:
    """Kind of the base and the start of its command."""
    for name, controller in robot.controllers.items():
        kind, start = type(controller).__name__, robot.controller_action_idx[name].start
        if kind == "DifferentialDriveController":
            return "differential", start
        if kind == "HolonomicBaseJointController" and controller.control_type == "velocity":
            return "holonomic", start
    return None


def in_base(robot: Robot, pose: Array) -> Array:
    """A (4, 4) pose in the world, in the robot's base frame."""
    from roboyard.transforms import pose_matrix

    return inverse(pose_matrix(*robot.base_link.pose)) @ pose
