"""The members that `Body` and `Robot` share, and the robots that `add_robot` takes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.assets import asset_path
from roboyard.description import load_description
from roboyard.description.robot_model import RobotModel
from roboyard.errors import ConfigError, RoboyardError
from roboyard.kinematics.joint_order import breadth_first_joint_names
from roboyard.morphology.analyze import infer_semantics
from roboyard.robots import Robot, add_robot
from roboyard.robots.definition.from_description import default_definition
from roboyard.robots.definition.schema import VIRTUAL_JOINTS
from roboyard.sim import World
from roboyard.transforms import quaternion_from_rpy
from roboyard.validation import validate

SHARED = [
    "name",
    "links",
    "joints",
    "link",
    "joint",
    "joint_names",
    "joint_positions",
    "joint_velocities",
    "joint_efforts",
    "joint_limits",
    "pose",
    "position",
    "orientation",
    "velocity",
    "set_pose",
    "set_velocity",
    "mass",
]
BRANCHED = """
<robot name="branched">
  <link name="base"/>
  <link name="left"/><link name="left_tip"/><link name="right"/><link name="right_tip"/>
  {joints}
</robot>
"""


def joint(name: str, parent: str, child: str) -> str:
    return (
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="2"/></joint>'
    )


@pytest.fixture
def branched(tmp_path: Path) -> Path:
    """A robot whose depth-first and breadth-first joint orders differ."""
    joints = [
        ("a", "base", "left"),
        ("b", "left", "left_tip"),
        ("c", "base", "right"),
        ("d", "right", "right_tip"),
    ]
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    text = BRANCHED.format(joints="".join(joint(*entry) for entry in joints))
    for link in ("base", "left", "left_tip", "right", "right_tip"):
        text = text.replace(f'<link name="{link}"/>', f'<link name="{link}">{mass}</link>')
    file = tmp_path / "branched.urdf"
    file.write_text(text)
    return file


def test_body_and_robot_share_their_members(branched: Path) -> None:
    robot = add_robot(World(), branched)
    for member in SHARED:
        assert hasattr(robot, member), member
        assert hasattr(robot.body, member), member
    assert robot.joint_names == robot.body.joint_names == ("a", "b", "c", "d")
    robot.joint_positions = {"b": 0.25, "d": -0.5}
    assert robot.joint_positions.tolist() == robot.body.joint_positions.tolist() == [0.0, 0.25, 0.0, -0.5]
    robot.joint_velocities = [0.1, 0.2, 0.3, 0.4]
    assert robot.body.joint_velocities.tolist() == [0.1, 0.2, 0.3, 0.4]
    assert np.array_equal(robot.joint_limits, robot.body.joint_limits)
    robot.world.step()
    assert np.array_equal(robot.joint_efforts, robot.body.joint_efforts)
    assert robot.link("left").name == "left" and robot.joint("a").child is robot.link("left")
    assert robot.mass == robot.body.mass == pytest.approx(5.0)
    robot.set_pose((1.0, 2.0, 3.0), quaternion_from_rpy((0, 0, 0.5)))
    assert np.array_equal(robot.position, robot.body.position)
    assert np.array_equal(robot.orientation, robot.body.orientation)


def test_postures_of_a_file_are_converted_by_name(branched: Path) -> None:
    names = breadth_first_joint_names(load_description(branched))
    assert names == ("a", "c", "b", "d")
    definition = {
        "raw_controller_order": ["trunk"],
        "default_controllers": {"trunk": "JointController"},
        "articulated_trunk": {"trunk_joint_names": ["a", "b", "c", "d"]},
        "default_joint_pos": [0.1, 0.3, 0.2, 0.4],
        "mobile_manipulation": {
            "tucked_default_joint_pos": [-0.1, -0.3, -0.2, -0.4],
            "untucked_default_joint_pos": [0, 0, 0, 0],
        },
    }
    robot = add_robot(World(), branched, definition=definition)
    assert robot.joint_positions.tolist() == robot.reset_joint_pos.tolist() == [0.1, 0.2, 0.3, 0.4]
    robot.tuck()
    assert robot.joint_positions.tolist() == [-0.1, -0.2, -0.3, -0.4]
    robot = add_robot(World(), branched, definition=definition, reset_joint_pos=[0.4, 0.3, 0.2, 0.1])
    assert robot.joint_positions.tolist() == [0.4, 0.3, 0.2, 0.1]
    with pytest.raises(ConfigError, match=r"reset_joint_pos must be 4 finite numbers .* got \[1\.0\]"):
        add_robot(World(), branched, definition=definition, reset_joint_pos=[1.0])


@pytest.mark.parametrize(
    ("name", "groups"),
    [
        ("arm7", {"arm_0": "JointController"}),
        ("rover", {"base": "DifferentialDriveController"}),
        ("husky", {"base": "DifferentialDriveController"}),
        ("cartpole", {"trunk": "JointController"}),
    ],
)
def test_a_file_without_a_definition_gets_controllers_for_all_driven_joints(name: str, groups: dict) -> None:
    description = load_description(asset_path(name))
    assert default_definition(description).controller_names() == groups
    world = World()
    world.add_plane()
    robot = add_robot(world, asset_path(name), (0, 0, 0.5))
    driven = {robot.joint_names[i] for i in robot.joint_arrays.driven}
    assert {joint for group in robot.groups.values() for joint in group.joints} == driven
    robot.apply_action(robot.no_op_action())
    world.step(robot.steps_per_control)
    assert np.isfinite(robot.joint_positions).all()


def test_the_default_definition_of_r1_has_its_arms_grippers_and_base() -> None:
    """The same groups of joints as in R1's own definition, found by shape alone."""
    description = load_description(asset_path("r1/urdf/r1.urdf"))
    found = default_definition(description)
    assert found.controller_names()["base"] == "HolonomicBaseJointController"
    assert found.articulated_trunk is not None and found.manipulation is not None
    assert found.articulated_trunk.trunk_joint_names == tuple(f"torso_joint{k}" for k in (1, 2, 3, 4))
    arms = set(found.manipulation.arm_joint_names.values())
    assert arms == {tuple(f"{side}_arm_joint{k}" for k in range(1, 7)) for side in ("left", "right")}
    assert not set(VIRTUAL_JOINTS) & {name for joints in arms for name in joints}


def test_descriptions_and_models_are_robots_too(branched: Path) -> None:
    description = load_description(branched)
    model = RobotModel(name="two_arms", description=description, semantic=infer_semantics(description))
    world = World()
    assert add_robot(world, description).name == "branched"
    assert add_robot(world, model, (2, 0, 0)).name == "two_arms"


def test_self_collision_given_by_the_caller_overrides_the_definition(branched: Path) -> None:
    definition = {
        "raw_controller_order": ["trunk"],
        "default_controllers": {},
        "articulated_trunk": {"trunk_joint_names": ["a", "b", "c", "d"]},
        "self_collisions": False,
    }
    text = branched.read_text().replace(
        "<inertial>", '<collision><geometry><sphere radius="0.1"/></geometry></collision><inertial>'
    )
    branched.write_text(text)

    def contacts(**options: bool) -> int:
        world = World()
        robot = add_robot(world, branched, definition=definition, **options)
        world.detect_contacts()
        return len(list(world.contacts(robot.body, robot.body)))

    assert contacts() == 0
    assert contacts(self_collision=True) > 0
    assert contacts(self_collision=False) == 0


def test_wrong_values_are_refused_and_quoted(branched: Path) -> None:
    robot = add_robot(World(), branched)
    for wrong, message in (
        ({"joint_positions": [0.0, 1.0]}, r"joint_positions must be 4 numbers, got shape \(2,\)"),
        ({"joint_positions": {"z": 0.0}}, "no joint named 'z'"),
        ({"joint_velocities": [0, 0, 0, np.nan]}, "joint_velocities must be finite"),
    ):
        with pytest.raises(RoboyardError, match=message):
            for key, value in wrong.items():
                setattr(robot, key, value)
    with pytest.raises(RoboyardError, match="position must be 3 finite numbers, got"):
        robot.set_pose((1.0, 2.0))
    with pytest.raises(RoboyardError, match="fixed base"):
        robot.set_velocity((1.0, 0, 0))
    assert dict(robot.arms) == {}
    with pytest.raises(RoboyardError, match="no arm named 'left'"):
        robot.arms["left"]


def test_velocity_in_the_base_frame_is_the_rotated_one() -> None:
    world = World()
    robot: Robot = add_robot(world, "rover", (0, 0, 0.1), quaternion_from_rpy((0, 0, np.pi / 2)))
    robot.set_velocity((1.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    linear, angular = robot.velocity_in_base
    assert linear == pytest.approx([0.0, -1.0, 0.0], abs=1e-9)
    assert angular == pytest.approx([0.0, 0.0, 0.5])
    robot.stop()
    assert np.abs(np.concatenate(robot.velocity)).max() < 1e-12


def test_a_file_without_a_definition_is_validated() -> None:
    report = validate(asset_path("arm7"), gates=["limits", "self_collision"])
    assert report.robot == "arm7" and report.passed
