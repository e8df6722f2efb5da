"""Pictures of a task's environments, from the task's own point of view."""

from __future__ import annotations

import numpy as np

from roboyard.envs.runner import Runner

SIZE = (480, 360)
"""Width and height of pictures (pixels)."""


def task_picture(runner: Runner, row: int) -> np.ndarray:
    """Return the (h, w, 3) picture (0 to 255) of one environment, in its own colours and light.

    Args:
        runner: of the environments.
        row: the environment.
    """
    from roboyard.rendering import Camera

    eye, target = runner.task.view
    world, looks = runner.show(row), runner.env.appearance
    camera = Camera.look_at(eye, target, width=SIZE[0], height=SIZE[1])
    image = world.render(camera, light=looks.light_of(row), colors=looks.colors_of(row))
    return np.ascontiguousarray(image.rgb[..., :3])
