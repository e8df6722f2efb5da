"""Plans for a live robot: the other joints held where they are, obstacles read from the world."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.errors import ConfigError
from roboyard.kinematics import forward_kinematics
from roboyard.planning import PoseGoal, PosesGoal, planner_for
from roboyard.robots import add_robot
from roboyard.robots.robot import Robot
from roboyard.sim import World
from roboyard.transforms import pose_matrix


@pytest.fixture(scope="module")
def robot() -> Robot:
    world = World()
    world.add_plane()
    world.add_box((0.5, 1.2, 0.05), (1.0, 0.3, 0.72), mass=0.0, name="table")
    robot = add_robot(world, "r1", position=(0.1, 0.2, 0.0), orientation=(0, 0, np.sin(0.2), np.cos(0.2)))
    posture = robot.joint_positions
    posture[[robot.joint_names.index(f"torso_joint{k}") for k in (1, 2, 3)]] = (0.3, -0.5, 0.2)
    robot.joint_positions = posture
    return robot


def test_groups_name_their_joints(robot: Robot) -> None:
    assert planner_for(robot, "left").joint_names == tuple(f"left_arm_joint{k}" for k in range(1, 7))
    assert len(planner_for(robot, "both", torso=True, base=True).joint_names) == 3 + 4 + 12
    assert len(planner_for(robot, base=True).joint_names) == 3
    with pytest.raises(ConfigError, match="middle"):
        planner_for(robot, "middle")
    with pytest.raises(ConfigError, match="elbow"):
        planner_for(robot, joints=["elbow"])


def test_the_robot_stands_where_the_live_one_does(robot: Robot) -> None:
    planner = planner_for(robot, "left").planner()
    q = robot.joint_positions[[robot.joint_names.index(name) for name in planner.robot.joint_names]]
    frame = planner.obstacles.root @ forward_kinematics(planner.robot.chain, q, "left_eef_link")
    np.testing.assert_allclose(frame, pose_matrix(*robot.arms["left"].pose), atol=1e-6)


@pytest.mark.parametrize("group", [{"arm": "left"}, {"arm": "both", "torso": True}])
def test_a_plan_keeps_clear_of_the_live_world(robot: Robot, group: dict[str, object]) -> None:
    planner = planner_for(robot, **group)  # type: ignore[arg-type]
    begin = robot.joint_positions
    rows = [robot.joint_names.index(name) for name in planner.joint_names]
    random = np.random.default_rng(1)
    solved = 0
    try:
        for seed in range(8):
            goal = np.clip(
                begin[rows] + random.normal(size=len(rows)) * 0.5, *np.array(robot.joint_limits[rows]).T
            )
            plan = planner.plan(goal, seed=seed)
            assert plan.outcome in ("solved", "goal in collision"), plan.reason
            if plan.trajectory is None:
                continue
            solved += 1
            for q in plan.trajectory.dense(0.05):
                posture = begin.copy()
                posture[rows] = q
                robot.joint_positions = posture
                robot.world.detect_contacts()
                for contact in robot.world.contacts(robot.body):
                    names = {contact.link_a.name, contact.link_b.name}
                    assert (
                        contact.distance > -1e-4
                        or any("wheel" in name for name in names)
                        or (tuple(sorted(names)) in planner.model.ignore)
                    ), names
    finally:
        robot.joint_positions = begin
    assert solved >= 2


def test_a_body_that_moved_is_seen(robot: Robot) -> None:
    planner = planner_for(robot, "left")
    assert planner.start().shape == (6,)
    hand = robot.arms["left"].pose[0]
    box = robot.world.add_box((0.1, 0.1, 0.1), np.add(hand, (0.0, 0.0, 2.0)), mass=0.0, name="brick")
    assert planner.plan(planner.start()).solved
    box.set_pose(hand)
    plan = planner.plan(planner.start())
    assert plan.outcome == "start in collision"
    assert '"brick"' in plan.reason
    robot.world.remove(box)
    assert planner.plan(planner.start()).solved


def test_a_pose_in_the_world_frame_is_reached(robot: Robot) -> None:
    planner = planner_for(robot, "left")
    position, quaternion = robot.arms["left"].pose
    goal = PoseGoal(
        link=planner.tool, position=tuple(np.add(position, (0.0, 0.05, 0.05))), quaternion=tuple(quaternion)
    )
    plan = planner.plan(goal)
    assert plan.solved, plan.reason
    made = planner.planner()
    q = plan.path[-1]
    frame = made.obstacles.root @ forward_kinematics(made.robot.chain, q, "left_eef_link")
    np.testing.assert_allclose(frame[:3, 3], np.add(position, (0.0, 0.05, 0.05)), atol=2e-4)


def test_another_robot_is_an_obstacle_that_moves(robot: Robot) -> None:
    world, begin = robot.world, robot.joint_positions
    planner = planner_for(robot, "left")
    goal = planner.start()
    hand = np.asarray(robot.arms["left"].pose[0])
    yaw = 0.4 + np.pi  # it faces the robot, 3 m before it
    away = np.array([0.1, 0.2, 0.0]) + 3.0 * np.array([np.cos(0.4), np.sin(0.4), 0.0])
    other = add_robot(
        world, "r1", position=away, orientation=(0, 0, np.sin(yaw / 2), np.cos(yaw / 2)), name="visitor"
    )
    try:
        assert planner.plan(goal).solved
        before = planner.planner().obstacles
        reach = np.asarray(other.arms["left"].pose[0])
        turned = (0, 0, np.sin(yaw / 2), np.cos(yaw / 2))
        other.body.set_pose(away + hand - reach - 0.1 * (away - hand) / 3.0, turned)  # its hand in ours
        plan = planner.plan(goal)
        world.detect_contacts()
        assert any(contact.distance < 0 for contact in world.contacts(robot.body, other.body))
        assert plan.outcome == "start in collision"
        assert "visitor" in plan.reason
        assert planner.planner().obstacles is before  # moved in place
        rows = [k for k, name in enumerate(other.joint_names) if name.startswith("left_arm")]
        raised = other.joint_positions
        raised[rows] = 0.0
        other.joint_positions = raised
        moved = planner.plan(goal)
        world.detect_contacts()
        touching = [c for c in world.contacts(robot.body, other.body) if c.distance < 0]
        assert moved.solved == (not touching), moved.reason
        assert moved.solved
    finally:
        world.remove(other.body)
        robot.joint_positions = begin


def test_both_hands_reach_their_poses_at_once(robot: Robot) -> None:
    planner = planner_for(robot, "both")
    begin = robot.joint_positions
    rows = [robot.joint_names.index(name) for name in planner.joint_names]
    tools = [planner_for(robot, arm).tool for arm in ("left", "right")]
    positions = [np.add(robot.arms[arm].pose[0], (0.0, 0.0, 0.08)) for arm in ("left", "right")]
    goal = PosesGoal(
        poses=[
            PoseGoal(link=tools[0], position=positions[0], quaternion=robot.arms["left"].pose[1]),
            PoseGoal(link=tools[1], position=positions[1]),
        ]
    )
    found = planner.ik(goal)
    assert found
    assert found[0].is_free
    plan = planner.plan(goal)
    assert plan.solved, plan.reason
    try:
        for q in (found[0].q, plan.path[-1]):
            posture = begin.copy()
            posture[rows] = q
            robot.joint_positions = posture
            for arm, position in zip(("left", "right"), positions, strict=True):
                np.testing.assert_allclose(
                    robot.arms[arm].pose[0], position, atol=2e-4
                )  # as MuJoCo places it
            turned = pose_matrix(*robot.arms["left"].pose)[:3, :3]
            wanted = pose_matrix((0, 0, 0), goal.poses[0].quaternion)[:3, :3]  # type: ignore[arg-type]
            np.testing.assert_allclose(turned, wanted, atol=2e-3)
    finally:
        robot.joint_positions = begin
