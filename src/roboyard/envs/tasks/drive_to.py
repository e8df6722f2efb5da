"""DriveTo: a robot drives or walks to a point on the floor, around obstacles."""

from __future__ import annotations

import numpy as np

from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.robots import base_action, place_robot
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array

NEAR = 0.15
"""Distance within which the goal is reached (m)."""
POST = 0.12
"""Radius of an obstacle (m)."""


def drive_to(
    *,
    robot: str = "rover",
    distance: tuple[float, float] = (1.0, 2.5),
    obstacles: int = 3,
    limit: int = 200,
    near: float = NEAR,
    randomize: tuple[Randomization, ...] = (),
) -> Task:
    """Return the task of driving to a point, with posts in the way.

    Args:
        robot: registered or bundled name, or a file, of a robot with a base that moves.
        distance: range of the goal's distance from the start (m).
        obstacles: number of posts; each stands elsewhere in each episode.
        limit: control steps of an episode.
        near: distance within which the goal is reached, which ends the episode (m).
        randomize: what differs from episode to episode.
    """
    names = [f"post{k}" for k in range(obstacles)]
    radius = [0.3]

    def build(world: World) -> dict[str, Robot | Body]:
        world.add_plane()
        added = place_robot(world, robot)
        low, high = added.body.bounds
        radius[0] = float(np.hypot(*(high - low)[:2]) / 2)
        posts = {
            name: world.add_cylinder(POST, 0.6, (50.0 + k, 50.0, 0.3), mass=40.0, rgba=(0.9, 0.5, 0.2, 1.0))
            for k, name in enumerate(names)
        }
        return {"robot": added, **posts}

    def start(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        angle, far = random.uniform(-np.pi, np.pi), random.uniform(*distance)
        env["goal"][rows] = far[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        env.robot.set_base(rows, np.zeros(len(rows)), np.zeros(len(rows)), random.uniform(-np.pi, np.pi))
        for k, name in enumerate(names):
            # beside the way, clear of the robot and of the goal
            share = random.uniform(0.35, 0.75)
            aside = random.uniform(-0.7, 0.7)
            place = share[:, None] * env["goal"][rows]
            across = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
            place = place + aside[:, None] * across
            clear = radius[0] + POST + 0.15
            length = np.linalg.norm(place, axis=1, keepdims=True)
            place = place * np.maximum(clear / np.maximum(length, 1e-9), 1.0)
            place = place + k * 1e-3
            env.body(name).set_pose(rows, np.concatenate([place, np.full((len(rows), 1), 0.3)], axis=1))
            env["posts"][rows, 2 * k : 2 * k + 2] = place

    def local(env: EnvArrays, points: Array) -> Array:
        """(n, 2) points of the floor in the base's frame."""
        gap = points - env.robot.base.position[:, :2]
        return env.robot.base.to_local(np.concatenate([gap, np.zeros((env.n, 1))], axis=1))[:, :2]

    def away(env: EnvArrays) -> Array:
        return np.linalg.norm(env["goal"] - env.robot.base.position[:, :2], axis=1)

    def nearest_post(env: EnvArrays) -> Array:
        if not names:
            return np.full(env.n, np.inf)
        gaps = [
            np.linalg.norm(env.body(name).position[:, :2] - env.robot.base.position[:, :2], axis=1)
            for name in names
        ]
        return np.min(gaps, axis=0) - POST - radius[0]

    def progress(env: EnvArrays) -> Array:
        """(n,) metres nearer to the goal since the last action."""
        now, before = away(env), env["away"][:, 0].copy()
        env["away"][:, 0] = now
        return np.where(env.steps <= 1, 0.0, before - now)

    return Task(
        build=build,
        actions=base_action,
        buffers={"goal": 2, "away": 1, "posts": 2 * max(obstacles, 1)},
        observations={
            "proprio": {
                "velocity": lambda env: env.robot.base.to_local(env.robot.base.linear_velocity)[:, :2],
                "turning": lambda env: env.robot.base.angular_velocity[:, 2],
                "last": lambda env: env.action,
            },
            "state": {
                "goal": lambda env: local(env, env["goal"]),
                **{
                    name: (lambda env, name=name: local(env, env.body(name).position[:, :2]))
                    for name in names
                },
            },
        },
        rewards={
            "progress": Reward(function=progress, weight=2.0),
            "there": Reward(function=lambda env: away(env) < near, weight=5.0),
            "clear": Reward(function=lambda env: np.maximum(0.15 - nearest_post(env), 0.0), weight=-2.0),
            "effort": Reward(function=lambda env: (env.action**2).sum(axis=1), weight=-0.005),
        },
        success=lambda env: away(env) < near,
        terminations={"there": lambda env: away(env) < near},
        reset=[start],
        randomize=randomize,
        limit=limit,
        view=((0.0, -4.0, 4.0), (0.0, 0.0, 0.0)),
    )
