"""Paths on which a link keeps to a region: upright, on a line; and reasons that say what would help."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description.model import Box, Pose
from roboyard.errors import ConfigError
from roboyard.kinematics import forward_kinematics
from roboyard.planning import (
    Obstacle,
    PathConstraint,
    Planner,
    PoseGoal,
    SphereModel,
    keep_upright,
    on_line,
    turned_goals,
)
from roboyard.planning.constraints import BoundConstraint
from roboyard.transforms import quaternion_from_matrix

DOWN = (1.0, 0.0, 0.0, 0.0)
WALL = Obstacle(name="wall", shape=Box(size=(0.5, 0.04, 0.45)), pose=Pose(position=(0.45, 0.0, 0.2)))


def posture(arm: SphereModel, y: float) -> np.ndarray:
    """A posture whose tool points down, on one side of the wall."""
    free = Planner(arm, obstacles=[WALL])
    link = free.robot.chain.links[-1]
    goal = PoseGoal(link=link, position=(0.42, y, 0.3), quaternion=DOWN)
    return free.ik(goal, np.array([0.0, 0.8, 0.0, 1.2, 0.0, 1.0, 0.0]))[0].q


@pytest.fixture(scope="module")
def start(arm: SphereModel) -> np.ndarray:
    return posture(arm, 0.25)


@pytest.fixture(scope="module")
def beyond(start: np.ndarray) -> np.ndarray:
    """The same posture on the other side of the wall."""
    out = start.copy()
    out[0] -= 2 * np.arctan2(0.25, 0.42)
    return out


def poses(planner: Planner, q: np.ndarray) -> np.ndarray:
    order = [planner.joint_names.index(name) for name in planner.robot.joint_names]
    return forward_kinematics(planner.robot.chain, q[..., order], planner.robot.chain.links[-1])


@pytest.fixture(scope="module")
def planner(arm: SphereModel) -> Planner:
    return Planner(arm, obstacles=[WALL], velocity=2.0, acceleration=10.0, jerk=300.0)


def test_a_cup_stays_upright_around_a_wall(planner: Planner, start: np.ndarray, beyond: np.ndarray) -> None:
    link = planner.robot.chain.links[-1]
    goal = beyond
    plan = planner.plan(start, goal, keep=keep_upright(link, 0.15))
    assert plan.solved, plan.reason
    assert plan.trajectory is not None
    dense = plan.trajectory.dense(0.005)
    turned = poses(planner, dense)[:, :3, :3]
    up = turned[0].T @ (0.0, 0.0, 1.0)  # what points up at the start, in the link's frame
    angles = np.arccos(np.clip((turned @ up)[:, 2], -1, 1))
    assert angles.max() <= 0.15 + 1e-6
    free = planner.plan(start, goal)
    assert free.trajectory is not None
    others = poses(planner, free.trajectory.dense(0.005))[:, :3, :3]
    assert np.arccos(np.clip((others @ up)[:, 2], -1, 1)).max() > 0.15, "without the constraint it tilts"


def test_a_link_follows_a_line(arm: SphereModel, start: np.ndarray) -> None:
    planner = Planner(arm, velocity=2.0, acceleration=10.0, jerk=300.0)
    link = planner.robot.chain.links[-1]
    pose = poses(planner, start)
    a = pose[:3, 3]
    b = a + np.array([0.05, -0.2, 0.08])
    goal = PoseGoal(link=link, position=b, quaternion=quaternion_from_matrix(pose[:3, :3]))
    plan = planner.plan(start, goal, keep=on_line(link, a, b, 0.006))
    assert plan.solved, plan.reason
    assert plan.trajectory is not None
    at = poses(planner, plan.trajectory.dense(0.005))[:, :3, 3]
    along = (b - a) / np.linalg.norm(b - a)
    across = (at - a) - ((at - a) @ along)[:, None] * along
    assert np.linalg.norm(across, axis=1).max() <= 0.006 * np.sqrt(2) + 1e-6
    np.testing.assert_allclose(at[-1], b, atol=2e-4)


def test_a_goal_outside_the_region_is_named(planner: Planner, start: np.ndarray) -> None:
    link = planner.robot.chain.links[-1]
    goal = start.copy()
    goal[5] += 0.8
    plan = planner.plan(start, goal, keep=keep_upright(link, 0.1))
    assert plan.outcome == "goal outside constraint"
    assert link in plan.reason and "8.0 times" in plan.reason
    there = PathConstraint(link=link, frame=np.eye(4), position=0.01)
    assert planner.plan(start, start + 0.01, keep=there).outcome == "start outside constraint"
    with pytest.raises(ConfigError, match="positive"):
        planner.plan(start, start, keep=keep_upright(link, -1.0))
    with pytest.raises(ConfigError, match="hand"):
        planner.plan(start, start, keep=keep_upright("hand"))
    with pytest.raises(ConfigError, match="direction"):
        on_line(link, (1, 0, 0), (1, 0, 0))


def test_one_of_a_set_of_poses_is_reached(planner: Planner, start: np.ndarray, beyond: np.ndarray) -> None:
    link = planner.robot.chain.links[-1]
    pose = poses(planner, beyond)
    goal = PoseGoal(link=link, position=pose[:3, 3], quaternion=quaternion_from_matrix(pose[:3, :3]))
    goals = turned_goals(goal, (0, 0, 1), 6)
    assert len(goals) == 6
    plan = planner.plan(start, goals)
    assert plan.solved and plan.goal is not None
    end = poses(planner, plan.path[-1])
    np.testing.assert_allclose(end[:3, 3], pose[:3, 3], atol=2e-4)
    np.testing.assert_allclose(end[:3, 2], pose[:3, 2], atol=2e-3)  # the axis that the set turns about


def test_reasons_say_what_would_help(arm: SphereModel, start: np.ndarray) -> None:
    shut = [
        Obstacle(name="curtain", shape=Box(size=(1.8, 0.02, 2.4)), pose=Pose(position=(1.15, 0.0, 1.0))),
        Obstacle(name="behind", shape=Box(size=(1.8, 0.02, 2.4)), pose=Pose(position=(-1.15, 0.0, 1.0))),
        Obstacle(name="above", shape=Box(size=(0.6, 0.02, 1.2)), pose=Pose(position=(0.0, 0.0, 1.2))),
    ]
    planner = Planner(arm, obstacles=shut)
    bent = np.array([0.8, 0.8, 0.0, 1.4, 0.0, 0.5, 0.0])
    plan = planner.plan(bent, bent * (-1, 1, 1, 1, 1, 1, 1), time_limit=0.6)
    assert plan.outcome == "time over", plan.reason
    assert 'without obstacle "curtain" there is one: move it' in plan.reason
    far = Planner(arm).plan(start, PoseGoal(link=planner.robot.chain.links[-1], position=(3.0, 0.0, 0.5)))
    assert far.outcome == "goal unreachable"
    assert "comes within" in far.reason


def test_more_time_gives_no_longer_paths(planner: Planner, start: np.ndarray, beyond: np.ndarray) -> None:
    goal = beyond
    lengths = [planner.plan(start, goal, improve=seconds).length for seconds in (0.0, 0.3)]
    assert lengths[1] <= lengths[0] + 1e-9


def test_errors_are_shares_of_the_tolerances_and_free_directions_count_nothing(planner: Planner) -> None:
    robot, root = planner.robot, np.eye(4)
    link = robot.chain.links[-1]
    q = np.array([0.1, 0.4, -0.2, 1.1, 0.3, 0.7, 0.2])
    other = q + 0.2
    here, there = (forward_kinematics(robot.chain, one, link) for one in (q, other))
    moved = here[:3, :3].T @ (there[:3, 3] - here[:3, 3])
    turned = Rotation.from_matrix(here[:3, :3].T @ there[:3, :3]).as_rotvec()
    tight = BoundConstraint(
        PathConstraint(link=link, position=(np.inf, 0.1, np.inf), rotation=(0.2, np.inf, 0.3)), robot, root, q
    )
    expected = [moved[1] / 0.1, turned[0] / 0.2, turned[2] / 0.3]
    np.testing.assert_allclose(tight.errors(other), expected, atol=1e-9)
    np.testing.assert_allclose(tight.errors(q), 0.0, atol=1e-6)
    upright = BoundConstraint(keep_upright(link, 0.25), robot, root, q)
    tilt = np.arccos((there[:3, :3] @ here[:3, :3].T @ np.array([0.0, 0.0, 1.0]))[2])
    np.testing.assert_allclose(upright.errors(other), [tilt / 0.25], atol=1e-9)
    anywhere = BoundConstraint(PathConstraint(link=link), robot, root, q)
    assert anywhere.inside(np.stack([q, other])).all()
    projected = tight.project(other)
    assert projected is not None
    assert tight.inside(projected)
