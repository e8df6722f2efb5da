"""Locomotion: a legged robot walks along a line at a commanded speed.

Feet follow the phases of a trot: diagonal pairs swing in turn, twice a second. Observations include the
clock. Only feet touch the floor; an episode ends where the base tilts or sinks.
"""

from __future__ import annotations

import numpy as np

from roboyard.envs.actions import JointTarget
from roboyard.envs.env_arrays import EnvArrays
from roboyard.envs.random_rows import RandomRows, Rows
from roboyard.envs.randomization import Friction, JointNoise, Randomization
from roboyard.envs.task import Reward, Task
from roboyard.envs.tasks.robots import place_robot
from roboyard.errors import ConfigError
from roboyard.robots.robot import Robot
from roboyard.sim.body import Body
from roboyard.sim.world import World
from roboyard.transforms import Array

TROT = 2.0
"""Steps of a foot (Hz)."""
LIFT = 0.06
"""Height to which a swinging foot should rise, as a share of the base's height times 3 (m)."""
TILT = 0.7
"""Cosine of the tilt at which the robot has fallen."""
SUNK = 0.6
"""Height of the base below which the robot has fallen, as a share of its standing height."""


def locomotion(
    *,
    robot: str = "walker",
    speed: tuple[float, float] = (0.5, 0.5),
    scale: float = 0.4,
    limit: int = 500,
    randomize: tuple[Randomization, ...] = (
        JointNoise(position=0.05),
        Friction("floor", (0.7, 1.2)),
    ),
) -> Task:
    """Return the task of walking along the x axis.

    Args:
        robot: registered name or file of a robot with legs.
        speed: range of the commanded speeds (m/s).
        scale: largest change of a joint's target from the standing posture (rad).
        limit: control steps of an episode; 50 a second.
        randomize: what differs from episode to episode.

    Raises:
        ConfigError: the robot has no legs, when the task is set up.
    """
    feet: list[str] = []
    offsets = np.zeros(0)
    stand = [0.3]

    def build(world: World) -> dict[str, Robot | Body]:
        nonlocal feet, offsets
        floor = world.add_plane()
        added = place_robot(world, robot, self_collision=False)
        feet = feet_of(added)
        offsets = trot_offsets(added, feet)
        for link in added.links:
            if link.name not in feet:
                world.filters.set(link, floor.links[0], collide=False)
        world.step(120)
        stand[0] = float(added.position[2])
        added.reset()
        return {"robot": added, "floor": floor}

    def phase(env: EnvArrays) -> Array:
        """(n, feet) phase of each foot's swing, 0 to 2 pi."""
        return (2.0 * np.pi * TROT * env.time + env["phase"][:, 0])[:, None] + offsets

    def start(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        env["command"][rows, 0] = random.uniform(*speed)
        env["phase"][rows, 0] = random.uniform(0.0, 2.0 * np.pi)
        env.robot.set_base(rows, np.zeros(len(rows)), np.zeros(len(rows)), random.uniform(-0.3, 0.3))

    def heading(env: EnvArrays) -> Array:
        x, y, z, w = env.robot.base.quaternion.T
        return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    def wanted(env: EnvArrays) -> Array:
        """(n, 3) velocity ahead and to the left (m/s) and turning rate (rad/s) that lead along the line."""
        yaw = heading(env)
        aside = np.clip(-0.8 * env.robot.base.position[:, 1], -0.2, 0.2)
        forward = env["command"][:, 0]
        left = -np.sin(yaw) * forward + np.cos(yaw) * aside
        ahead = np.cos(yaw) * forward + np.sin(yaw) * aside
        return np.stack([ahead, np.clip(left, -0.3, 0.3), np.clip(-1.5 * yaw, -0.6, 0.6)], axis=1)

    def velocity(env: EnvArrays) -> Array:
        return env.robot.base.to_local(env.robot.base.linear_velocity)

    def turning(env: EnvArrays) -> Array:
        return env.robot.base.to_local(env.robot.base.angular_velocity)

    def speed_error(env: EnvArrays) -> Array:
        gap = env.once(velocity)[:, :2] - env.once(wanted)[:, :2]
        return (gap * gap).sum(axis=1)

    def near_speed(env: EnvArrays) -> Array:
        """(n,) how near the velocity is to the wanted one, 0 to 1: a wide slope leads there from rest."""
        error = env.once(speed_error)
        return 0.5 * (np.exp(-error / 0.06) + np.exp(-error / 0.25))

    def turn_error(env: EnvArrays) -> Array:
        return (env.once(turning)[:, 2] - env.once(wanted)[:, 2]) ** 2

    def foot_heights(env: EnvArrays) -> Array:
        return np.stack([env.robot.link(name).position[:, 2] for name in feet], axis=1)

    def gait(env: EnvArrays) -> Array:
        """(n,) how well the heights of the feet follow the clock, 0 to 1."""
        rise = stand[0] * 3.0 * LIFT * np.maximum(np.sin(env.once(phase)), 0.0)
        ground = env["ground"][:, :1]
        gap = foot_heights(env) - ground - rise
        return np.exp(-((gap / 0.03) ** 2)).mean(axis=1)

    def note_ground(env: EnvArrays, rows: Rows, random: RandomRows) -> None:
        env.physics.forward(rows)
        env["ground"][rows, 0] = foot_heights(env)[rows].min(axis=1)

    def down(env: EnvArrays) -> Array:
        return env.robot.gravity_in_base()

    def tilt(env: EnvArrays) -> Array:
        return (env.once(down)[:, :2] ** 2).sum(axis=1)

    def fallen(env: EnvArrays) -> np.ndarray:
        low = env.robot.base.position[:, 2] < SUNK * stand[0]
        return low | (-env.once(down)[:, 2] < TILT)

    return Task(
        build=build,
        actions=lambda added: {"base": JointTarget(scale)},
        buffers={"command": 1, "phase": 1, "ground": 1},
        observations={
            "proprio": {
                "gravity": lambda env: env.once(down),
                "velocity": lambda env: env.once(velocity),
                "turning": lambda env: 0.3 * env.once(turning),
                "q": lambda env: env.robot.q - env.robot.rest,
                "v": lambda env: 0.1 * env.robot.v,
                "last": lambda env: env.action,
            },
            "state": {
                "wanted": lambda env: env.once(wanted),
                "clock": lambda env: np.concatenate(
                    [np.sin(env.once(phase)), np.cos(env.once(phase))], axis=1
                ),
            },
        },
        rewards={
            "speed": Reward(function=near_speed, weight=1.0),
            "turn": Reward(function=lambda env: np.exp(-turn_error(env) / 0.15), weight=0.4),
            "gait": Reward(function=gait, weight=0.5),
            "level": Reward(function=tilt, weight=-2.0),
            "bounce": Reward(function=lambda env: env.once(velocity)[:, 2] ** 2, weight=-0.5),
            "rolling": Reward(function=lambda env: (env.once(turning)[:, :2] ** 2).sum(axis=1), weight=-0.02),
            "jerk": Reward(
                function=lambda env: ((env.action - env.last_action) ** 2).sum(axis=1), weight=-0.01
            ),
            "height": Reward(
                function=lambda env: (env.robot.base.position[:, 2] - stand[0]) ** 2, weight=-10.0
            ),
        },
        reward_floor=0.0,
        success=lambda env: env.once(speed_error) < 0.04,
        terminations={"fallen": fallen},
        reset=[start, note_ground],
        randomize=randomize,
        limit=limit,
        control_freq=50.0,
        timestep=1 / 200,
        cone="pyramidal",
        view=((1.2, -1.4, 0.8), (0.0, 0.0, 0.25)),
    )


def feet_of(robot: Robot) -> list[str]:
    """Return the links on which a robot stands.

    Raises:
        ConfigError: the robot has no legs.
    """
    block = robot.definition.locomotion
    found = [] if block is None else list(block.floor_touching_base_link_names)
    if robot.two_wheel is not None or robot.body.is_fixed or len(found) < 2:
        raise ConfigError(f"robot {robot.name!r} has no legs; choose one that has, such as 'walker'")
    return found


def trot_offsets(robot: Robot, feet: list[str]) -> Array:
    """Return the phase (k,) of each foot: pairs across the diagonal swing together, neighbours in turn.

    Args:
        robot: standing.
        feet: links.
    """
    centre = robot.base_link.pose[0]
    offsets = []
    for name in feet:
        x, y = (robot.link(name).pose[0] - centre)[:2]
        offsets.append(0.0 if (x > 0) == (y > 0) else np.pi)
    if len(feet) == 2:
        return np.array([0.0, np.pi])
    return np.array(offsets)
