"""Capabilities of robots: arms, head and torso, kinds of bases, limits, and the frames of sensors."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description import load_description
from roboyard.errors import ConfigError, RoboyardError
from roboyard.robots import Robot, add_robot
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.robots.sensor_frames import camera_frames, lidar_frames
from roboyard.sim import World

MASS = "<inertial><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial>"
LIMIT = "lower='-2' upper='2' effort='50' velocity='3'"


def joint(
    name: str, parent: str, child: str, *, kind="revolute", axis="0 0 1", xyz="0 0 0.2", limit=LIMIT
) -> str:
    return (
        f"<link name='{child}'>{MASS}</link><joint name='{name}' type='{kind}'><parent link='{parent}'/>"
        f"<child link='{child}'/><origin xyz='{xyz}'/><axis xyz='{axis}'/><limit {limit}/></joint>"
    )


UPPER = (
    joint("torso", "base", "chest", kind="prismatic")
    + joint("pan", "chest", "head", xyz="0 0 0.5")
    + joint("l1", "chest", "l_arm", axis="0 1 0", xyz="0 0.2 0.3")
    + joint("l2", "l_arm", "l_tip", axis="0 1 0", xyz="0.3 0 0")
    + joint(
        "lf", "l_tip", "l_finger", kind="prismatic", limit="lower='0' upper='0.05' effort='9' velocity='1'"
    )
    + joint("r1", "chest", "r_arm", axis="1 0 0", xyz="0 -0.2 0.3")
)
UPPER_BLOCKS = {
    "articulated_trunk": {"trunk_joint_names": ["torso"]},
    "active_camera": {"camera_joint_names": ["pan"]},
    "manipulation": {
        "n_arms": 2,
        "arm_names": ["left", "right"],
        "arm_joint_names": {"left": ["l1", "l2"], "right": ["r1"]},
        "eef_link_names": {"left": "l_tip", "right": "r_arm"},
        "finger_joint_names": {"left": ["lf"]},
        "finger_link_names": {"left": ["l_finger"]},
        "gripper_link_names": {"left": ["l_tip", "l_finger"]},
        "arm_workspace_range": {"left": [-30, 90]},
        "teleop_rotation_offset": {"left": ["pi/2", 0, "pi/4"], "right": [0, 0, 1, 0]},
        "add_combined_arm_control_idx": True,
    },
}
ORDER = ["trunk", "camera", "arm_left", "gripper_left", "arm_right"]


@pytest.fixture
def torso() -> Robot:
    text = f"<robot name='torso'><link name='base'>{MASS}</link>{UPPER}</robot>"
    definition = {"raw_controller_order": ORDER, "default_controllers": {}, **UPPER_BLOCKS}
    return add_robot(World(), load_description(text), (0, 0, 1), definition=definition)


def test_groups_index_the_joints_of_their_part(torso: Robot) -> None:
    assert torso.joint_names == ("torso", "pan", "l1", "l2", "lf", "r1")
    assert {name: indices.tolist() for name, indices in torso.control_idx.items()} == {
        "trunk": [0],
        "camera": [1],
        "arm_left": [2, 3],
        "gripper_left": [4],
        "arm_right": [5],
        "combined": [2, 3, 5],
    }
    assert torso.controller_action_idx["arm_right"] == slice(5, 6)


def test_parts_report_their_own_positions_and_velocities(torso: Robot) -> None:
    torso.joint_positions = [0.1, 0.2, 0.3, 0.4, 0.05, 0.6]
    torso.joint_velocities = [1, 2, 3, 4, 5, 6]
    assert torso.trunk.joint_positions == pytest.approx([0.1])
    assert torso.camera.joint_velocities == pytest.approx([2])
    assert torso.trunk.tip.name == "chest"
    _, values = torso.proprioception()
    assert values["arm_left_qpos_cos"] == pytest.approx(np.cos([0.3, 0.4]))
    assert values["gripper_left_qvel"] == pytest.approx([5])
    assert values["camera_qpos_sin"] == pytest.approx(np.sin([0.2]))
    assert values["trunk_qvel"] == pytest.approx([1])
    assert values["grasp_right"] == pytest.approx([0.0])


def test_the_pose_of_an_end_effector_is_the_product_of_its_joints(torso: Robot) -> None:
    torso.joint_positions = {"torso": 0.15, "l1": 0.4, "l2": -1.1}
    first, both = Rotation.from_euler("y", 0.4), Rotation.from_euler("y", -0.7)
    position, quaternion = torso.arms["left"].pose_in_base
    assert position == pytest.approx(np.array([0, 0.2, 0.65]) + first.apply([0.3, 0, 0]))
    assert Rotation.from_quat(quaternion).as_matrix() == pytest.approx(both.as_matrix())
    assert torso.arms["left"].pose[0] == pytest.approx(position + np.array([0, 0, 1]))


def test_workspace_and_device_rotations_are_converted(torso: Robot) -> None:
    arms = torso.manipulation
    assert arms.workspace_range("left") == pytest.approx((-np.pi / 6, np.pi / 2))
    expected = Rotation.from_euler("xyz", [np.pi / 2, 0, np.pi / 4]).as_matrix()
    assert Rotation.from_quat(arms.teleop_rotation_offset("left")).as_matrix() == pytest.approx(expected)
    assert arms.teleop_rotation_offset("right") == pytest.approx([0, 0, 1, 0])
    assert [link.name for link in arms.gripper_links("left")] == ["l_tip", "l_finger"]
    assert [link.name for link in arms.finger_links()] == ["l_finger"]
    assert arms.finger_links("right") == ()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda arms: arms.workspace_range("right"),
            "has no manipulation.arm_workspace_range for 'right'; add it",
        ),
        (lambda arms: arms.gripper_links("right"), "has no manipulation.gripper_link_names for 'right'"),
        (lambda arms: arms.eef_pose("leftt"), "no arm named 'leftt'; did you mean 'left'"),
        (lambda arms: arms.eef_pose("left", frame="wrold"), "no frame named 'wrold'; did you mean 'world'"),
    ],
)
def test_arms_without_an_entry_are_named_in_errors(torso: Robot, call, message: str) -> None:
    with pytest.raises(RoboyardError, match=message):
        call(torso.manipulation)


def test_a_robot_without_postures_for_driving_cannot_be_tucked(torso: Robot) -> None:
    with pytest.raises(RoboyardError, match="has no tucked posture; add a mobile_manipulation block"):
        torso.tuck()


def test_joint_limits_have_defaults_where_the_file_has_none() -> None:
    zero, huge = "effort='0' velocity='0'", "lower='-1e6' upper='1e6' effort='1e11' velocity='1e6'"
    text = (
        f"<robot name='bare'><link name='base'>{MASS}</link>"
        + joint("turn", "base", "a", kind="continuous", limit=zero)
        + joint("slide", "base", "b", kind="prismatic", limit=f"lower='-1' upper='1' {zero}")
        + joint("wide", "base", "c", limit=huge)
        + joint("own", "base", "d")
        + "</robot>"
    )
    limits = add_robot(World(), load_description(text)).limits
    assert limits.velocity == pytest.approx([15.0, 1.0, 15.0, 3.0])
    assert limits.effort == pytest.approx([100.0, 100.0, 100.0, 50.0])
    assert limits.lower == pytest.approx([-np.inf, -1, -np.inf, -2])
    assert limits.upper == pytest.approx([np.inf, 1, np.inf, 2])


def holonomic() -> Robot:
    parts, above = "", "world_link"
    for name, axis in zip(VIRTUAL_JOINTS, ("1 0 0", "0 1 0", "0 0 1") * 2, strict=True):
        child = "base" if name == VIRTUAL_JOINTS[-1] else name.replace("joint", "link")
        kind = "revolute" if "_r" in name.removeprefix("base_footprint") else "prismatic"
        wide = "lower='-99' upper='99' effort='0' velocity='0'"
        parts += joint(name, above, child, kind=kind, axis=axis, xyz="0 0 0", limit=wide)
        above = child
    definition = {
        "raw_controller_order": ["base"],
        "default_controllers": {},
        "base_footprint_link_name": "base",
        "holonomic_base": {},
        "locomotion": {"base_joint_names": [VIRTUAL_JOINTS[k] for k in (0, 1, 5)]},
    }
    text = f"<robot name='holo'><link name='world_link'/>{parts}</robot>"
    turn = Rotation.from_euler("z", 0.7).as_quat()
    return add_robot(World(gravity=(0, 0, 0)), load_description(text), (1, 2, 0), turn, definition=definition)


@pytest.mark.parametrize("seed", range(4))
def test_a_holonomic_base_takes_any_pose_by_its_virtual_joints(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = holonomic()
    turn = Rotation.random(random_state=seed)
    place = rng.normal(size=3)
    root = robot.body.pose
    robot.set_pose(place, turn.as_quat())
    assert robot.position == pytest.approx(place)
    assert Rotation.from_quat(robot.orientation).as_matrix() == pytest.approx(turn.as_matrix())
    assert robot.body.pose[0] == pytest.approx(root[0])
    start = Rotation.from_euler("z", 0.7)
    angles = (start.inv() * turn).as_euler("XYZ")
    assert robot.base.joint_positions[3:] == pytest.approx(angles)
    assert robot.base.joint_positions[:3] == pytest.approx(start.inv().apply(place - [1, 2, 0]))


def test_velocities_of_a_tilted_holonomic_base_are_those_of_its_link() -> None:
    robot = holonomic()
    robot.set_pose((0, 0, 1), Rotation.from_euler("XYZ", [0.3, -0.2, 1.0]).as_quat())
    linear, angular = np.array([0.4, -0.1, 0.2]), np.array([0.1, 0.3, -0.5])
    robot.set_velocity(linear, angular)
    assert robot.velocity[0] == pytest.approx(linear)
    assert robot.velocity[1] == pytest.approx(angular)
    robot.set_velocity(angular=(0, 0, 0))
    assert robot.velocity[0] == pytest.approx(linear)


def test_limits_of_virtual_joints_are_those_of_a_driving_base() -> None:
    limits = holonomic().limits
    assert limits.velocity == pytest.approx([1.5, 1.5, 1.5, np.pi, np.pi, np.pi])
    assert limits.effort == pytest.approx(np.full(6, 1000.0))
    with pytest.raises(ConfigError, match="fixed_base must not be False for robot 'holo'"):
        robot = holonomic()
        add_robot(World(), robot.description, definition=robot.definition, fixed_base=False)


def test_a_base_frame_above_the_root_is_set_through_the_root(torso: Robot) -> None:
    definition = torso.definition.model_copy(update={"base_footprint_link_name": "chest"})
    robot = add_robot(World(), torso.description, definition=definition)
    robot.joint_positions = {"torso": 0.3}
    turn = Rotation.from_euler("xyz", [0.1, 0.2, 0.3])
    robot.set_pose((1, 2, 3), turn.as_quat())
    assert robot.position == pytest.approx([1, 2, 3])
    assert robot.link("chest").pose[0] == pytest.approx([1, 2, 3])
    assert robot.body.pose[0] == pytest.approx([1, 2, 3] - turn.apply([0, 0, 0.5]))
    assert robot.joint_positions[0] == pytest.approx(0.3)


def test_discrete_actions_need_a_differential_drive() -> None:
    robot = add_robot(World(), "rover", controllers={"base": "JointController"})
    with pytest.raises(RoboyardError, match=r"need a DifferentialDriveController .* has JointController"):
        robot.two_wheel.discrete_commands()


def test_odometry_of_a_rover_is_that_of_its_wheel_speeds() -> None:
    robot = add_robot(World(), "rover")
    robot.joint_velocities = {"left_wheel_joint": 2.0, "right_wheel_joint": 6.0}
    assert robot.two_wheel.odometry() == pytest.approx((4.0 * 0.075, 4.0 * 0.075 / 0.3))
    assert robot.proprioception()[1]["dd_base_ang_vel"] == pytest.approx([1.0])
    vector, _ = robot.proprioception()
    assert vector[:2] == pytest.approx([0.3, 1.0])


SENSORS = """<mujoco><worldbody><body name="head" pos="0 0 1"><geom size="0.1"/>
<camera name="eye" pos="0.1 0.2 0.3" quat="2 0 0 2"/><camera pos="1 0 0"/>
<site name="head_lidar" pos="0 0 0.2" quat="0.6 0 0.8 0"/><site name="marker"/>
<body name="mast"><geom size="0.1"/><site name="mast_lidar_1" pos="0 1 0"/><site name="head_lidar_copy"/>
</body></body></worldbody></mujoco>"""


def test_frames_of_sensors_are_those_that_mujoco_compiles(tmp_path: Path) -> None:
    file = tmp_path / "robot.xml"
    file.write_text(SENSORS)
    model = mujoco.MjModel.from_xml_path(str(file))
    cameras, lidars = camera_frames(file), lidar_frames(file)
    assert [(frame.name, frame.link) for frame in cameras] == [("eye", "head"), ("camera", "head")]
    assert [(frame.name, frame.link) for frame in lidars] == [
        ("head_lidar", "head"),
        ("mast_lidar_1", "mast"),
    ]
    for k, frame in enumerate(cameras):
        assert frame.position == pytest.approx(model.cam_pos[k])
        assert np.roll(frame.quaternion, 1) == pytest.approx(model.cam_quat[k])
    for frame in lidars:
        site = model.site(frame.name)
        assert frame.position == pytest.approx(site.pos)
        assert np.roll(frame.quaternion, 1) == pytest.approx(site.quat)
