"""A robot at work: its joints by part, its controllers, what it holds, and one control step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from roboyard.kinematics.chain import ChainArrays, from_description
from roboyard.planning.attached import Attached, attached_body
from roboyard.planning.robot_planner import RobotPlanner, model_of, planner_for
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.skills.gripper_frame import GripperFrame, gripper_frame
from roboyard.skills.outcome import SkillError
from roboyard.transforms import Array, inverse_pose, pose_matrix

POSITION = {
    "name": "JointController",
    "motor_type": "position",
    "use_delta_commands": False,
    "command_output_limits": None,
}
"""Keys of the controllers of arms and trunk."""
NEAR = 0.015
"""Distance of spheres at which a held body counts as touching a link that it is held near (m)."""
NO_SLIP = 5
"""Iterations that remove slip while something is held; without them a mug turned by 0.7 rad a minute."""
GRIP_SECONDS = 0.8
"""Time that a gripper gets to open or close (s)."""


class Worker:
    """Moves a robot by its own controllers: joint positions of arms and trunk, velocities of the base."""

    def __init__(self, robot: Robot, watch: Callable[[], None] | None = None) -> None:
        """Take over a robot's controllers; `watch` is called after every control step."""
        self.robot, self.world = robot, robot.world
        self.watch = watch or (lambda: None)
        self.held: dict[str, Attached] = {}
        """Arm to the body that it holds."""
        self.arm_names: tuple[str, ...] = () if robot.manipulation is None else robot.manipulation.arm_names
        keys: dict[str, Any] = {
            name: POSITION for name in robot.groups if name == "trunk" or name.startswith("arm_")
        }
        if self.base_joints:
            keys["base"] = "HolonomicBaseJointController"
        robot.reload_controllers(keys, action_normalize=False)
        self._index = {name: k for k, name in enumerate(robot.joint_names)}
        self._goals: dict[str, Array] = {}
        self._slip_before = int(robot.world.model.opt.noslip_iterations)

    # ------------------------------------------------------------------------------------------- joints

    @cached_property
    def base_joints(self) -> tuple[str, ...]:
        """Virtual joints x, y, rz of a holonomic base; empty without one."""
        if self.robot.definition.holonomic_base is None:
            return ()
        return (VIRTUAL_JOINTS[0], VIRTUAL_JOINTS[1], VIRTUAL_JOINTS[5])

    @cached_property
    def trunk_joints(self) -> tuple[str, ...]:
        """Joints of the trunk; empty without one."""
        return () if self.robot.trunk is None else tuple(self.robot.trunk.joint_names)

    def arm_joints(self, arm: str) -> tuple[str, ...]:
        """Return the joints of an arm."""
        return self.robot.arms[arm].joint_names

    def positions(self, names: Sequence[str]) -> Array:
        """Return the present positions (n,) of named joints (rad or m)."""
        return self.robot.joint_positions[[self._index[name] for name in names]]

    def state(self) -> dict[str, float]:
        """Return the present position of every joint (rad or m)."""
        return dict(zip(self.robot.joint_names, self.robot.joint_positions.tolist(), strict=True))

    @cached_property
    def root(self) -> Array:
        """(4, 4) pose of the root link, which base joints move the robot from (m)."""
        return pose_matrix(*self.robot.links[0].pose)

    def base_matrix(self, base: Array) -> Array:
        """Return (..., 4, 4) motions of the robot in its root frame for base joints (..., 3)."""
        out = np.zeros((*base.shape[:-1], 4, 4))
        c, s = np.cos(base[..., 2]), np.sin(base[..., 2])
        out[..., 0, 0], out[..., 0, 1], out[..., 1, 0], out[..., 1, 1] = c, -s, s, c
        out[..., 2, 2] = out[..., 3, 3] = 1.0
        out[..., :2, 3] = base[..., :2]
        return out

    @property
    def base(self) -> Array:
        """(3,) base joints x, y, yaw (m, rad); zero for a robot that does not drive."""
        return self.positions(self.base_joints) if self.base_joints else np.zeros(3)

    def base_at(self, x: float, y: float, yaw: float) -> Array:
        """Return the (3,) base joints for a pose in the world frame (m, rad), its turn nearest to now."""
        return self.bases_at(np.array([x, y]), np.array(yaw))

    def bases_at(self, spots: Array, yaws: Array) -> Array:
        """Return the (..., 3) base joints for poses in the world frame, their turns nearest to now.

        Args:
            spots: (..., 2) places (m).
            yaws: (...) turns (rad).
        """
        rotation, position = self.root[:3, :3], self.root[:3, 3]
        now = float(self.base[2])
        turn = yaws - float(np.arctan2(rotation[1, 0], rotation[0, 0])) - now
        out = np.empty((*spots.shape[:-1], 3))
        out[..., :2] = (spots - position[:2]) @ rotation[:2, :2]
        out[..., 2] = now + np.arctan2(np.sin(turn), np.cos(turn))
        return out

    # ---------------------------------------------------------------------------------- arms and grippers

    def gripper(self, arm: str) -> GripperFrame:
        """Return the frame of an arm's gripper, worked out once, for which it opens."""
        if arm not in self._frames:
            if arm not in self.held and f"gripper_{arm}" in self.robot.groups:
                self.grip(arm, close=False)
            self._frames[arm] = gripper_frame(self.robot, arm)
        return self._frames[arm]

    @cached_property
    def _frames(self) -> dict[str, GripperFrame]:
        return {}

    def grip_pose(self, arm: str) -> Array:
        """Return the (4, 4) present pose of a gripper frame in the world frame (m)."""
        return pose_matrix(*self.robot.arms[arm].pose) @ self.gripper(arm).offset

    def mount(self, arm: str) -> str:
        """Return the link that an arm is mounted on."""
        return self.robot.description.joint_by_name[self.arm_joints(arm)[0]].parent

    def arm_chain(self, arm: str) -> ChainArrays:
        """Return the kinematics of an arm from its mount to its end effector."""
        if arm not in self._chains:
            tool = self.robot.arms[arm].end_effector.name
            self._chains[arm] = from_description(self.robot.description, tool, self.mount(arm))
        return self._chains[arm]

    @cached_property
    def _chains(self) -> dict[str, ChainArrays]:
        return {}

    def free_arms(self) -> list[str]:
        """Return the arms that hold nothing.

        Raises:
            SkillError: there is none.
        """
        found = [arm for arm in self.arm_names if arm not in self.held]
        if not found:
            names = ", ".join(f'"{one.body.name}"' for one in self.held.values()) or "nothing, it has no arm"
            raise SkillError(f"no arm is free: the robot holds {names}; place something first")
        return found

    def planner(
        self, arm: str | None, *, torso: bool = False, base: bool = False, room: float = 0.0, **options: Any
    ) -> RobotPlanner:
        """Return a planner of the present moment, with what the robot holds, which keeps `room` (m) where it
        can.
        """
        held = list(self.held.values())
        torso = torso and bool(self.trunk_joints)
        base = base and bool(self.base_joints)
        made = planner_for(self.robot, arm, torso=torso, base=base, held=held, **options)
        made.model = replace(made.model, buffer=made.model.buffer + room)
        return made

    def take(self, arm: str, body: Body) -> None:
        """Note that an arm holds a body from now on."""
        gripper = self.gripper(arm)
        near = {*gripper.fingers, self.palm(arm)}
        one = attached_body(self.robot, body, gripper.tool, sorted(near))
        near |= self._overlapped(one)  # spheres are larger than the shapes, and nothing touches here
        self.held[arm] = replace(one, touching=frozenset((*near, gripper.tool)))
        self._stop_creeping(True)

    def release(self, arm: str) -> None:
        """Note that an arm holds nothing any more."""
        self.held.pop(arm, None)
        self._stop_creeping(bool(self.held))

    def _stop_creeping(self, is_holding: bool) -> None:
        """While something is held, correct the slow slip that MuJoCo's soft friction leaves."""
        world: Any = self.world
        for option in (world.spec.option, world.model.opt):
            option.noslip_iterations = NO_SLIP if is_holding else self._slip_before

    def _overlapped(self, one: Attached) -> set[str]:
        """Return the links whose spheres overlap those of a held body as it is held now."""
        links = self.robot.body.links
        into = inverse_pose(pose_matrix(*self.robot.link(one.link).pose))
        own = np.array([(*s.center, s.radius) for s in one.spheres])
        found = set()
        for link in links:
            spheres = model_of(self.robot).spheres.get(link.name, ())
            if not spheres:
                continue
            place = into @ pose_matrix(*link.pose)
            other = np.array([(*s.center, s.radius) for s in spheres])
            centers = other[:, :3] @ place[:3, :3].T + place[:3, 3]
            gaps = np.linalg.norm(own[:, None, :3] - centers, axis=2) - own[:, None, 3] - other[:, 3]
            if gaps.min() < NEAR:
                found.add(link.name)
        return found

    def palm(self, arm: str) -> str:
        """Return the link that an arm's last joint moves."""
        return self.robot.description.joint_by_name[self.arm_joints(arm)[-1]].child

    # ------------------------------------------------------------------------------------------ control

    def step(self, commands: Mapping[str, Array]) -> None:
        """Run one control step with commands (n,); groups without one keep their goals, a base stops."""
        given = dict(commands)
        if self.base_joints:
            given.setdefault("base", np.zeros(3))
        self.robot.apply_action(given)
        self.world.step(self.robot.steps_per_control)
        self.watch()

    def joint_commands(self, goals: Mapping[str, float]) -> dict[str, Array]:
        """Return commands (n,) of arms and trunk for joint goals by name (rad or m)."""
        commands: dict[str, Array] = {}
        for name, group in self.robot.groups.items():
            if name.startswith("base") or not set(goals) & set(group.joints):
                continue
            old = self._goals.get(name, self.positions(group.joints))
            new = np.array([goals.get(j, float(old[k])) for k, j in enumerate(group.joints)])
            self._goals[name] = commands[name] = new
        return commands

    def wait(self, seconds: float) -> None:
        """Hold still for `seconds` (s)."""
        end = self.world.time + seconds
        while self.world.time < end:
            self.step({})

    def grip(self, arm: str, *, close: bool, seconds: float = GRIP_SECONDS) -> None:
        """Close or open a gripper for `seconds` (s)."""
        end = self.world.time + seconds
        command = {f"gripper_{arm}": np.array([-1.0 if close else 1.0])}
        while self.world.time < end:
            self.step(command)

    def touched(self) -> list[str]:
        """Return the names of bodies that the robot touches, without floors and what it holds."""
        own = {self.robot.body, *(one.body for one in self.held.values())}
        found = {
            contact.body_b.name
            for contact in self.world.contacts(self.robot.body)
            if contact.body_b not in own and contact.link_a.name not in self.standing
        }
        return sorted(found)

    def step_back(self, seconds: float = 0.8) -> None:
        """Drive slowly away from what the robot touches, if it does and can."""
        if not self.base_joints or not self.touched():
            return
        end = self.world.time + seconds
        own = {self.robot.body, *(one.body for one in self.held.values())}
        while self.world.time < end:
            away = np.zeros(3)
            for contact in self.world.contacts(self.robot.body):
                if contact.body_b not in own and contact.link_a.name not in self.standing:
                    away -= contact.normal
            x, y, yaw = *(self.root[:3, :3].T @ away)[:2], self.base[2]
            length = float(np.hypot(x, y))
            if length < 1e-6:
                break
            c, s = np.cos(yaw), np.sin(yaw)
            speed = 0.08 / length
            self.step({"base": np.array([speed * (c * x + s * y), speed * (c * y - s * x), 0.0])})

    @cached_property
    def standing(self) -> tuple[str, ...]:
        """Links that stand on the floor."""
        locomotion = self.robot.locomotion
        return () if locomotion is None else tuple(link.name for link in locomotion.floor_touching_links)


def wrapped(angle: float) -> float:
    """Return an angle between -π and π (rad)."""
    return float(np.arctan2(np.sin(angle), np.cos(angle)))
