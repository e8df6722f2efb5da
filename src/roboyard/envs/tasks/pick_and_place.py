"""PickAndPlace: the gripper takes a cube from a table and holds it at a point above the table."""

from __future__ import annotations

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Mass, Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.robots import arm_actions, arm_name, place_robot
from roboyard.envs.tasks.table import Table, place_table, start_above
from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array

SIZE = 0.04
"""Edge of the cube (m)."""
NEAR = 0.03
"""Distance within which the cube is at its goal (m)."""


def pick_and_place(
    *,
    robot: str = "r1",
    arm: str = "default",
    control: str = "tip",
    limit: int = 150,
    near: float = NEAR,
    randomize: tuple[Randomization, ...] = (Mass("cube", (0.7, 1.4)),),
) -> Task:
    """Return the task of carrying a cube to a point above a table.

    Args:
        robot: registered or bundled name, or a file, of a robot with a gripper.
        arm: its name; the first by default.
        control: "tip", "pose" or "joints".
        limit: control steps of an episode.
        near: distance within which the cube is at its goal (m).
        randomize: what differs from episode to episode.

    Raises:
        ConfigError: the arm has no gripper, when the task is set up.
    """
    table = Table()

    def build(world: World) -> dict[str, Robot | Body]:
        nonlocal table
        world.add_plane()
        added = place_robot(world, robot)
        name = arm_name(added, arm)
        if f"gripper_{name}" not in added.groups:
            raise ConfigError(
                f"arm {name!r} of robot {robot!r} has no gripper; choose one that has, such as 'r1'"
            )
        table, top = place_table(world, added, name, points=True)
        start_above(added, name, table, height=0.15)
        cube = world.add_box(
            (SIZE, SIZE, SIZE),
            table.at(0.0, 0.0, SIZE / 2),
            mass=0.1,
            rgba=(0.9, 0.3, 0.2, 1.0),
            friction=1.0,
        )
        return {"robot": added, "table": top, "cube": cube}

    def start(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        env.body("cube").set_pose(
            rows, table.points(random.uniform(-0.6, 0.6, 2), SIZE / 2), random.yaw_quaternion(-0.3, 0.3)
        )
        goal = table.points(random.uniform(-0.6, 0.6, 2), 0.0)
        goal[:, 2] += random.uniform(0.06, 0.2)
        env["goal"][rows] = goal

    def to_cube(env: EnvArrays) -> Array:
        return env.body("cube").position - env.robot.tip(arm).position

    def to_goal(env: EnvArrays) -> Array:
        return env["goal"] - env.body("cube").position

    def length(vectors: Array) -> Array:
        return np.sqrt((vectors * vectors).sum(axis=1))

    def lift(env: EnvArrays) -> Array:
        """(n,) height of the cube above the table (m), up to that of the goal."""
        height = env.body("cube").position[:, 2] - table.height - SIZE / 2
        return np.clip(height, 0.0, 0.05)

    return Task(
        build=build,
        actions=lambda added: arm_actions(added, arm_name(added, arm), control, gripper=True),
        buffers={"goal": 3},
        observations={
            "proprio": {"q": lambda env: env.robot.q, "v": lambda env: 0.1 * env.robot.v},
            "state": {
                "to_cube": lambda env: env.robot.base.to_local(to_cube(env)),
                "to_goal": lambda env: env.robot.base.to_local(to_goal(env)),
                "cube": lambda env: env.body("cube").quaternion,
                "cube_velocity": lambda env: env.body("cube").linear_velocity,
            },
        },
        rewards={
            "reach": Reward(function=lambda env: np.exp(-length(to_cube(env)) / 0.1), weight=0.5),
            "lift": Reward(function=lift, weight=20.0),
            "carry": Reward(
                function=lambda env: (lift(env) > 0.02) * np.exp(-length(to_goal(env)) / 0.15), weight=2.0
            ),
            "there": Reward(function=lambda env: length(to_goal(env)) < near, weight=2.0),
            "effort": Reward(function=lambda env: (env.action**2).sum(axis=1), weight=-0.005),
        },
        success=lambda env: length(to_goal(env)) < near,
        terminations={"fell": lambda env: env.body("cube").position[:, 2] < table.height - 0.05},
        reset=[start],
        randomize=randomize,
        limit=limit,
    )
