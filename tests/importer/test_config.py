"""Source configurations: each contradiction is named by its line, its key and the names involved."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

from roboyard.errors import ConfigError
from roboyard.importer.config.load import audit_config, check_data, load_config

ROBOT = """<robot name="cart">
<link name="base"><inertial><mass value="5"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
</link>{links}
<joint name="left" type="continuous"><parent link="base"/><child link="left_wheel"/><axis xyz="0 1 0"/>
</joint>
<joint name="right" type="continuous"><parent link="base"/><child link="right_wheel"/><axis xyz="0 1 0"/>
</joint>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="0" upper="0.5" effort="50" velocity="1"/></joint>
<joint name="mount" type="fixed"><parent link="arm"/><child link="tool"/></joint>
<joint name="ball" type="floating"><parent link="base"/><child link="loose"/></joint>
</robot>""".format(
    links="".join(f'<link name="{name}"/>' for name in ("left_wheel", "right_wheel", "arm", "tool", "loose"))
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "cart.urdf").write_text(ROBOT)
    return tmp_path


def written(folder: Path, text: str) -> Path:
    file = folder / "cart.yaml"
    file.write_text(f"urdf_path: cart.urdf\nname: cart\n{text}")
    return file


def test_a_minimal_configuration_has_no_problem(folder: Path) -> None:
    assert audit_config(written(folder, "")) == []
    loaded = load_config(written(folder, ""))
    assert loaded.urdf == folder / "cart.urdf" and loaded.config.name == "cart" and loaded.has_config


PROBLEMS = {
    "unknown key": ("wheels: [left]\n", 3, "wheels", ()),
    "misspelt nested key": (
        "base_motion:\n  wheel_linkz: [left_wheel]\n",
        4,
        "base_motion.wheel_linkz",
        ("wheel_links",),
    ),
    "unknown wheel link": (
        "base_motion:\n  wheel_links:\n  - left_wheel\n  - left_wheal\n",
        6,
        "base_motion.wheel_links[1]",
        ("left_wheal", "left_wheel"),
    ),
    "unknown wheel joint": (
        "base_motion:\n  wheel_joints: [lefty]\n",
        4,
        "base_motion.wheel_joints[0]",
        ("lefty", "left"),
    ),
    "floating joint as wheel": (
        "base_motion:\n  wheel_joints: [ball]\n",
        4,
        "base_motion.wheel_joints[0]",
        ("ball", "floating"),
    ),
    "link repeated": ("base_motion:\n  wheel_links: [arm, arm]\n", 4, "base_motion.wheel_links", ("arm",)),
    "unknown collision link": (
        "collision:\n  coacd_links: [armm]\n",
        4,
        "collision.coacd_links[0]",
        ("armm", "arm"),
    ),
    "too many hulls": ("collision:\n  hull_count: 5000\n", 4, "collision.hull_count", ("512",)),
    "hulls as text": ("collision:\n  hull_count: many\n", 4, "collision.hull_count", ("many",)),
    "unknown method": (
        "collision:\n  decompose_method: vhacd\n",
        4,
        "collision.decompose_method",
        ("vhacd", "coacd"),
    ),
    "camera on no link": (
        "camera_links:\n- {link: eye}\n",
        4,
        "camera_links[0].link",
        ("eye", "parent_link"),
    ),
    "camera below no link": (
        "camera_links:\n- {link: eye, parent_link: head}\n",
        4,
        "camera_links[0].parent_link",
        ("head",),
    ),
    "camera made twice": (
        "camera_links:\n- {link: eye, parent_link: arm}\nlidar_links:\n- {link: eye, parent_link: arm}\n",
        6,
        "lidar_links[0].link",
        ("eye", "camera_links[0]"),
    ),
    "two cameras on a link": (
        "camera_links:\n- {link: arm}\n- {link: arm}\n",
        5,
        "camera_links[1].link",
        ("arm",),
    ),
    "new link of a taken name": (
        "lidar_links:\n- {link: tool, parent_link: arm}\n",
        4,
        "lidar_links[0].link",
        ("tool", "parent_link"),
    ),
    "quaternion of three numbers": (
        "camera_links:\n- {link: arm, offset: {orientation: [0, 0, 1]}}\n",
        4,
        "camera_links[0].offset.orientation",
        (),
    ),
    "quaternion of length zero": (
        "camera_links:\n- {link: arm, offset: {orientation: [0, 0, 0, 0]}}\n",
        4,
        "camera_links[0].offset.orientation",
        (),
    ),
    "end effector that is no link": (
        "curobo:\n  eef_to_gripper_info:\n    hand: {links: [], joints: []}\n",
        5,
        "curobo.eef_to_gripper_info.hand",
        ("hand",),
    ),
    "gripper joint that is none": (
        "curobo:\n  eef_to_gripper_info:\n    tool: {links: [tool], joints: [finger]}\n",
        5,
        "curobo.eef_to_gripper_info.tool.joints[0]",
        ("finger",),
    ),
    "locked joint that is none": (
        "curobo:\n  lock_joints: {torso: 0.1}\n",
        4,
        "curobo.lock_joints.torso",
        ("torso",),
    ),
    "spheres of no link": (
        "curobo:\n  collision_spheres:\n    leg: [{center: [0, 0, 0], radius: 0.1}]\n",
        5,
        "curobo.collision_spheres.leg",
        ("leg",),
    ),
    "sphere of no size": (
        "curobo:\n  collision_spheres:\n    arm: [{center: [0, 0, 0], radius: 0}]\n",
        5,
        "curobo.collision_spheres.arm[0].radius",
        ("0",),
    ),
    "ignored link that is none": (
        "curobo:\n  self_collision_ignore:\n    arm: [tol]\n",
        5,
        "curobo.self_collision_ignore.arm[0]",
        ("tol", "tool"),
    ),
    "posture of another length": ("curobo:\n  default_qpos: [0, 0]\n", 4, "curobo.default_qpos", ("2", "3")),
    "posture of no joint": (
        "curobo:\n  default_qpos: {lifft: 0.1}\n",
        4,
        "curobo.default_qpos.lifft",
        ("lifft", "lift"),
    ),
    "posture beyond a limit": (
        "curobo:\n  default_qpos: {lift: 0.7}\n",
        4,
        "curobo.default_qpos.lift",
        ("0.7", "0.5"),
    ),
    "posture that is not finite": (
        "curobo:\n  default_qpos: {lift: .nan}\n",
        4,
        "curobo.default_qpos.lift",
        (),
    ),
    "a key twice": ("headless: true\nheadless: false\n", 4, "headless", ()),
}


@pytest.mark.parametrize("case", PROBLEMS)
def test_a_problem_is_named_with_its_line_and_key(folder: Path, case: str) -> None:
    text, line, key, words = PROBLEMS[case]
    found = audit_config(written(folder, text))
    fitting = [problem for problem in found if problem.startswith(f"cart.yaml:{line}:") and key in problem]
    assert fitting, found
    for word in words:
        assert word in fitting[0]


@pytest.mark.parametrize(
    "case", ["unknown wheel link", "too many hulls", "camera below no link", "a key twice"]
)
def test_what_an_audit_finds_an_import_refuses(folder: Path, case: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(PROBLEMS[case][2])):
        load_config(written(folder, PROBLEMS[case][0]))


NOTES = {
    "sphere wheels without wheels": ("base_motion:\n  use_sphere_wheels: true\n", "use_sphere_wheels"),
    "a link in two lists": ("collision:\n  coacd_links: [arm]\n  convex_links: [arm]\n", "convex_links[0]"),
}


@pytest.mark.parametrize("case", NOTES)
def test_odd_but_usable_settings_are_notes(folder: Path, case: str) -> None:
    text, key = NOTES[case]
    loaded = load_config(written(folder, text))
    assert len(loaded.notes) == 1 and key in loaded.notes[0]


def test_problems_of_values_and_of_names_are_reported_together(folder: Path) -> None:
    text = "collision:\n  hull_count: 0\nbase_motion:\n  wheel_links: [wheel]\n"
    text += "curobo:\n  torso_joints: [waist]\n"
    found = audit_config(written(folder, text))
    keys = ("collision.hull_count", "base_motion.wheel_links[0]", "curobo.torso_joints[0]")
    assert [any(key in problem for problem in found) for key in keys] == [True] * 3
    lines = [int(problem.split(":")[1]) for problem in found]
    assert lines == sorted(lines)


@pytest.mark.parametrize("text", ["", "just text", "- a\n- b\n", "{"])
def test_a_file_that_is_no_mapping_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "odd.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"odd\.yaml"):
        load_config(file)
    assert len(audit_config(file)) >= 1


@pytest.mark.parametrize("missing", ["urdf_path", "name"])
def test_the_two_needed_keys_are_asked_for(folder: Path, missing: str) -> None:
    file = folder / "cart.yaml"
    data = {"urdf_path": "cart.urdf", "name": "cart"}
    del data[missing]
    file.write_text(yaml.safe_dump(data))
    with pytest.raises(ConfigError, match=missing):
        load_config(file)


@pytest.mark.parametrize("name", ["", "a/b", "..", "two words"])
def test_names_that_name_no_folder_or_prim_are_refused(folder: Path, name: str) -> None:
    with pytest.raises(ConfigError, match="name"):
        check_data({"urdf_path": str(folder / "cart.urdf"), "name": name})


def test_a_missing_or_broken_urdf_is_named(folder: Path) -> None:
    with pytest.raises(ConfigError, match=r"urdf_path.*none\.urdf"):
        check_data({"urdf_path": str(folder / "none.urdf"), "name": "cart"})
    (folder / "cart.urdf").write_text("<robot name='x'><link name='a'/><link name='b'/></robot>")
    with pytest.raises(ConfigError, match="urdf_path"):
        load_config(written(folder, ""))


def test_overrides_replace_keys_of_the_file(folder: Path) -> None:
    loaded = load_config(
        written(folder, "overwrite: false\n"), overrides={"name": "wagon", "overwrite": True}
    )
    assert loaded.config.name == "wagon" and loaded.config.overwrite


def test_empty_sections_mean_their_defaults(folder: Path) -> None:
    loaded = load_config(written(folder, "base_motion:\ncollision:\ncurobo:\ncamera_links:\n"))
    assert loaded.config.base_motion.wheel_links == [] and loaded.config.camera_links == []
    assert loaded.config.collision.hull_count == 8
