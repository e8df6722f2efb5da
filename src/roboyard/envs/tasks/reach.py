"""Reach: the end effector goes to a point and stays there."""

from __future__ import annotations

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import JointNoise, Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.reachable import reachable, ready_posture
from roboyard.envs.tasks.robots import arm_actions, arm_name, place_robot
from roboyard.robots.robot import Robot
from roboyard.sim.world import World
from roboyard.transforms import Array

NEAR = 0.02
"""Distance within which the goal is reached (m)."""
GOALS = 256
"""Points drawn when the task is built."""


def reach(
    *,
    robot: str = "arm7",
    arm: str = "default",
    control: str = "joints",
    limit: int = 60,
    near: float = NEAR,
    spread: float = 0.3,
    randomize: tuple[Randomization, ...] = (JointNoise(position=0.05),),
) -> Task:
    """Return the task of reaching points in the workspace of an arm.

    Args:
        robot: registered or bundled name, or a file.
        arm: its name; the first by default.
        control: "joints" for changes of joint positions, "tip" for changes of the end effector's position,
            "pose" for changes of its position and orientation.
        limit: control steps of an episode.
        near: distance within which the goal is reached (m).
        spread: part of each joint's range, around the start posture, in which goals are reached.
        randomize: what differs from episode to episode.
    """
    goals = np.zeros((0, 3))

    def build(world: World) -> Robot:
        nonlocal goals
        world.add_plane()
        added = place_robot(world, robot)
        name = arm_name(added, arm)
        ready = ready_posture(added, reachable(added, name, GOALS), name)
        added.joint_positions = ready
        goals = reachable(added, name, GOALS, share=spread, around=ready).tips
        return added

    def choose_goal(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        env["goal"][rows] = goals[random.integers(0, len(goals) - 1)]

    def to_goal(env: EnvArrays) -> Array:
        return env.robot.base.to_local(env["goal"] - env.robot.tip(arm).position)

    def distance(env: EnvArrays) -> Array:
        gap = env["goal"] - env.robot.tip(arm).position
        return np.sqrt((gap * gap).sum(axis=1))

    return Task(
        build=build,
        actions=lambda added: arm_actions(added, arm_name(added, arm), control, holds=False),
        buffers={"goal": 3},
        observations={
            "proprio": {"q": lambda env: env.robot.q, "v": lambda env: 0.1 * env.robot.v},
            "state": {"to_goal": to_goal},
        },
        rewards={
            "near": lambda env: np.exp(-env.once(distance) / 0.05),
            "far": Reward(function=lambda env: env.once(distance), weight=-1.0),
            "effort": Reward(function=lambda env: (env.action**2).sum(axis=1), weight=-0.005),
        },
        success=lambda env: env.once(distance) < near,
        reset=[choose_goal],
        randomize=randomize,
        limit=limit,
    )
