"""Push: the arm pushes a box on a table to a spot."""

from __future__ import annotations

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Friction, Mass, Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.robots import arm_actions, arm_name, place_robot
from roboyard.envs.tasks.table import Table, place_table, start_above
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array

SIZE = 0.06
"""Edge of the box (m)."""
NEAR = 0.04
"""Distance within which the box is at its spot (m)."""


def push(
    *,
    robot: str = "arm7",
    arm: str = "default",
    control: str = "tip",
    limit: int = 100,
    near: float = NEAR,
    randomize: tuple[Randomization, ...] = (Mass("box", (0.7, 1.4)), Friction("table", (0.4, 0.8))),
) -> Task:
    """Return the task of pushing a box to a spot.

    Args:
        robot: registered or bundled name, or a file, of a robot with an arm.
        arm: its name; the first by default.
        control: "tip", "pose" or "joints".
        limit: control steps of an episode.
        near: distance within which the box is at its spot (m).
        randomize: what differs from episode to episode.
    """
    table = Table()

    def build(world: World) -> dict[str, Robot | Body]:
        nonlocal table
        world.add_plane()
        added = place_robot(world, robot)
        name = arm_name(added, arm)
        table, top = place_table(world, added, name)
        start_above(added, name, table, height=0.08)
        box = world.add_box(
            (SIZE, SIZE, SIZE),
            table.at(0.0, 0.0, SIZE / 2),
            mass=0.2,
            rgba=(0.95, 0.6, 0.1, 1.0),
            friction=0.3,
        )
        return {"robot": added, "table": top, "box": box}

    def start(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        env.body("box").set_pose(
            rows, table.points(random.uniform(-0.5, 0.5, 2), SIZE / 2), random.yaw_quaternion()
        )
        env["goal"][rows] = table.points(random.uniform(-0.8, 0.8, 2), SIZE / 2)

    def to_goal(env: EnvArrays) -> Array:
        return env["goal"] - env.body("box").position

    def to_box(env: EnvArrays) -> Array:
        return env.body("box").position - env.robot.tip(arm).position

    def gap(env: EnvArrays) -> Array:
        return np.linalg.norm(to_goal(env)[:, :2], axis=1)

    return Task(
        build=build,
        actions=lambda added: arm_actions(added, arm_name(added, arm), control, holds=False),
        buffers={"goal": 3},
        observations={
            "proprio": {"q": lambda env: env.robot.q, "v": lambda env: 0.1 * env.robot.v},
            "state": {
                "to_box": lambda env: env.robot.base.to_local(to_box(env)),
                "to_goal": lambda env: env.robot.base.to_local(to_goal(env)),
                "box": lambda env: env.body("box").quaternion,
                "box_velocity": lambda env: env.body("box").linear_velocity,
            },
        },
        rewards={
            "near": Reward(function=lambda env: np.exp(-gap(env) / 0.1), weight=1.0),
            "touch": Reward(function=lambda env: np.linalg.norm(to_box(env), axis=1), weight=-0.5),
            "there": Reward(function=lambda env: gap(env) < near, weight=1.0),
            "effort": Reward(function=lambda env: (env.action**2).sum(axis=1), weight=-0.005),
        },
        success=lambda env: gap(env) < near,
        terminations={
            "fell": lambda env: env.body("box").position[:, 2] < table.height - 0.05,
        },
        reset=[start],
        randomize=randomize,
        limit=limit,
    )
