"""Small tasks that the tests of environments share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from roboyard import add_robot
from roboyard.assets import asset_path
from roboyard.envs import JointDelta, Task


def arm_task(**changes: Any) -> Task:
    """An arm that is observed and does nothing in particular."""

    def build(world: Any) -> Any:
        world.add_plane()
        robot = add_robot(world, str(asset_path("arm7")))
        robot.joint_positions = [0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0]
        return {"robot": robot, "box": world.add_box((0.1, 0.1, 0.1), (1.0, 0.0, 0.05))}

    task = Task(
        build=build,
        actions={"arm_0": JointDelta(0.1)},
        observations={"q": lambda env: env.robot.q, "box": lambda env: env.body("box").position},
        rewards={"still": lambda env: -np.abs(env.robot.v).sum(axis=1)},
        limit=20,
    )
    return replace(task, **changes)


@pytest.fixture
def make_arm_task() -> Any:
    return arm_task
