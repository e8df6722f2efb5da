"""Films of policies in their tasks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roboyard.envs.observer import joined
from roboyard.envs.pictures import SIZE
from roboyard.envs.policy import Policy
from roboyard.envs.registration import make_task
from roboyard.envs.runner import Runner


def film(
    file: Path | str,
    policy: Policy,
    *,
    seconds: float = 6.0,
    seed: int = 0,
    fps: int = 20,
    follow: bool = True,
) -> None:
    """Write a film of a policy in its task.

    Args:
        file: GIF or MP4.
        policy: to show.
        seconds: length, in simulated time (s).
        seed: of the episode.
        fps: pictures per second.
        follow: whether the camera moves with the robot.
    """
    from roboyard.recording import VideoWriter
    from roboyard.rendering import Camera

    task = make_task(policy.task, **dict(policy.options))
    runner = Runner(task, 1, threads=1)
    observed = joined(runner.reset(seeds=[seed]))
    eye, target = (np.array(point) for point in task.view)
    start = runner.env.robot.base.position[0].copy()
    every = max(1, round(1.0 / (fps * runner.env.dt)))
    with VideoWriter(Path(file), fps=round(1.0 / (every * runner.env.dt))) as writer:
        for step in range(round(seconds / runner.env.dt)):
            result = runner.step(policy(observed))
            observed = joined(result.observations)
            if result.terminated[0] or result.truncated[0]:
                observed = joined(runner.reset())
            if step % every:
                continue
            moved = runner.env.robot.base.position[0] - start if follow else np.zeros(3)
            moved[2] = 0.0
            camera = Camera.look_at(eye + moved, target + moved, width=SIZE[0], height=SIZE[1])
            writer.add(runner.show().render(camera))
