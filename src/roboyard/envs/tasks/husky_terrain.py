"""HuskyTerrain: a rover with four wheels drives to a point over the random steps of PyBullet's tutorial."""

from __future__ import annotations

import numpy as np

from roboyard.envs.actions import BaseTwist
from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.robots import place_robot
from roboyard.robots.robot import Robot
from roboyard.scenes.terrain_scene import Kind, terrain
from roboyard.sim.world import World
from roboyard.transforms import Array

NEAR = 0.5
"""Distance within which the goal is reached (m)."""
TILT = 0.3
"""Cosine of the tilt at which the rover has tipped over."""
AREA = 8.0
"""Half of the edge of the square in which rovers start (m)."""
PROBES = np.array([(x, y) for x in (0.4, 0.8, 1.2) for y in (-0.4, 0.0, 0.4)])
"""Points of the ground ahead whose heights are observed, in the rover's frame (m)."""


def husky_terrain(
    *,
    robot: str = "husky",
    kind: Kind = "steps",
    height: float = 0.2,
    distance: tuple[float, float] = (2.0, 5.0),
    limit: int = 400,
    randomize: tuple[Randomization, ...] = (),
) -> Task:
    """Return the task of driving over uneven ground.

    Args:
        robot: registered or bundled name, or a file, of a robot on wheels.
        kind: "steps" (the tutorial's) or "smooth" hills.
        height: largest height difference of the ground (m).
        distance: range of the goal's distance from the start (m).
        limit: control steps of an episode.
        randomize: what differs from episode to episode.
    """
    ground = _Ground()
    rest = [0.2]

    def build(world: World) -> Robot:
        nonlocal ground
        scene = terrain(world, kind=kind, height=height)
        ground = _Ground.of(scene.bodies["terrain"])
        added = place_robot(world, robot, (0.0, 0.0, 0.0), on_floor=False)
        low = added.body.bounds[0][2]
        rest[0] = float(added.position[2] - low)
        added.set_pose((0.0, 0.0, float(ground.highest(np.zeros((1, 2)), 0.7)[0]) + rest[0] + 0.02))
        return added

    def start(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        place = random.uniform(-AREA, AREA, 2)
        angle, far = random.uniform(-np.pi, np.pi), random.uniform(*distance)
        env["goal"][rows] = place + far[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        top = ground.highest(place, 0.7) + rest[0] + 0.02
        env.robot.set_pose(rows, np.concatenate([place, top[:, None]], axis=1), random.yaw_quaternion())

    def to_goal(env: EnvArrays) -> Array:
        gap = np.zeros((env.n, 3))
        gap[:, :2] = env["goal"] - env.robot.base.position[:, :2]
        return gap

    def away(env: EnvArrays) -> Array:
        return np.linalg.norm(to_goal(env), axis=1)

    def probes(env: EnvArrays) -> Array:
        """(n, 9) heights of the ground ahead, relative to the rover (m)."""
        base = env.robot.base
        x, y, z, w = np.moveaxis(base.quaternion, -1, 0)
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))[:, None]
        c, s = np.cos(yaw), np.sin(yaw)
        ahead = base.position[:, None, :2] + np.stack(
            [c * PROBES[:, 0] - s * PROBES[:, 1], s * PROBES[:, 0] + c * PROBES[:, 1]], axis=-1
        )
        return ground.at(ahead) - (base.position[:, 2:3] - rest[0])

    def progress(env: EnvArrays) -> Array:
        now, before = away(env), env["away"][:, 0].copy()
        env["away"][:, 0] = now
        return np.where(env.steps <= 1, 0.0, before - now)

    def tipped(env: EnvArrays) -> np.ndarray:
        return -env.robot.gravity_in_base()[:, 2] < TILT

    return Task(
        build=build,
        actions={"base": BaseTwist(speed=1.0, turn=1.5)},
        buffers={"goal": 2, "away": 1},
        observations={
            "proprio": {
                "gravity": lambda env: env.robot.gravity_in_base(),
                "velocity": lambda env: env.robot.base.to_local(env.robot.base.linear_velocity),
                "turning": lambda env: env.robot.base.to_local(env.robot.base.angular_velocity),
                "last": lambda env: env.action,
            },
            "state": {
                "goal": lambda env: env.robot.base.to_local(to_goal(env))[:, :2],
                "ground": probes,
            },
        },
        rewards={
            "progress": Reward(function=progress, weight=2.0),
            "there": Reward(function=lambda env: away(env) < NEAR, weight=5.0),
            "tipped": Reward(function=tipped, weight=-5.0),
            "effort": Reward(function=lambda env: (env.action**2).sum(axis=1), weight=-0.002),
        },
        success=lambda env: away(env) < NEAR,
        terminations={"there": lambda env: away(env) < NEAR, "tipped": tipped},
        reset=[start],
        randomize=randomize,
        limit=limit,
        view=((3.5, -3.5, 3.0), (0.0, 0.0, 0.2)),
    )


class _Ground:
    """Heights of a field of points."""

    def __init__(
        self, heights: Array | None = None, cell: tuple[float, float] = (1.0, 1.0), z: float = 0.0
    ) -> None:
        self._heights = np.zeros((2, 2)) if heights is None else heights
        self._cell = np.asarray(cell)
        self._z = z

    @classmethod
    def of(cls, body: object) -> _Ground:
        """Return the heights of a body that is a field of heights."""
        description = body.description  # type: ignore[attr-defined]
        geometry = description.links[0].collisions[0].geometry
        return cls(geometry.heights, geometry.cell, float(body.pose[0][2]))  # type: ignore[attr-defined]

    def at(self, points: Array) -> Array:
        """Return (...,) heights of the nearest grid points to (..., 2) places (m)."""
        size = np.array(self._heights.shape)
        index = np.rint(points / self._cell + (size - 1) / 2).astype(int)
        index = np.clip(index, 0, size - 1)
        return self._heights[index[..., 0], index[..., 1]] + self._z

    def highest(self, places: Array, radius: float) -> Array:
        """Return (k,) largest heights within a square around (k, 2) places (m)."""
        steps = np.arange(-radius, radius + 1e-9, float(self._cell.min()) / 2)
        x, y = np.meshgrid(steps, steps, indexing="ij")
        around = np.stack([x.ravel(), y.ravel()], axis=-1)
        return self.at(places[:, None] + around).max(axis=1)
