"""Lead a robot with a holonomic base, a trunk and hands through way-points, by its own controllers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from roboyard.recording import SceneSetup
from roboyard.transforms import Array, matrix_from_quaternion

SPEED, LARGEST = 0.6, 1.5
"""m/s: how fast to go, and what a base command of 1 means."""
HAND_STEP, HAND_TURN = 0.2, 0.5
"""m and rad: what a hand's command of 1 means."""
Base = tuple[float, float, float]
"""x, y (m) and heading (rad) in the world."""


@dataclass(frozen=True)
class Hand:
    """Where a hand is to be, in the world."""

    position: Array
    """(3,) m, of the point between the fingers"""
    rotation: Array
    """(3, 3); z points out of the hand, y from finger to finger"""


@dataclass(frozen=True)
class Target:
    """What to do with hands, base and trunk; whatever is not named stays as it is."""

    hands: Mapping[str, Hand] = field(default_factory=dict)
    base: Base | None = None
    trunk: tuple[float, ...] | None = None


def pointing(along: Array, across: Array) -> Array:
    """(3, 3) of a hand that points `along`, its fingers apart `across`; unit vectors at right angles."""
    return np.stack([np.cross(across, along), across, along], axis=1)


class Actor:
    """Leads a robot through a script."""

    def __init__(self, stage: SceneSetup, watch: Callable[[], None] | None = None) -> None:
        """`watch` is called after every control step."""
        assert stage.robot is not None
        self.robot, self.world = stage.robot, stage.scene.world
        self._watch = watch or (lambda: None)

    @property
    def base(self) -> Base:
        """Where the base is."""
        position, (x, y, z, w) = self.robot.pose
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return float(position[0]), float(position[1]), float(yaw)

    @property
    def trunk(self) -> Array:
        """(4,) rad"""
        return self.robot.joint_positions[self.robot.control_idx["trunk"]]

    def hand(self, arm: str) -> Hand:
        """Where a hand is."""
        position, quaternion = self.robot.arms[arm].pose
        return Hand(np.asarray(position), matrix_from_quaternion(quaternion))

    def in_world(self, point: tuple[float, float, float]) -> Array:
        """(3,) m in the world of a point given in the base's frame."""
        x, y, yaw = self.base
        return about_z(yaw) @ point + (x, y, 0.0)

    # ------------------------------------------------------------------------------------------- one step

    def step(self, **commands: Array) -> None:
        """One control step; groups without a command keep their goals."""
        self.robot.apply_action(commands)
        self.world.step(self.robot.steps_per_control)
        self._watch()

    def base_command(self, target: Base, speed: float = SPEED) -> Array:
        """(3,) towards a place, in the base's own frame."""
        x, y, yaw = self.base
        velocity = 2.5 * (about_z(-yaw) @ (target[0] - x, target[1] - y, 0.0))[:2]
        velocity *= speed / max(float(np.hypot(*velocity)), speed)
        turn = _wrapped(target[2] - yaw)
        return np.array([*(velocity / LARGEST), np.clip(2.0 * turn, -1.0, 1.0) / np.pi])

    def hand_command(self, arm: str, target: Hand) -> Array:
        """(6,) the change that brings a hand to its target, in the base's frame."""
        now = self.hand(arm)
        into_base = matrix_from_quaternion(self.robot.orientation).T
        change = into_base @ (target.position - now.position)
        turn = into_base @ _rotation_vector(target.rotation @ now.rotation.T)
        return np.clip(np.concatenate([change / HAND_STEP, turn / HAND_TURN]), -1.0, 1.0)

    # --------------------------------------------------------------------------------------------- motions

    def go(self, target: Base, seconds: float = 12.0, near: float = 0.05) -> bool:
        """Drive to a place; False where it did not get there in time."""
        end = self.world.time + seconds
        while self.world.time < end:
            x, y, yaw = self.base
            if np.hypot(target[0] - x, target[1] - y) < near and abs(_wrapped(target[2] - yaw)) < near:
                self.step(base=np.zeros(3))
                return True
            self.step(base=self.base_command(target))
        self.step(base=np.zeros(3))
        return False

    def follow(self, path: Callable[[float], Target], seconds: float, settle: float = 0.5) -> None:
        """Lead everything along a path over 0 (begin) to 1 (end), and hold its end for `settle` s."""
        begin = self.world.time
        while self.world.time < begin + seconds + settle:
            u = min((self.world.time - begin) / seconds, 1.0)
            target = path(u * u * (3.0 - 2.0 * u))
            commands = {f"arm_{arm}": self.hand_command(arm, hand) for arm, hand in target.hands.items()}
            commands["base"] = np.zeros(3) if target.base is None else self.base_command(target.base)
            if target.trunk is not None:
                commands["trunk"] = np.clip(np.asarray(target.trunk) - self.trunk, -1.0, 1.0)
            self.step(**commands)
        self.step(base=np.zeros(3))

    def move(self, target: Target, seconds: float, settle: float = 0.5) -> None:
        """Straight from here to a target."""
        hands = {arm: self.hand(arm) for arm in target.hands}
        base, trunk = np.array(self.base), self.trunk

        def path(u: float) -> Target:
            led = {arm: _between(hands[arm], target.hands[arm], u) for arm in hands}
            place = None
            if target.base is not None:
                gap = np.array(target.base) - base
                gap[2] = _wrapped(gap[2])
                x, y, yaw = base + u * gap
                place = (float(x), float(y), float(yaw))
            bent = None if target.trunk is None else tuple(trunk + u * (np.asarray(target.trunk) - trunk))
            return Target(led, place, bent)

        self.follow(path, seconds, settle)

    def wait(self, seconds: float) -> None:
        """Stand still."""
        end = self.world.time + seconds
        while self.world.time < end:
            self.step(base=np.zeros(3))

    def grip(self, arm: str, *, close: bool, seconds: float = 0.6) -> None:
        """Close or open a hand."""
        begin = self.world.time
        while self.world.time < begin + seconds:
            self.step(**{f"gripper_{arm}": np.array([-1.0 if close else 1.0]), "base": np.zeros(3)})


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def about_z(angle: float) -> Array:
    return Rotation.from_euler("z", angle).as_matrix()


def _rotation_vector(rotation: Array) -> Array:
    return Rotation.from_matrix(rotation).as_rotvec()


def _between(start: Hand, end: Hand, u: float) -> Hand:
    turn = Rotation.from_rotvec(u * _rotation_vector(end.rotation @ start.rotation.T)).as_matrix()
    return Hand(start.position + u * (end.position - start.position), turn @ start.rotation)
