"""Contradictions in definition files: one message each, with file, line and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.description import load_description
from roboyard.errors import ConfigError
from roboyard.robots import load_definition, parse_definition
from roboyard.robots.definition.names import joint_names, link_names

ARM = """raw_controller_order: [arm_0, gripper_0]
default_controllers:
  arm_0: JointController
default_joint_pos: [0, 0, 0]
disabled_collision_pairs:
  - [base, tip]
manipulation:
  arm_joint_names:
    "0": [a, b]
  eef_link_names:
    "0": tip
  finger_joint_names:
    "0": [f]
  finger_link_names:
    "0": [finger]
  assisted_grasp_start_points:
    "0":
      - [finger, [0, 0, pi/100]]
"""
WHEELS = """raw_controller_order: [base]
default_controllers: {}
two_wheel:
  wheel_radius: 0.1
  wheel_axle_length: 0.4
locomotion:
  base_joint_names: [left, right]
"""
HEAD = """raw_controller_order: [trunk, camera]
default_controllers: {}
articulated_trunk:
  trunk_joint_names: [torso]
active_camera:
  camera_joint_names: [pan, tilt]
mobile_manipulation:
  untucked_default_joint_pos: [0, 0, 0]
  tucked_default_joint_pos: [1, 1, 1]
  default_arm_pose_key: wide
  default_arm_poses:
    wide: [0, 0]
"""
VARIANT = """  supported_end_effector: [hook]
  end_effectors:
    {name}:
      model: hooked
      eef_link_names: {{"{arm}": hook}}
      finger_link_names: {{}}
      finger_joint_names: {{}}
      default_joint_pos: [0, 0]
"""
CASES = [
    (
        ARM,
        "[arm_0, gripper_0]",
        "[arm_0, arm_0, gripper_0]",
        1,
        "raw_controller_order[1]: 'arm_0' is listed twice",
    ),
    (
        ARM,
        "[arm_0, gripper_0]",
        "[arm_0]",
        1,
        "raw_controller_order: the group 'gripper_0' is missing; add it",
    ),
    (
        ARM,
        "gripper_0]",
        "gripper_0, trunk]",
        0,
        "articulated_trunk: is missing: raw_controller_order has 'trunk'",
    ),
    (
        ARM,
        "gripper_0]",
        "gripper_0, camera]",
        0,
        "active_camera: is missing: raw_controller_order has 'camera'",
    ),
    (ARM, "gripper_0]", "gripper_0, tail]", 1, "raw_controller_order[2]: no block defines a group 'tail'"),
    (ARM, "  arm_0: J", "  arm_0: Null", 3, "default_controllers.arm_0: must be one of"),
    (ARM, "arm_0: JointController", "arm_0: DifferentialDriveController", 3, "'arm_0' cannot have a Diff"),
    (ARM, "  arm_0: J", "  arm_1: J", 3, "no block defines a group 'arm_1'; did you mean 'arm_0'?"),
    (ARM, '"0": [a, b]', '"0": []', 9, "manipulation.arm_joint_names.0: is empty; list the arm's joints"),
    (ARM, '"0": [a, b]', '"0": [a, b, a]', 9, "manipulation.arm_joint_names.0[2]: 'a' is listed twice"),
    (ARM, '"0": tip', '"0": tip\n    "1": tip', 12, "eef_link_names.1: there is no arm '1'"),
    (ARM, '"0": [finger]', '"1": [finger]', 15, "finger_link_names.1: there is no arm '1'"),
    (
        ARM,
        "manipulation:",
        "manipulation:\n  arm_names: [x]",
        8,
        "arm_names[0]: 'x': no other field has such",
    ),
    (ARM, "manipulation:", 'manipulation:\n  arm_names: ["0", "0"]', 8, "arm_names: lists '0' twice"),
    (ARM, "manipulation:", "manipulation:\n  n_arms: 65", 8, "manipulation.n_arms: "),
    (ARM, "[base, tip]", "[base, tip, tip]", 6, "disabled_collision_pairs[0]: must have 2 entries"),
    (ARM, "pi/100]]", "tau]]", 18, "assisted_grasp_start_points.0[0][1][2]: 'tau' is not a number"),
    (
        WHEELS,
        "wheel_radius: 0.1",
        "wheel_radius: -0.1",
        4,
        "two_wheel.wheel_radius: must be a positive length (m)",
    ),
    (WHEELS, "  wheel_axle_length: 0.4\n", "", 3, "two_wheel.wheel_axle_length: must be a positive length"),
    (
        WHEELS,
        "[left, right]",
        "[left]",
        7,
        "base_joint_names: must list two joints with two_wheel, left then right, got 1",
    ),
    (
        WHEELS,
        "locomotion:\n  base_joint_names: [left, right]\n",
        "",
        0,
        "locomotion: is required with two_wheel",
    ),
    (HEAD, "[torso]", "[]", 4, "articulated_trunk.trunk_joint_names: is empty; list the torso's joints"),
    (HEAD, "[pan, tilt]", "[]", 6, "active_camera.camera_joint_names: is empty; list the head's joints"),
    (
        HEAD,
        "[1, 1, 1]",
        "[1, 1]",
        9,
        "tucked_default_joint_pos: has 2 values but untucked_default_joint_pos has 3",
    ),
    (HEAD, "key: wide", "key: wid", 10, "no default_arm_poses named 'wid'; did you mean 'wide'?"),
    (HEAD, "key: wide", "key: wide\n  joint_names: [pan]", 11, "joint_names: has 1 names for 3 values"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "line", "message"), CASES, ids=[case[4][:45] for case in CASES]
)
def test_a_contradiction_is_one_line_at_its_field(
    tmp_path: Path, text: str, old: str, new: str, line: int, message: str
) -> None:
    load_definition(write(tmp_path, text))
    assert old in text
    with pytest.raises(ConfigError) as error:
        load_definition(write(tmp_path, text.replace(old, new, 1)))
    (only,) = str(error.value).splitlines()
    assert message in only
    assert only.startswith(f"bot.yaml:{line}: " if line else "bot.yaml: ")


def write(folder: Path, text: str) -> Path:
    file = folder / "bot.yaml"
    file.write_text(text)
    return file


@pytest.mark.parametrize(
    ("name", "arm", "message"),
    [
        ("claw", "0", "end_effectors.claw: 'claw' is not in supported_end_effector; add it there"),
        ("hook", "1", "end_effectors.hook.eef_link_names.1: there is no arm '1'"),
        ("hook", "0", ""),
    ],
)
def test_variants_belong_to_the_arms_and_names_of_the_definition(name: str, arm: str, message: str) -> None:
    text = ARM + VARIANT.format(name=name, arm=arm)
    if not message:
        assert parse_definition(text).manipulation.end_effectors["hook"].model == "hooked"
        return
    with pytest.raises(ConfigError) as error:
        parse_definition(text)
    assert message in str(error.value)


def test_several_contradictions_are_listed_in_one_error() -> None:
    text = ARM.replace("[a, b]", "[]").replace("arm_0: J", "arm_9: J").replace("gripper_0]", "gripper_0, x]")
    with pytest.raises(ConfigError) as error:
        parse_definition(text)
    keys = [line.split(": ")[1] for line in str(error.value).splitlines()]
    assert sorted(keys) == [
        "default_controllers.arm_9",
        "manipulation.arm_joint_names.0",
        "raw_controller_order[2]",
    ]


def test_an_arm_without_fingers_needs_no_gripper_in_the_order() -> None:
    text = ARM.replace(", gripper_0]", "]").replace('  finger_joint_names:\n    "0": [f]\n', "")
    assert list(parse_definition(text).controller_names()) == ["arm_0"]


def test_inverse_kinematics_needs_a_rest_posture() -> None:
    text = ARM.replace("arm_0: JointController", "arm_0: OperationalSpaceController")
    parse_definition(text)
    with pytest.raises(
        ConfigError, match="default_joint_pos: is required because 'arm_0' has an Operational"
    ):
        parse_definition(text.replace("default_joint_pos: [0, 0, 0]\n", ""))


LINKS = ("base", "one", "tip", "finger")
JOINTS = (("a", "base", "one"), ("b", "one", "tip"), ("f", "tip", "finger"))
URDF = (
    "<robot name='bot'>"
    + "".join(f"<link name='{name}'/>" for name in LINKS)
    + "".join(
        f"<joint name='{name}' type='prismatic'><parent link='{parent}'/><child link='{child}'/>"
        "<limit lower='0' upper='1' effort='1' velocity='1'/></joint>"
        for name, parent, child in JOINTS
    )
    + "</robot>"
)


def test_a_definition_that_fits_its_robot_has_no_problem() -> None:
    parse_definition(ARM, load_description(URDF))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[a, b]", "[a, c]", "arm_joint_names.0[1]: the robot has no moving joint 'c'"),
        ('"0": tip', '"0": tipp', "eef_link_names.0: the robot has no link 'tipp'; did you mean 'tip'?"),
        ("[base, tip]", "[base, top]", "disabled_collision_pairs[0][1]: the robot has no link 'top'"),
        ("- [finger,", "- [fingr,", "assisted_grasp_start_points.0[0][0]: the robot has no link 'fingr'"),
        ("[0, 0, 0]", "[0, 0]", "default_joint_pos: has 2 values; the robot has 3 joints (a, b, f)"),
    ],
)
def test_names_and_lengths_that_do_not_fit_the_robot(old: str, new: str, message: str) -> None:
    with pytest.raises(ConfigError) as error:
        parse_definition(ARM.replace(old, new, 1), load_description(URDF))
    (only,) = str(error.value).splitlines()
    assert message in only


def test_every_link_and_joint_name_is_listed_with_its_place() -> None:
    definition = parse_definition(ARM)
    found = {name: where for where, name in [*link_names(definition), *joint_names(definition)]}
    assert set(found) == {"base", "tip", "finger", "a", "b", "f"}
    assert found["b"] == ("manipulation", "arm_joint_names", "0", 1)
    assert found["finger"] == ("manipulation", "assisted_grasp_start_points", "0", 0, 0)
