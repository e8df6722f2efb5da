"""Move a robot with a holonomic base, a trunk and arms along waypoints, by its own controllers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from roboyard.recording import SceneSetup
from roboyard.transforms import Array, matrix_from_quaternion

SPEED, MAX_SPEED = 0.6, 1.5
"""Driving speed, and speed of a base command of 1 (m/s)."""
GRIPPER_STEP, GRIPPER_TURN = 0.2, 0.5
"""Position and rotation step of an arm command of 1 (m, rad)."""
Base = tuple[float, float, float]
"""x, y (m) and yaw (rad) in the world frame."""


@dataclass(frozen=True)
class GripperPose:
    """The pose of a gripper in the world frame."""

    position: Array
    """(3,) point between the fingers (m)."""
    rotation: Array
    """(3, 3) rotation matrix; z points out of the gripper, y from finger to finger."""


@dataclass(frozen=True)
class Target:
    """Targets of grippers, base and trunk; parts without a target keep their goals."""

    grippers: Mapping[str, GripperPose] = field(default_factory=dict)
    base: Base | None = None
    trunk: tuple[float, ...] | None = None


def pointing(along: Array, across: Array) -> Array:
    """Return the (3, 3) rotation of a gripper that points `along`, its fingers apart `across`; (3,) unit
    vectors.
    """
    return np.stack([np.cross(across, along), across, along], axis=1)


class Actor:
    """Moves a robot by a script."""

    def __init__(self, stage: SceneSetup, watch: Callable[[], None] | None = None) -> None:
        """Create an actor for the robot of a scene; `watch` is called after every control step."""
        assert stage.robot is not None
        self.robot, self.world = stage.robot, stage.scene.world
        self._watch = watch or (lambda: None)

    @property
    def base(self) -> Base:
        """Pose of the base: x, y (m), yaw (rad)."""
        position, (x, y, z, w) = self.robot.pose
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return float(position[0]), float(position[1]), float(yaw)

    @property
    def trunk(self) -> Array:
        """(4,) positions of the trunk joints (rad)."""
        return self.robot.joint_positions[self.robot.control_idx["trunk"]]

    def gripper(self, arm: str) -> GripperPose:
        """Return the pose of an arm's gripper."""
        position, quaternion = self.robot.arms[arm].pose
        return GripperPose(np.asarray(position), matrix_from_quaternion(quaternion))

    def in_world(self, point: tuple[float, float, float]) -> Array:
        """Return the (3,) world position (m) of a point in the base frame."""
        x, y, yaw = self.base
        return about_z(yaw) @ point + (x, y, 0.0)

    # ------------------------------------------------------------------------------------------- one step

    def step(self, **commands: Array) -> None:
        """Run one control step; groups without a command keep their goals."""
        self.robot.apply_action(commands)
        self.world.step(self.robot.steps_per_control)
        self._watch()

    def base_command(self, target: Base, speed: float = SPEED) -> Array:
        """Return the (3,) base command towards a target pose."""
        x, y, yaw = self.base
        velocity = 2.5 * (about_z(-yaw) @ (target[0] - x, target[1] - y, 0.0))[:2]
        velocity *= speed / max(float(np.hypot(*velocity)), speed)
        turn = _wrapped(target[2] - yaw)
        return np.array([*(velocity / MAX_SPEED), np.clip(2.0 * turn, -1.0, 1.0) / np.pi])

    def gripper_command(self, arm: str, target: GripperPose) -> Array:
        """Return the (6,) arm command towards a gripper pose, in the base frame."""
        now = self.gripper(arm)
        into_base = matrix_from_quaternion(self.robot.orientation).T
        change = into_base @ (target.position - now.position)
        turn = into_base @ _rotation_vector(target.rotation @ now.rotation.T)
        return np.clip(np.concatenate([change / GRIPPER_STEP, turn / GRIPPER_TURN]), -1.0, 1.0)

    # --------------------------------------------------------------------------------------------- motions

    def go(self, target: Base, seconds: float = 12.0, near: float = 0.05) -> bool:
        """Drive to a target pose; return whether it was reached in time."""
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
        """Move along a path over 0 (start) to 1 (end) in `seconds` (s), and hold its end for `settle` (s)."""
        begin = self.world.time
        while self.world.time < begin + seconds + settle:
            u = min((self.world.time - begin) / seconds, 1.0)
            target = path(u * u * (3.0 - 2.0 * u))
            commands = {
                f"arm_{arm}": self.gripper_command(arm, gripper) for arm, gripper in target.grippers.items()
            }
            commands["base"] = np.zeros(3) if target.base is None else self.base_command(target.base)
            if target.trunk is not None:
                commands["trunk"] = np.clip(np.asarray(target.trunk) - self.trunk, -1.0, 1.0)
            self.step(**commands)
        self.step(base=np.zeros(3))

    def move(self, target: Target, seconds: float, settle: float = 0.5) -> None:
        """Move on a straight path to a target in `seconds` (s)."""
        grippers = {arm: self.gripper(arm) for arm in target.grippers}
        base, trunk = np.array(self.base), self.trunk

        def path(u: float) -> Target:
            led = {arm: _between(grippers[arm], target.grippers[arm], u) for arm in grippers}
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
        """Stop the base for `seconds` (s)."""
        end = self.world.time + seconds
        while self.world.time < end:
            self.step(base=np.zeros(3))

    def grip(self, arm: str, *, close: bool, seconds: float = 0.6) -> None:
        """Close or open a gripper for `seconds` (s)."""
        begin = self.world.time
        while self.world.time < begin + seconds:
            self.step(**{f"gripper_{arm}": np.array([-1.0 if close else 1.0]), "base": np.zeros(3)})


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def about_z(angle: float) -> Array:
    """Return the (3, 3) rotation about z by an angle (rad)."""
    return Rotation.from_euler("z", angle).as_matrix()


def _rotation_vector(rotation: Array) -> Array:
    return Rotation.from_matrix(rotation).as_rotvec()


def _between(start: GripperPose, end: GripperPose, u: float) -> GripperPose:
    turn = Rotation.from_rotvec(u * _rotation_vector(end.rotation @ start.rotation.T)).as_matrix()
    return GripperPose(start.position + u * (end.position - start.position), turn @ start.rotation)
