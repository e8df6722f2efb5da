"""A task of your own: a rover pushes a ball over a line, alone and in 64 copies.

    python examples/custom_environment.py film.gif

A rule of two lines drives 64 environments at once, as a policy would, and then one that is filmed.
"""

import sys
from typing import Any

import gymnasium
import numpy as np

from roboyard import World, add_robot
from roboyard.envs import BaseTwist, Mass, Reward, Task, make_vec, register_task
from roboyard.recording import VideoWriter

LINE = 2.5  # m


def build(world: World) -> dict[str, Any]:
    world.add_plane()
    return {"robot": add_robot(world, "rover"), "ball": world.add_sphere(0.1, (1, 0, 0.1), mass=0.3)}


def start(env: Any, rows: Any, random: np.random.Generator) -> None:
    place = np.full((len(rows), 3), 0.1)
    place[:, :2] = random.uniform([0.6, -0.3], [1.2, 0.3])
    env.body("ball").set_pose(rows, place)


def to_ball(env: Any) -> Any:
    return env.robot.base.to_local(env.body("ball").position - env.robot.base.position)[:, :2]


def make(limit: int = 300) -> Task:
    return Task(
        build=build,
        actions={"base": BaseTwist(speed=1.0, turn=2.0)},
        observations={"to_ball": to_ball},
        rewards={"kick": Reward(function=lambda env: env.body("ball").linear_velocity[:, 0])},
        terminations={"over": lambda env: env.body("ball").position[:, 0] > LINE},
        reset=[start],
        randomize=[Mass("ball", (0.7, 1.4))],
        limit=limit,
    )


def rule(to_ball: Any) -> Any:
    """Full speed, turning towards the ball: actions (n, 2) of -1 to 1."""
    angle = np.arctan2(to_ball[:, 1], to_ball[:, 0])
    return np.stack([np.ones(len(angle)), np.clip(2.0 * angle, -1.0, 1.0)], axis=1)


def main(film: str) -> float:
    """Return the share of environments in which the ball went over the line."""
    register_task("example/Kick-v0", make)
    envs = make_vec("example/Kick-v0", 64)
    (seen, _), reached = envs.reset(seed=0), np.zeros(64, dtype=bool)
    for _ in range(300):
        seen, _, ended, _, _ = envs.step(rule(seen))
        reached |= ended
    one = gymnasium.make("example/Kick-v0", render_mode="rgb_array")
    seen, _ = one.reset(seed=1)
    with VideoWriter(film, fps=15) as video:
        for step in range(300):
            seen, _, ended, _, _ = one.step(rule(seen[None])[0])
            if ended:
                break
            if step % 2 == 0:
                video.add(one.render())
    return float(reached.mean())


if __name__ == "__main__":
    print(f"over the line: {main(sys.argv[1]):.0%}")
