"""The bundled R1, imported and driven by its definition."""

from __future__ import annotations

import time

import numpy as np
import pytest

from roboyard.errors import ConfigError, RoboyardError
from roboyard.robots import Robot, add_robot
from roboyard.robots.control.rotations import vector_of_matrix
from roboyard.sim import World
from roboyard.transforms import matrix_from_quaternion, quaternion_from_rpy
from roboyard.validation.gates.ik_reach import command, reach, sample_paths

ABSOLUTE = {"mode": "absolute_pose", "command_output_limits": None}
FORWARD = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
"""The gripper looks along x, fingers side by side along y."""


def floor(**options) -> Robot:
    world = World()
    world.add_plane()
    return add_robot(world, "r1", **options)


def drive(robot: Robot, twist, seconds: float) -> None:
    for _ in range(round(seconds * 30)):
        robot.apply_action({"base": robot.controllers["base"].scaling.invert(np.array(twist, float))})
        robot.world.step(8)


@pytest.fixture
def robot() -> Robot:
    return floor()


def test_groups_and_vectors_are_in_the_documented_order(robot: Robot) -> None:
    assert robot.action_dim == 21
    assert {n: s.stop - s.start for n, s in robot.controller_action_idx.items()} == {
        "base": 3, "trunk": 4, "arm_left": 6, "gripper_left": 1, "arm_right": 6, "gripper_right": 1,
    }  # fmt: skip
    assert robot.joint_names == robot.body.joint_names
    assert robot.joint_names[6:19] == (
        "torso_joint1", "torso_joint2", "torso_joint3", "torso_joint4",
        "left_arm_joint1", "left_arm_joint2", "left_arm_joint3",
        "left_arm_joint4", "left_arm_joint5", "left_arm_joint6",
        "left_gripper_axis1", "left_gripper_axis2", "right_arm_joint1",
    )  # fmt: skip
    assert np.array_equal(robot.joint_positions, robot.body.joint_positions)
    q = dict(zip(robot.joint_names, robot.joint_positions, strict=True))
    assert q["left_arm_joint3"] == q["right_arm_joint3"] == -0.991
    assert robot.body.is_fixed
    assert robot.action_space.contains(robot.action_space.sample(np.random.default_rng(0)))


def test_ten_seconds_of_zero_actions_cause_no_motion(robot: Robot) -> None:
    start, q0 = robot.position, robot.joint_positions
    for _ in range(300):
        robot.apply_action(np.zeros(21))
        robot.world.step(8)
        assert np.linalg.norm(robot.position - start) < 1e-3
    assert np.abs(robot.joint_positions - q0)[6:].max() < 1e-3
    assert np.abs(robot.joint_velocities).max() < 1e-3


def test_the_base_still_supports_the_weight(robot: Robot) -> None:
    """Gravity is compensated by the drives, not switched off."""
    robot.world.step(480)
    load = sum(contact.normal_force for contact in robot.world.contacts(robot.body))
    assert load == pytest.approx(robot.body.mass * 9.81, rel=0.01)


def test_a_square_of_one_metre(robot: Robot) -> None:
    corner = robot.position
    for k, twist in enumerate([(0.5, 0, 0), (0, 0.5, 0), (-0.5, 0, 0), (0, -0.5, 0)]):
        drive(robot, twist, 2.0)
        drive(robot, (0, 0, 0), 0.5)
        wanted = corner + np.array([(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)][k])
        assert np.linalg.norm((robot.position - wanted)[:2]) < 0.02


def test_a_square_driven_forwards_with_turns(robot: Robot) -> None:
    corner = robot.position
    for wanted in ((1, 0), (1, 1), (0, 1), (0, 0)):
        drive(robot, (0.5, 0, 0), 2.0)
        drive(robot, (0, 0, 0), 0.5)
        drive(robot, (0, 0, np.pi / 4), 2.0)
        drive(robot, (0, 0, 0), 0.5)
        assert (robot.position - corner)[:2] == pytest.approx(wanted, abs=0.02)


@pytest.mark.slow
def test_a_hundred_poses_are_reached() -> None:
    arms = ("arm_left", "arm_right")
    robot = floor(action_normalize=False, controllers=dict.fromkeys(arms, ABSOLUTE))
    errors = []
    for arm in arms:
        for way in sample_paths(robot, arm, 50, seed=11):
            robot.reset()
            for pose in way[:-1]:
                command(robot, arm, pose)
                robot.world.step(72)
            errors.append(reach(robot, arm, way[-1], 6.0))
    assert len(errors) == 100
    assert max(position for position, _ in errors) < 5e-3
    assert max(turn for _, turn in errors) < 0.05


@pytest.mark.parametrize("arm", ["left", "right"])
def test_each_gripper_lifts_a_box(arm: str) -> None:
    robot = floor(action_normalize=False, controllers={f"arm_{arm}": ABSOLUTE})
    world, at = robot.world, np.array([0.55, 0.25 if arm == "left" else -0.25, 1.2])

    def go(position, grip: float, seconds: float) -> None:
        goal = np.concatenate([position, vector_of_matrix(FORWARD)])
        robot.apply_action({f"arm_{arm}": goal, f"gripper_{arm}": [grip]})
        world.step(round(240 * seconds))

    go(at - [0.1, 0, 0], 1.0, 3.0)
    box = world.add_box((0.04, 0.04, 0.04), at, mass=0.2)
    world.add_box((0.03, 0.02, 0.2), at - [0, 0, 0.12], mass=0)
    go(at, 1.0, 2.0)
    fingers = robot.manipulation.gripper_control_idx[arm]
    assert robot.joint_positions[fingers] == pytest.approx([0.05, 0.05], abs=1e-3)
    go(at, -1.0, 1.5)
    assert robot.arms[arm].is_grasping is True
    go(at + np.array([0, 0, 0.1]), -1.0, 3.0)
    assert box.position == pytest.approx(at + np.array([0, 0, 0.1]), abs=5e-3)
    world.step(480)
    assert box.position == pytest.approx(at + np.array([0, 0, 0.1]), abs=5e-3)
    assert robot.arms[arm].is_grasping is True
    go(at + np.array([0, 0, 0.1]), 1.0, 1.0)
    assert box.position[2] < 1.25
    assert robot.arms[arm].is_grasping is not True


def test_tucking_and_resetting_keep_the_base_pose(robot: Robot) -> None:
    drive(robot, (0.5, 0, 0), 1.0)
    drive(robot, (0, 0, 0), 0.5)
    here = robot.position
    arms = np.concatenate([robot.control_idx["arm_left"], robot.control_idx["arm_right"]])
    assert len(arms) == 12
    robot.tuck()
    assert robot.joint_positions[arms] == pytest.approx(np.zeros(12))
    assert robot.position == pytest.approx(here, abs=1e-9)
    robot.world.step(240)
    assert robot.joint_positions[arms] == pytest.approx(np.zeros(12), abs=0.02)
    robot.untuck()
    assert robot.joint_positions[robot.joint_names.index("left_arm_joint2")] == 1.906
    robot.reset()
    assert robot.position == pytest.approx(here, abs=1e-3)


def test_poses_are_set_through_the_virtual_joints(robot: Robot) -> None:
    wanted = quaternion_from_rpy((0.02, -0.03, 2.5))
    robot.set_pose((1.0, -2.0, 0.3), wanted)
    position, quaternion = robot.pose
    assert position == pytest.approx([1.0, -2.0, 0.3], abs=1e-9)
    assert matrix_from_quaternion(quaternion) == pytest.approx(matrix_from_quaternion(wanted), abs=1e-9)


def test_end_effector_poses_agree_between_frames(robot: Robot) -> None:
    robot.set_pose((1.0, 2.0, 0.0), quaternion_from_rpy((0, 0, 1.0)))
    world, base = robot.arms["left"].pose[0], robot.arms["left"].pose_in_base[0]
    turned = matrix_from_quaternion(robot.orientation)
    assert turned @ base + robot.position == pytest.approx(world)
    with pytest.raises(RoboyardError, match="no arm named 'lift'; did you mean 'left'"):
        robot.arms["lift"]


def test_proprioception(robot: Robot) -> None:
    vector, values = robot.proprioception()
    assert vector.shape == (2 * (6 + 6 + 3 + 4 + 2 + 1),)
    assert values["eef_left_pos"] == pytest.approx(robot.arms["left"].pose_in_base[0])
    assert values["trunk_qpos"].shape == (4,)
    few, _ = robot.proprioception(("joint_qpos", "robot_pos"))
    assert few.shape == (29,)
    with pytest.raises(RoboyardError, match="no proprioception key named 'joint_qpo'"):
        robot.proprioception(("joint_qpo",))


def test_controllers_are_replaced_and_errors_named(robot: Robot) -> None:
    robot.reload_controllers({"arm_left": "JointController", "trunk": {"name": "NullJointController"}})
    assert robot.action_dim == 17
    robot.reload_controllers({"arm_left": {"subsume_controllers": ["trunk"]}})
    assert robot.groups["arm_left"].joints[:4] == tuple(f"torso_joint{k}" for k in range(1, 5))
    assert "trunk" not in robot.groups
    start = robot.arms["left"].pose_in_base[0]
    for _ in range(60):
        robot.apply_action({"arm_left": [0, 0, 0.1, 0, 0, 0]})
        robot.world.step(8)
    moved = robot.arms["left"].pose_in_base[0] - start
    assert moved[2] > 0.1
    assert np.abs(moved[:2]).max() < 0.02
    for config, message in [
        ({"arm_lift": {}}, "no group named 'arm_lift'; did you mean 'arm_left'"),
        ({"base": "JointController"}, r"controllers\.base\.name: no controller for this group"),
        ({"arm_left": {"mode": "fast"}}, r"controllers\.arm_left\.mode: must be one of"),
        ({"arm_left": {"mod": "x"}}, r"controllers\.arm_left\.mod: no key named 'mod'; did you mean 'mode'"),
        (
            {"arm_left": {"subsume_controllers": ["tail"]}},
            r"controllers\.arm_left\.subsume_controllers: no group",
        ),
        ({"arm_left": {"mode": "absolute_pose"}}, r"controllers\.arm_left: mode 'absolute_pose' needs"),
    ]:
        with pytest.raises(ConfigError, match=message):
            robot.reload_controllers(config)


@pytest.mark.parametrize("keys", [{"name": "OperationalSpaceController"}, {"use_impedances": True}])
def test_arms_under_effort_control_hold_and_move(keys: dict) -> None:
    robot = floor(controllers={"arm_left": keys})
    assert robot.controllers["arm_left"].control_type == "effort"
    start = robot.arms["left"].pose_in_base[0]
    robot.apply_action(np.zeros(21))
    robot.world.step(480)
    assert robot.arms["left"].pose_in_base[0] == pytest.approx(start, abs=5e-3)
    robot.apply_action({"arm_left": [0.25, 0, 0.25, 0, 0, 0]})
    robot.world.step(720)
    assert robot.arms["left"].pose_in_base[0] - start == pytest.approx([0.05, 0, 0.05], abs=5e-3)


def test_actions_of_the_wrong_kind_are_refused(robot: Robot) -> None:
    with pytest.raises(RoboyardError, match="an action must have 21 numbers"):
        robot.apply_action(np.zeros(20))
    with pytest.raises(RoboyardError, match="no group named 'arm_lift'"):
        robot.apply_action({"arm_lift": np.zeros(6)})
    with pytest.raises(RoboyardError, match="not finite"):
        robot.apply_action(np.full(21, np.nan))


def test_two_robots_and_a_removed_one_live_in_one_world() -> None:
    world = World()
    world.add_plane()
    one, two = add_robot(world, "r1"), add_robot(world, "r1", (0, 3, 0))
    assert (one.name, two.name) == ("r1", "r1_2")
    two.apply_action({"base": [0.2, 0, 0]})
    world.step(240)
    assert np.linalg.norm(one.position[:2]) < 1e-3
    assert two.position[0] > 0.2
    one.remove()
    world.step(240)
    assert two.position[0] > 0.45


def test_faster_than_real_time_by_far(robot: Robot) -> None:
    action = np.zeros(21)
    action[[0, 7, 14]] = 0.05, 0.05, -0.05
    for _ in range(10):
        robot.apply_action(action)
        robot.world.step(8)
    began = time.process_time()
    for _ in range(90):
        robot.apply_action(action)
        robot.world.step(8)
    assert 3.0 / (time.process_time() - began) > 10.0


def test_a_robot_of_half_the_size_reaches_half_as_far(robot: Robot) -> None:
    small = floor(scale=0.5, name="small")
    start = small.arms["left"].pose_in_base[0]
    assert start == pytest.approx(robot.arms["left"].pose_in_base[0] / 2, rel=1e-6)
    small.apply_action({"arm_left": [0.25, 0, 0.1, 0, 0, 0]})
    small.world.step(720)
    assert small.arms["left"].pose_in_base[0] - start == pytest.approx([0.05, 0, 0.02], abs=2e-3)
