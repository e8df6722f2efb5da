"""cuRobo configurations and XRDF, read as plain YAML."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from roboyard.description import Joint, Link, RobotDescription
from roboyard.description.robot_model import PlanningData, RobotModel
from roboyard.description.semantic import REST, EndEffector, SemanticDescription
from roboyard.export import curobo, xrdf

ORDER = ["0", "1", "slide", "spin", "grip", "grip_follower"]


def load(path: Path) -> Any:
    text = path.read_text()
    assert text.isascii()
    return yaml.safe_load(text)


@pytest.fixture
def flat(robot: RobotModel, tmp_path: Path) -> dict[str, Any]:
    curobo.write(robot, tmp_path)
    return load(tmp_path / "everything_description_curobo_default.yaml")["robot_cfg"]


def dual_arm() -> RobotDescription:
    """A holonomic base, a torso and two arms of two joints with a finger each, as OmniGibson's R1."""
    axes = ("x", "y", "z", "rx", "ry", "rz")
    virtual = [f"base_footprint_{axis}" for axis in axes]
    links = [*virtual, "base", "torso"]
    joints = [
        Joint(
            name=f"{name}_joint",
            type="continuous" if "r" in name[15:] else "prismatic",
            parent=name,
            child=child,
        )
        for name, child in zip(virtual, [*virtual[1:], "base"], strict=True)
    ]
    joints.append(Joint(name="torso_joint", type="revolute", parent="base", child="torso"))
    for side in ("left", "right"):
        joints.append(Joint(name=f"{side}_1", type="revolute", parent="torso", child=f"{side}_link1"))
    for side in ("left", "right"):
        links += [f"{side}_link1", f"{side}_link2", f"{side}_eef", f"{side}_finger"]
        joints += [
            Joint(name=f"{side}_2", type="revolute", parent=f"{side}_link1", child=f"{side}_link2"),
            Joint(name=f"{side}_eef_joint", type="fixed", parent=f"{side}_link2", child=f"{side}_eef"),
            Joint(name=f"{side}_grip", type="prismatic", parent=f"{side}_link2", child=f"{side}_finger"),
        ]
    return RobotDescription(name="dual", links=tuple(Link(name=name) for name in links), joints=tuple(joints))


@pytest.fixture
def dual() -> RobotModel:
    effectors = tuple(
        EndEffector(link=f"{s}_eef", gripper_links=(f"{s}_finger",), gripper_joints=(f"{s}_grip",))
        for s in ("right", "left")
    )
    base = {f"base_footprint_{axis}_joint": 0.0 for axis in ("z", "rx", "ry")}
    planning = PlanningData(
        spheres={},
        ignore={},
        lock_joints={**base, "left_grip": 0.05, "right_grip": 0.05},
    )
    rest = {"left_1": 0.1, "left_2": 0.2, "right_1": 0.3, "right_2": 0.4, "torso_joint": 0.5}
    semantic = SemanticDescription(
        base_link="base",
        base="holonomic",
        base_joints=tuple(f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz")),
        virtual_joints=tuple(f"base_footprint_{axis}_joint" for axis in ("x", "y", "z", "rx", "ry", "rz")),
        end_effectors=effectors,
        trunk_joints=("torso_joint",),
        postures={REST: rest},
    )
    return RobotModel(name="dual", description=dual_arm(), semantic=semantic, planning=planning)


def test_every_vector_has_the_order_of_the_names(flat: dict[str, Any]) -> None:
    assert flat["cspace"] == ORDER
    assert dict(zip(flat["cspace"], flat["retract_config"], strict=True)) == {
        "0": 0.25,
        "1": -0.1,
        "slide": 0.1,
        "spin": 0.0,
        "grip": 0.02,
        "grip_follower": 0.04,
    }
    assert flat["null_space_weight"] == flat["cspace_distance_weight"] == [1] * 6


def test_each_number_of_the_rest_posture_says_whose_it_is(robot: RobotModel, tmp_path: Path) -> None:
    curobo.write(robot, tmp_path)
    text = (tmp_path / "everything_description_curobo_default.yaml").read_text()
    assert "- -0.1  # 1\n" in text


def test_sibling_joints_stand_together(dual: RobotModel, tmp_path: Path) -> None:
    curobo.write(dual, tmp_path)
    flat = load(tmp_path / "dual_description_curobo_default.yaml")["robot_cfg"]
    base = [f"base_footprint_{axis}_joint" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    arms = ["left_1", "right_1", "left_2", "left_grip", "right_2", "right_grip"]
    assert flat["cspace"] == [*base, "torso_joint", *arms]
    assert flat["retract_config"] == [0.0] * 6 + [0.5, 0.1, 0.3, 0.2, 0.0, 0.4, 0.0]


def test_flat_layout(flat: dict[str, Any]) -> None:
    assert flat["usd_robot_root"] == "/everything"
    assert flat["base_link"] == "base"
    assert (flat["ee_link"], flat["link_names"]) == ("tool", [])
    assert flat["collision_link_names"] == ["base", "arm.1", "attached_object_tool"]
    assert flat["mesh_link_names"] == flat["collision_link_names"]
    assert flat["collision_spheres"]["arm.1"][1] == {"center": [0.2, 0.0, 0.0], "radius": 0.0612346}
    assert flat["collision_sphere_buffer"] == 0.002
    assert flat["self_collision_buffer"] == {"base": 0.02}
    assert flat["lock_joints"] == {"grip": 0.04, "grip_follower": 0.07}
    assert flat["extra_collision_spheres"] == {"attached_object_tool": 32}
    assert flat["extra_links"]["attached_object_tool"] == {
        "parent_link_name": "tool",
        "link_name": "attached_object_tool",
        "joint_name": "attached_object_tool_joint",
        "joint_type": "FIXED",
        "fixed_transform": [0, 0, 0, 1, 0, 0, 0],
    }
    assert (flat["max_jerk"], flat["max_acceleration"]) == (500.0, 15.0)
    assert list(flat) == sorted(flat)


def test_grippers_may_touch_what_they_hold(flat: dict[str, Any]) -> None:
    assert flat["self_collision_ignore"] == {
        "base": ["arm.1"],
        "finger_a": ["finger_b", "attached_object_tool"],
        "finger_b": ["attached_object_tool"],
    }


def test_nested_layout_says_the_same(robot: RobotModel, flat: dict[str, Any], tmp_path: Path) -> None:
    nested = load(tmp_path / "nested" / "everything_description_curobo_default.yaml")
    kinematics = nested["robot_cfg"]["kinematics"]
    cspace = kinematics.pop("cspace")
    assert cspace["joint_names"] == flat["cspace"]
    for key in ("retract_config", "null_space_weight", "max_jerk", "max_acceleration"):
        assert cspace[key] == flat[key]
    assert kinematics["usd_flip_joints"] == {
        "0": "Z",
        "slide": "Y",
        "spin": "X",
        "grip": "Y",
        "grip_follower": "Y",
    }
    for key, value in kinematics.items():
        if key != "usd_flip_joints":
            assert value == flat[key]


def test_current_layout(robot: RobotModel, tmp_path: Path) -> None:
    curobo.write(robot, tmp_path / "curobo")
    kinematics = load(tmp_path / "curobo" / "everything.yml")["robot_cfg"]["kinematics"]
    assert kinematics["format_version"] == 2.0
    assert kinematics["urdf_path"] == "../urdf/everything.urdf"
    assert kinematics["tool_frames"] == ["tool"]
    # the parser works followers out itself
    assert kinematics["cspace"]["joint_names"] == ORDER[:-1]
    assert kinematics["cspace"]["default_joint_position"] == [0.25, -0.1, 0.1, 0.0, 0.02]
    assert kinematics["lock_joints"] == {"grip": 0.04}
    assert kinematics["grasp_contact_link_names"] == ["finger_a", "finger_b", "attached_object_tool"]
    assert not {"ee_link", "link_names", "usd_flip_joints", "retract_config"} & set(kinematics)


def test_variants_of_a_holonomic_robot_lock_more_and_more(dual: RobotModel, tmp_path: Path) -> None:
    written = curobo.write(dual, tmp_path)
    assert len(written.files) == 9
    planned = {}
    for variant in ("default", "base", "arm", "arm_no_torso"):
        flat = load(tmp_path / f"dual_description_curobo_{variant}.yaml")["robot_cfg"]
        planned[variant] = [name for name in flat["cspace"] if name not in flat["lock_joints"]]
        assert None not in flat["lock_joints"].values()
        expected = ("base", []) if variant == "base" else ("right_eef", ["left_eef"])
        assert (flat["ee_link"], flat["link_names"]) == expected
    base = [f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz")]
    arms = ["left_1", "right_1", "left_2", "right_2"]
    assert planned == {
        "default": [*base, "torso_joint", *arms],
        "base": base,
        "arm": ["torso_joint", *arms],
        "arm_no_torso": arms,
    }
    arm = load(tmp_path / "dual_description_curobo_arm_no_torso.yaml")["robot_cfg"]
    assert arm["lock_joints"]["torso_joint"] == 0.5, "locked where it rests"


def test_joints_a_planner_cannot_take_are_noted(robot: RobotModel, tmp_path: Path) -> None:
    notes = curobo.write(robot, tmp_path).notes
    assert [any(f'"{name}"' in note for note in notes) for name in ("flat", "ball", "0")] == [
        True,
        True,
        False,
    ]


def test_without_planning_data_nothing_is_written(robot: RobotModel, tmp_path: Path) -> None:
    bare = replace(robot, planning=None)
    assert curobo.write(bare, tmp_path / "curobo").files == ()
    assert xrdf.write(bare, tmp_path / "a.xrdf").files == ()
    assert not list(tmp_path.iterdir())


def test_xrdf(robot: RobotModel, tmp_path: Path) -> None:
    xrdf.write(robot, tmp_path / "everything.xrdf")
    data = load(tmp_path / "everything.xrdf")
    assert (data["format"], data["format_version"]) == ("xrdf", 1.0)
    assert data["cspace"]["joint_names"] == ["0", "1", "slide", "spin"]
    assert data["cspace"]["acceleration_limits"] == [15.0] * 4
    assert data["default_joint_positions"] == {"0": 0.25, "1": -0.1, "slide": 0.1, "spin": 0.0, "grip": 0.04}
    assert data["tool_frames"] == ["tool"]
    group = data["collision"]["geometry"]
    assert data["self_collision"]["geometry"] == group
    assert data["self_collision"]["ignore"] == {"base": ["arm.1"], "finger_a": ["finger_b"]}
    assert data["self_collision"]["buffer_distance"] == {"base": 0.02}
    assert list(data["geometry"][group]["spheres"]) == ["base", "arm.1"]
