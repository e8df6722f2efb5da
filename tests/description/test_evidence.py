"""Statements of `<gazebo>`, `<transmission>`, `<ros2_control>` and of an SRDF beside the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.description.evidence.read import read_evidence
from roboyard.description.evidence.srdf import find_srdf, load_srdf
from roboyard.description.loader import load_description
from roboyard.errors import DescriptionError

URDF = """
<robot name="armed">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="finger"/><link name="finger_2"/>
  <link name="eye"/><link name="eye_optical_frame"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/></joint>
  <joint name="grip" type="continuous"><parent link="lower"/><child link="finger"/></joint>
  <joint name="grip_2" type="continuous"><parent link="lower"/><child link="finger_2"/></joint>
  <joint name="eye_mount" type="fixed"><parent link="upper"/><child link="eye"/></joint>
  <joint name="eye_optical" type="fixed"><parent link="eye"/><child link="eye_optical_frame"/></joint>
  <transmission name="t"><joint name="shoulder"/><actuator name="m"/></transmission>
  <gazebo reference="eye">
    <sensor type="depth" name="eye_sensor">
      <pose>0.1 0 0 0 0 0</pose>
      <plugin filename="libcamera.so"><frameName>eye_optical_frame</frameName></plugin>
    </sensor>
  </gazebo>
  <gazebo reference="nowhere"><sensor type="imu" name="lost"/></gazebo>
  <sensor name="scan"><parent link="base"/><ray/></sensor>
  <gazebo>
    <plugin filename="libmimic_joint.so" name="m"><joint>shoulder</joint><mimicJoint>elbow</mimicJoint>
      <multiplier>-2</multiplier></plugin>
    <plugin filename="libgazebo_ros_diff_drive.so"><left_joint>shoulder</left_joint></plugin>
  </gazebo>
  <ros2_control name="all" type="system">
    <joint name="grip"><command_interface name="position"/></joint>
    <joint name="grip_2"><command_interface name="position"/><param name="mimic">grip</param>
      <param name="multiplier">-1</param></joint>
  </ros2_control>
</robot>
"""
SRDF = """
<robot name="armed">
  <group name="arm"><chain base_link="base" tip_link="lower"/></group>
  <group name="gripper"><joint name="grip"/><passive_joint name="x"/></group>
  <group name="everything"><group name="arm"/><group name="gripper"/><group name="everything"/></group>
  <end_effector name="hand" parent_link="lower" group="gripper" parent_group="arm"/>
  <group_state name="home" group="arm">
    <joint name="shoulder" value="0.5"/><joint name="elbow" value="x"/>
  </group_state>
  <passive_joint name="grip_2"/>
  <virtual_joint name="v" type="fixed" parent_frame="world" child_link="base"/>
  <disable_collisions link1="upper" link2="base"/><disable_collisions link1="base" link2="upper"/>
</robot>
"""


def test_simulator_blocks_state_sensors_plugins_actuators_and_followers():
    evidence = read_evidence(load_description(URDF))
    camera, lidar = evidence.sensors
    assert (camera.kind, camera.link, camera.frame_link) == ("camera", "eye", "eye_optical_frame")
    assert camera.pose.position == (0.1, 0.0, 0.0)
    assert (lidar.kind, lidar.link) == ("lidar", "base")
    assert evidence.actuated == ("shoulder", "grip")
    assert [(f.joint, f.leader, f.multiplier) for f in evidence.followers] == [
        ("elbow", "shoulder", -2.0),
        ("grip_2", "grip", -1.0),
    ]
    assert [plugin.kind for plugin in evidence.plugins] == ["mimic", "differential"]
    assert evidence.plugins[1].words["left_joint"] == ("shoulder",)
    assert evidence.srdf is None


@pytest.mark.parametrize("place", ["urdf/armed.srdf", "srdf/any.srdf", "config/any.srdf"])
def test_an_srdf_in_the_robots_package_is_found(tmp_path: Path, place: str):
    urdf = _write(tmp_path / "urdf" / "armed.urdf", URDF)
    file = _write(tmp_path / place, SRDF)
    srdf = read_evidence(load_description(urdf)).srdf
    assert srdf is not None and srdf.file == file
    groups = {group.name: group.joints for group in srdf.groups}
    assert groups == {
        "arm": ("shoulder", "elbow"),
        "gripper": ("grip",),
        "everything": ("shoulder", "elbow", "grip"),
    }
    assert srdf.end_effectors[0].parent_link == "lower"
    assert srdf.passive_joints == ("grip_2",)
    assert srdf.states == {"home": {"shoulder": 0.5}}
    assert srdf.disabled_pairs == (("base", "upper"),)
    assert srdf.virtual_joint_type == "fixed"


def test_an_srdf_of_a_moveit_configuration_beside_the_package_is_found(tmp_path: Path):
    urdf = _write(tmp_path / "armed_description" / "urdf" / "armed.urdf", URDF)
    for package in ("armed_description", "armed_moveit_config"):
        _write(tmp_path / package / "package.xml", f"<package><name>{package}</name></package>")
    _write(tmp_path / "armed_moveit_config" / "config" / "armed.srdf", SRDF)
    assert find_srdf(load_description(urdf)) is not None


def test_an_srdf_of_another_robot_and_a_broken_one_are_ignored(tmp_path: Path):
    urdf = _write(tmp_path / "armed.urdf", URDF)
    _write(tmp_path / "broken.srdf", "<robot><group")
    _write(tmp_path / "other.srdf", SRDF.replace('"grip', '"claw').replace('"lower', '"hand'))
    assert find_srdf(load_description(urdf)) is None


def test_an_srdf_behind_a_link_out_of_the_package_is_not_opened(tmp_path: Path):
    urdf = _write(tmp_path / "armed_files" / "armed.urdf", URDF)
    secret = _write(tmp_path / "elsewhere" / "armed.srdf", SRDF)
    (tmp_path / "armed_files" / "armed.srdf").symlink_to(secret)
    assert find_srdf(load_description(urdf)) is None


def test_a_file_that_is_no_srdf_is_refused(tmp_path: Path):
    file = _write(tmp_path / "a.srdf", "<sdf/>")
    with pytest.raises(DescriptionError, match="give an SRDF"):
        load_srdf(file, load_description(URDF))


def _write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path
