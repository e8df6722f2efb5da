"""The planner of a live robot: from where it is, among what is around it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.errors import ConfigError, unknown_name
from roboyard.planning.attached import Attached, with_attached
from roboyard.planning.depth_cloud import depth_obstacle
from roboyard.planning.goals import Goal, PoseGoal, PosesGoal, PostureSolution
from roboyard.planning.hull_judge import HullJudge
from roboyard.planning.live_world import WorldObstacles
from roboyard.planning.obstacles import Obstacle, Obstacles
from roboyard.planning.planner import Planner
from roboyard.planning.planner_files import load_planner_file
from roboyard.planning.spheres.link_fit import covering_model, fitted_model
from roboyard.planning.spheres.sphere_model import SphereModel, sphere_robot
from roboyard.planning.trajectory import Plan
from roboyard.transforms import pose_matrix

if TYPE_CHECKING:
    from roboyard.description import RobotDescription
    from roboyard.rendering.camera import Camera
    from roboyard.robots.robot_body import RobotBody
    from roboyard.sim.body import Body


class RobotPlanner:
    """Plans for a group of a robot's joints in its world; made by `planner_for`."""

    def __init__(
        self,
        robot: RobotBody,
        joints: Sequence[str],
        model: SphereModel,
        ignored: Iterable[Body] = (),
        held: Sequence[Attached] = (),
    ) -> None:
        """Create a planner for named joints of a robot; `ignored` bodies are no obstacles, `held` ones move
        with the robot.
        """
        self.robot, self.model = robot, with_attached(model, held)
        self.held = tuple(held)
        """Bodies that the robot holds."""
        self.joint_names = tuple(joints)
        """(n) planned joints, in the order of all vectors."""
        self.surroundings = WorldObstacles(robot.world, robot.body, (*ignored, *(one.body for one in held)))
        """The world's obstacles."""
        self.seen: Obstacle | None = None
        """Obstacle of the last depth picture, in place of the world's obstacles; None to use those again."""

    @property
    def tool(self) -> str:
        """End-effector link of the first planned arm, else the base link."""
        manipulation = self.robot.manipulation
        if manipulation is not None:
            for arm in manipulation.arm_names:
                if set(manipulation.block.arm_joint_names[arm]) & set(self.joint_names):
                    return manipulation.block.eef_link_names[arm]
        return self.robot.base_link.name

    def planner(self) -> Planner:
        """Return a planner of the present moment: joints outside the group held, obstacles where they are."""
        state = dict(zip(self.robot.joint_names, self.robot.joint_positions.tolist(), strict=True))
        obstacles = self.surroundings.update() if self.seen is None else self._seen_obstacles()
        limits = self.robot.limits
        rows = [self.robot.joint_names.index(name) for name in self.joint_names]
        held = {name: value for name, value in state.items() if name not in self.joint_names}
        planner = Planner(
            self.model, self.joint_names, obstacles, held=held, velocity=limits.velocity[rows], around=state
        )
        if self.seen is not None:
            return planner
        held = {one.body: one for one in self.held}
        ignored = [body for body in self.surroundings.ignored if body not in held]
        judge = HullJudge(self.robot.world, self.robot.body, planner.robot, ignored, self.held)
        judge.allow(self._floor_links())
        planner.use_judge(judge)
        return planner

    def see(self, depth: ArrayLike, camera: Camera, *, cell: float = 0.02) -> Obstacle:
        """Use a depth picture's points in place of the world's bodies from now on, without the robot's own.

        Args:
            depth: (height, width) distances along the camera's axis (m), taken in the present posture.
            camera: that took the picture.
            cell: edge of the cells that points are sorted into (m).

        Raises:
            ConfigError: the picture has another size than the camera, or shows nothing but the robot.
        """
        state = dict(zip(self.robot.joint_names, self.robot.joint_positions.tolist(), strict=True))
        held = {name: value for name, value in state.items() if name not in self.joint_names}
        robot = sphere_robot(self.model, self.joint_names, held)
        q = [state[name] for name in robot.joint_names]
        root = pose_matrix(*self.robot.body.links[0].pose)
        self.seen = depth_obstacle(depth, camera, robot, q, root, cell=cell)
        return self.seen

    def _seen_obstacles(self) -> Obstacles:
        assert self.seen is not None
        return Obstacles([self.seen], pose_matrix(*self.robot.body.links[0].pose))

    def _floor_links(self) -> tuple[str, ...]:
        return (
            ()
            if self.robot.locomotion is None
            else tuple(link.name for link in self.robot.locomotion.floor_touching_links)
        )

    def start(self) -> Any:
        """Return the (n,) present positions of the group (rad or m)."""
        index = [self.robot.joint_names.index(name) for name in self.joint_names]
        return self.robot.joint_positions[index]

    def plan(self, goal: Goal | Sequence[Goal], **options: Any) -> Plan:
        """Return a motion from where the robot is now; see `Planner.plan` for goals and options."""
        planner = self.planner()
        return planner.plan(_inside(self.start(), planner), goal, **options)

    def ik(self, goal: PoseGoal | PosesGoal, **options: Any) -> list[PostureSolution]:
        """Return all distinct postures found for a pose or several links' poses; see `Planner.ik`."""
        return self.planner().ik(goal, self.start(), **options)


def planner_for(
    robot: RobotBody,
    arm: str | None = None,
    *,
    torso: bool = False,
    base: bool = False,
    joints: Sequence[str] | None = None,
    ignored: Iterable[Body] = (),
    held: Sequence[Attached] = (),
) -> RobotPlanner:
    """Return a planner for a group of a robot's joints, in the robot's world.

    Spheres come from the robot's cuRobo file where its package has one; spheres that are fitted and cached
    fill what it leaves open.

    Args:
        robot: a robot in a world.
        arm: name of an arm, or "both" for all arms; by default the first, or none with `base`.
        torso: also the joints of the trunk.
        base: also the joints of a holonomic base; with `arm="both"` and `torso` this is the whole body.
        joints: names of joints instead of a group.
        ignored: bodies that are no obstacles, such as one that is about to be grasped.
        held: bodies that the robot holds, see `attached_body`; they move with it.

    Raises:
        ConfigError: the robot has no such arm, trunk, base or joint.
    """
    names = list(joints) if joints is not None else _group(robot, arm, torso, base)
    for name in names:
        if name not in robot.joint_names:
            raise ConfigError(f"robot {robot.name!r}: {unknown_name('joint', name, robot.joint_names)}")
    return RobotPlanner(robot, names, model_of(robot), ignored, held)


def _group(robot: RobotBody, arm: str | None, torso: bool, base: bool) -> list[str]:
    names: list[str] = []
    if base:
        virtual = [f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz")]
        if not set(virtual) <= set(robot.joint_names):
            raise ConfigError(f"robot {robot.name!r} has no holonomic base; omit base=True")
        names += virtual
    if torso:
        if robot.trunk is None:
            raise ConfigError(f"robot {robot.name!r} has no trunk; omit torso=True")
        names += robot.trunk.joint_names
    manipulation = robot.manipulation
    if arm is None and base:
        return names
    if manipulation is None:
        if arm is not None:
            raise ConfigError(f"robot {robot.name!r} has no arm {arm!r}; name its joints with joints=")
        return names or list(robot.joint_names)
    chosen = manipulation.arm_names if arm == "both" else (arm or manipulation.default_arm,)
    for one in chosen:
        if one not in manipulation.arm_names:
            raise ConfigError(f"robot {robot.name!r}: {unknown_name('arm', one, manipulation.arm_names)}")
        names += manipulation.block.arm_joint_names[one]
    return names


def model_of(robot: RobotBody) -> SphereModel:
    """Return a robot's spheres and pairs, of its package's cuRobo file where it has one.

    Spheres fitted to its shapes complete them.
    """
    from roboyard.robots.registry import REGISTERED_ROBOTS  # loads MuJoCo, which plans from files do not need

    registered = REGISTERED_ROBOTS.get(robot.model)
    if registered is not None and robot.body.scale == 1.0:
        file = registered.folder / "curobo" / f"{registered.name}.yml"
        if file.is_file():
            return _model_of_file(file, robot.description)
    return fitted_model(robot.description)


def _model_of_file(file: Path, description: RobotDescription) -> SphereModel:
    """Return a planner file's robot, completed; it stays known while file and description are the same."""
    now = file.stat()
    stamp = file, now.st_mtime_ns, now.st_size
    for known, of, model in tuple(_models):
        if of is description and known == stamp:
            return model
    model = covering_model(load_planner_file(file, description))
    _models.append((stamp, description, model))
    return model


_models: deque[tuple[tuple[Path, int, int], RobotDescription, SphereModel]] = deque(maxlen=8)
"""File with time and size, description, and what came of them, of the latest robots."""


def _inside(q: ArrayLike, planner: Planner) -> Any:
    """Return q (n,) moved into the limits where drives let it rest up to 0.01 rad outside."""
    lower, upper = planner.bounds
    values = np.asarray(q, dtype=float)
    near = np.clip(values, lower, upper)
    return np.where(np.abs(near - values) < 0.01, near, values)
