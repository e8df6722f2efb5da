"""A goal and an obstacle that move are followed and avoided, at more than 50 Hz."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.model import Box, Pose, Sphere
from roboyard.errors import ConfigError
from roboyard.kinematics import forward_kinematics
from roboyard.planning import Follower, Obstacle, Planner, PoseGoal, SphereModel

READY = np.array([0.6, 0.8, 0.0, 1.4, 0.0, 0.5, 0.0])
STEP = 0.02


def tool(planner: Planner, q: np.ndarray) -> np.ndarray:
    order = [planner.joint_names.index(name) for name in planner.robot.joint_names]
    chain = planner.robot.chain
    return forward_kinematics(chain, q[order], chain.links[-1])[:3, 3]


def test_a_moving_goal_is_followed_within_the_limits(arm: SphereModel) -> None:
    planner = Planner(arm, velocity=2.0, acceleration=15.0)
    follower = Follower(planner, READY)
    link, middle = planner.robot.chain.links[-1], tool(planner, READY)
    gaps, seconds = [], []
    last_q, last_v = READY, np.zeros(7)
    for k in range(250):
        angle = 0.8 * k * STEP
        at = middle + 0.1 * np.array([np.cos(angle) - 1.0, np.sin(angle), 0.0])
        done = follower.step(PoseGoal(link=link, position=at), STEP)
        assert np.abs(done.v).max() <= 0.8 * 2.0 + 1e-9
        assert np.abs(done.v - last_v).max() <= 15.0 * STEP + 1e-9
        np.testing.assert_allclose(done.q, last_q + STEP * done.v, atol=1e-9)
        last_q, last_v = done.q, done.v
        gaps.append(np.linalg.norm(tool(planner, done.q) - at))
        seconds.append(done.seconds)
    assert np.max(gaps[50:]) < 0.03, "the goal moves by 8 cm/s"
    assert np.median(seconds) < STEP, "50 Hz"


def test_an_obstacle_that_moves_into_the_way_is_avoided(arm: SphereModel) -> None:
    ball = Obstacle(name="ball", shape=Sphere(radius=0.08), pose=Pose(position=(0.55, -0.6, 0.35)))
    planner = Planner(arm, obstacles=[ball], velocity=2.0, acceleration=15.0)
    follower = Follower(planner, READY)
    link, at = planner.robot.chain.links[-1], tool(planner, READY)
    order = [planner.joint_names.index(name) for name in planner.robot.joint_names]
    states, gaps, least = set(), [], np.inf
    for k in range(450):
        y = at[1] - 0.6 + 0.25 * k * STEP  # 25 cm/s, through where the tool is
        planner.obstacles.move("ball", Pose(position=(float(at[0]), float(y), float(at[2]))))
        done = follower.step(PoseGoal(link=link, position=at), STEP)
        least = min(least, planner.checker.nearest(done.q[order]).distance)
        states.add(done.state)
        gaps.append(np.linalg.norm(tool(planner, done.q) - at))
    assert least > -0.002, "it keeps out of the ball's way"
    assert max(gaps) > 0.05, "it gave way"
    assert gaps[-1] < 0.01, "and came back"
    assert states & {"escaping", "going around", "waiting"}


def test_it_goes_around_a_wall(arm: SphereModel) -> None:
    wall = Obstacle(name="wall", shape=Box(size=(0.6, 0.04, 0.5)), pose=Pose(position=(0.5, 0.0, 0.2)))
    planner = Planner(arm, obstacles=[wall], velocity=2.0, acceleration=15.0)
    follower = Follower(planner, READY)
    goal = READY * (-1, 1, 1, 1, 1, 1, 1)
    order = [planner.joint_names.index(name) for name in planner.robot.joint_names]
    states = set()
    for _ in range(400):
        done = follower.step(goal, STEP)
        states.add(done.state)
        assert planner.checker.free(done.q[order])
        if np.abs(done.q - goal).max() < 0.01:
            break
    assert np.abs(done.q - goal).max() < 0.01
    assert "going around" in states


def test_wrong_goals_are_errors(arm: SphereModel) -> None:
    follower = Follower(Planner(arm), READY)
    with pytest.raises(ConfigError, match="7 finite numbers"):
        follower.step([0.0, 1.0])
    with pytest.raises(ConfigError, match="hand"):
        follower.step(PoseGoal(link="hand", position=(0, 0, 1)))
