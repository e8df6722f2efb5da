"""Films of policies in their tasks."""

from __future__ import annotations

from pathlib import Path

from roboyard.envs.play import play
from roboyard.envs.policy import Policy
from roboyard.envs.registration import make_task


def film(file: Path | str, policy: Policy, *, seconds: float = 6.0, seed: int = 0) -> None:
    """Write a film of a policy in its task, with a camera that follows the robot.

    Args:
        file: GIF or MP4.
        policy: to show.
        seconds: length, in simulated time (s).
        seed: of the first episode.
    """
    task = make_task(policy.task, **dict(policy.options))
    steps = round(seconds / (task.substeps * task.timestep))
    for _ in play(policy, steps=steps, seed=seed, record=Path(file)):
        pass
