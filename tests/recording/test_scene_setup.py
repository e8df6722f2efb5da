"""Scenes with a robot, set up from plain data: the pose that the robot starts at."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.errors import ConfigError
from roboyard.recording import set_up
from roboyard.transforms import quaternion_from_rpy


def test_a_given_pose_stands_on_the_floor() -> None:
    made = set_up({"scene": "empty", "robot": "rover", "pose": [1.5, -0.5, 0.7]})
    assert made.robot is not None
    position, quaternion = made.robot.body.pose
    assert position == pytest.approx([1.5, -0.5, 0.0], abs=1e-6)
    assert quaternion == pytest.approx(quaternion_from_rpy((0.0, 0.0, 0.7)), abs=1e-9)
    made.scene.world.step(240)
    assert made.robot.body.pose[0] == pytest.approx(position, abs=1e-3)
    assert made.setup["pose"] == [1.5, -0.5, 0.7]


def test_uneven_ground_is_not_penetrated() -> None:
    for pose in ((4.0, 3.0, 0.5), (-3.0, 2.0, 0.0), (5.0, -4.0, 1.0)):
        made = set_up({"scene": "terrain", "robot": "rover", "pose": pose})
        robot, world = made.robot, made.scene.world
        assert robot is not None
        highest = robot.body.pose[0][2]
        for _ in range(48):  # a robot that starts in the ground is thrown up
            world.step(5)
            highest = max(highest, float(robot.body.pose[0][2]))
        assert highest < robot.body.pose[0][2] + 0.5
        up = 1 - 2 * np.square(robot.body.pose[1][:2]).sum()
        assert up > 0.5, "the rover has turned over"


def test_a_pose_inside_a_wall_is_an_error() -> None:
    with pytest.raises(ConfigError, match=r"pose \(-1, 1, 0\).*inside 'walls'; choose another pose"):
        set_up({"scene": "home", "robot": "rover", "pose": (-1.0, 1.0, 0.0)})


@pytest.mark.parametrize("pose", [(1.0, 2.0), "here", (1.0, float("nan"), 0.0)])
def test_a_pose_is_three_numbers(pose: object) -> None:
    with pytest.raises(ConfigError, match="pose: must be 3 finite numbers"):
        set_up({"scene": "empty", "robot": "rover", "pose": pose})
