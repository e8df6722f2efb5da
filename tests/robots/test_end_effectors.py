"""One arm with several grippers, each with its own joints, posture and file."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from roboyard.assets import asset_path
from roboyard.errors import ConfigError
from roboyard.robots import add_robot
from roboyard.sim import World

HAND = """
  <link name="palm">
    <inertial>
      <mass value="0.2"/><inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
    </inertial>
    <collision><geometry><sphere radius="0.03"/></geometry></collision>
  </link>
  <joint name="palm_joint" type="fixed">
    <parent link="tool"/><child link="palm"/><origin xyz="0 0 0.05"/>
  </joint>
  <link name="finger">
    <inertial>
      <mass value="0.05"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/>
    </inertial>
    <collision><geometry><sphere radius="0.02"/></geometry></collision>
  </link>
  <joint name="finger_joint" type="prismatic">
    <parent link="palm"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.04" effort="20" velocity="0.2"/>
  </joint>
</robot>
"""
DEFINITION = """
raw_controller_order: [arm_0, gripper_0]
default_controllers: {arm_0: InverseKinematicsController, gripper_0: MultiFingerGripperController}
default_joint_pos: [0, 0.5, 0, -1, 0, 0.5, 0]
manipulation:
  arm_joint_names: {"0": [joint1, joint2, joint3, joint4, joint5, joint6, joint7]}
  eef_link_names: {"0": tool}
  supported_end_effector: [bare, pinch, other, soft]
  end_effectors:
    bare: &bare
      model: changer
      eef_link_names: {"0": tool}
      finger_link_names: {}
      finger_joint_names: {}
      default_joint_pos: [0, 0.5, 0, -1, 0, 0.5, 0]
    pinch: &pinch
      model: changer_pinch
      eef_link_names: {"0": palm}
      finger_link_names: {"0": [finger]}
      finger_joint_names: {"0": [finger_joint]}
      default_joint_pos: [0, 0.4, 0, -1.1, 0, 0.6, 0, 0.02]
      disabled_collision_pairs: [[palm, finger]]
      teleop_rotation_offset: {"0": [0, 0, pi/2]}
      urdf_path: models/changer/urdf/changer_pinch.urdf
"""


@pytest.fixture
def changer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Data folder with the robot; returns its definition."""
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path))
    models = tmp_path / "mine" / "models"
    arm = asset_path("arm7").read_text()
    with_hand = re.sub(r"</robot>\s*$", HAND, arm)
    for name, files in {
        "changer": {"changer": arm, "changer_pinch": with_hand},
        "changer_other": {"changer_other": with_hand},
    }.items():
        shutil.copytree(asset_path("arm7").parent / "meshes", models / name / "urdf" / "meshes")
        for stem, text in files.items():
            (models / name / "urdf" / f"{stem}.urdf").write_text(text)
    text = DEFINITION
    pinch = text[text.index("    pinch: &pinch\n") :]
    other = pinch.replace("pinch: &pinch", "other:").replace("changer_pinch", "changer_other")
    text += "".join(line for line in other.splitlines(keepends=True) if "urdf_path" not in line)
    text += other.replace("other:", "soft:") + "      not_support_urdf: true\n"
    file = models / "changer" / "changer.yaml"
    file.write_text(text.replace("&bare", "").replace("&pinch", ""))
    return file


def test_the_definition_is_the_default(changer: Path) -> None:
    robot = add_robot(World(), "changer")
    assert robot.n_dof == 7
    assert list(robot.groups) == ["arm_0"]  # an arm without fingers has no gripper
    assert robot.model == "changer"


@pytest.mark.parametrize("hand", ["pinch", "other"])
def test_a_gripper_variant_has_its_links_joints_posture_and_file(changer: Path, hand: str) -> None:
    world = World()
    robot = add_robot(world, "changer", end_effector=hand)
    assert robot.model == f"changer_{hand}"
    assert robot.joint_names[-1] == "finger_joint"
    assert list(robot.groups) == ["arm_0", "gripper_0"]
    assert robot.joint_positions == pytest.approx([0, 0.4, 0, -1.1, 0, 0.6, 0, 0.02])
    assert robot.manipulation.eef_links["0"].name == "palm"
    assert robot.manipulation.teleop_rotation_offset() == pytest.approx([0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    assert not world.contacts(robot.body, robot.body)  # palm and finger overlap, and may
    palm = robot.arms["0"].pose_in_base[0]
    for _ in range(60):
        robot.apply_action({"arm_0": [0, 0, 0.2, 0, 0, 0], "gripper_0": [1.0]})
        world.step(8)
    assert robot.arms["0"].pose_in_base[0][2] > palm[2] + 0.05
    assert robot.joint_positions[-1] == pytest.approx(0.04, abs=1e-3)


def test_unavailable_gripper_variants_are_refused(changer: Path) -> None:
    with pytest.raises(ConfigError, match="no end effector named 'pinhc'; did you mean 'pinch'"):
        add_robot(World(), "changer", end_effector="pinhc")
    with pytest.raises(ConfigError, match="'soft' has no URDF"):
        add_robot(World(), "changer", end_effector="soft")
    changer.write_text(changer.read_text().replace('{"0": palm}', '{"0": plam}'))
    with pytest.raises(
        ConfigError,
        match=r"changer\.yaml:\d+: manipulation\.end_effectors\.pinch\.eef_link_names\.0: .* no link 'plam'",
    ):
        add_robot(World(), "changer", end_effector="pinch")
