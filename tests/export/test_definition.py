"""The definition skeleton, read as plain YAML."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from roboyard.description import Joint, Link, RobotDescription
from roboyard.description.model import Pose
from roboyard.description.robot_model import PlanningData, RobotModel
from roboyard.description.semantic import REST, TUCK, EndEffector, Leg, SemanticDescription, Wheel
from roboyard.export import definition
from roboyard.morphology.analyze import complete_semantics


def arm(side: str, count: int) -> tuple[list[str], list[Joint]]:
    links = [f"{side}_link{k}" for k in range(1, count + 1)]
    joints = [
        Joint(name=f"{side}_joint{k}", type="revolute", parent=parent, child=child)
        for k, (parent, child) in enumerate(zip(["torso", *links], links, strict=False), start=1)
    ]
    joints.append(Joint(name=f"{side}_tip", type="fixed", parent=links[-1], child=f"{side}_eef_link"))
    joints.append(Joint(name=f"{side}_grip", type="prismatic", parent=links[-1], child=f"{side}_finger"))
    return [*links, f"{side}_eef_link", f"{side}_finger"], joints


@pytest.fixture
def robot() -> RobotModel:
    left, right = arm("left", 2), arm("right", 2)
    wheel = Joint(name="wheel_joint", type="continuous", parent="base", child="wheel")
    links = ["base", "torso", *left[0], *right[0], "wheel"]
    lift = Joint(name="lift", type="prismatic", parent="base", child="torso")
    effectors = tuple(
        EndEffector(link=f"{s}_eef_link", gripper_links=(f"{s}_finger",), gripper_joints=(f"{s}_grip",))
        for s in ("right", "left")
    )
    description = RobotDescription(
        name="dual",
        links=tuple(Link(name=name) for name in links),
        joints=(lift, *left[1], *right[1], wheel),
    )
    stated = SemanticDescription(
        base_link="base",
        wheel_links=("wheel",),
        end_effectors=effectors,
        disabled_collision_pairs=(("torso", "left_link2"),),
        postures={REST: {"lift": 0.3, "left_joint1": 0.1, "right_joint1": 0.2}},
    )
    return RobotModel(
        name="dual",
        description=description,
        semantic=complete_semantics(description, stated),
        planning=PlanningData(spheres={}, ignore={}, lock_joints={"left_grip": 0.05, "right_grip": 0.05}),
    )


def with_semantics(robot: RobotModel, **stated: Any) -> RobotModel:
    """The robot with other stated semantics, and everything else inferred from these."""
    known = SemanticDescription(base_link="base", **stated)
    return replace(robot, semantic=complete_semantics(robot.description, known))


def load(robot: RobotModel, folder: Path) -> dict[str, Any]:
    definition.write(robot, folder / "dual.yaml")
    return yaml.safe_load((folder / "dual.yaml").read_text())


def test_groups(robot: RobotModel, tmp_path: Path) -> None:
    data = load(robot, tmp_path)
    order = ["base", "trunk", "arm_left", "gripper_left", "arm_right", "gripper_right"]
    assert data["raw_controller_order"] == order
    assert list(data["default_controllers"]) == order
    assert data["default_controllers"]["arm_left"] == "JointController"  # two joints follow no pose


def test_arms_begin_where_their_chains_part(robot: RobotModel, tmp_path: Path) -> None:
    data = load(robot, tmp_path)
    assert data["articulated_trunk"] == {"trunk_link_names": ["torso"], "trunk_joint_names": ["lift"]}
    arms = data["manipulation"]
    assert (arms["n_arms"], arms["arm_names"]) == (2, ["left", "right"])
    assert arms["arm_joint_names"]["right"] == ["right_joint1", "right_joint2"]
    assert arms["arm_link_names"]["left"] == ["left_link1", "left_link2"]
    assert arms["eef_link_names"] == {"left": "left_eef_link", "right": "right_eef_link"}
    assert arms["finger_link_names"]["left"] == ["left_finger"]
    assert arms["finger_joint_names"]["left"] == ["left_grip"]


def test_rest_posture_is_breadth_first_and_named(robot: RobotModel, tmp_path: Path) -> None:
    data = load(robot, tmp_path)
    assert data["default_joint_pos"] == [0.3, 0.0, 0.1, 0.2, 0.0, 0.0, 0.05, 0.05]
    text = (tmp_path / "dual.yaml").read_text()
    assert "- 0.3   # lift\n" in text
    assert "- 0.2   # right_joint1\n" in text


def test_base(robot: RobotModel, tmp_path: Path) -> None:
    data = load(robot, tmp_path)
    assert data["base_footprint_link_name"] == "base"
    assert data["locomotion"] == {
        "base_joint_names": ["wheel_joint"],
        "floor_touching_base_link_names": ["wheel"],
    }
    assert data["disabled_collision_pairs"] == [["torso", "left_link2"]]
    assert "holonomic_base" not in data


def test_holonomic_base(robot: RobotModel, tmp_path: Path) -> None:
    virtual = tuple(f"base_footprint_{axis}_joint" for axis in ("x", "y", "rz"))
    semantic = replace(robot.semantic, base="holonomic", base_joints=virtual, virtual_joints=virtual)
    data = load(replace(robot, semantic=semantic, approximations={"wheel": "boundingSphere"}), tmp_path)
    assert data["holonomic_base"] == {"force_sphere_wheel_approximation": True}
    assert data["locomotion"]["base_joint_names"] == list(virtual)
    assert data["default_controllers"]["base"] == "HolonomicBaseJointController"


def test_a_short_chain_without_gripper_is_no_arm(robot: RobotModel, tmp_path: Path) -> None:
    data = load(with_semantics(robot, end_effectors=(EndEffector(link="left_eef_link"),)), tmp_path)
    assert data["raw_controller_order"] == ["trunk"]  # every driven joint has a group
    assert "manipulation" not in data


def bent(joint: Joint, number: int) -> Joint:
    """A joint with an axis other than the one before, 0.2 m further on."""
    axis = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))[number % 3]
    return replace(joint, axis=axis, origin=Pose(position=(0.2, 0.05, 0.1)))


def test_an_arm_that_reaches_poses_has_inverse_kinematics(tmp_path: Path) -> None:
    by_joint, by_pose = "JointController", "InverseKinematicsController"
    for count, bends, name in ((4, True, by_joint), (5, True, by_pose), (5, False, by_joint)):
        links, joints = arm("left", count)
        if bends:  # else it turns about one axis only, as a telescope slides along one
            joints = [bent(joint, k) for k, joint in enumerate(joints)]
        effector = EndEffector(
            link="left_eef_link", gripper_links=("left_finger",), gripper_joints=("left_grip",)
        )
        description = RobotDescription(
            name="dual", links=tuple(Link(name=link) for link in ("torso", *links)), joints=tuple(joints)
        )
        stated = SemanticDescription(base_link="torso", end_effectors=(effector,))
        robot = RobotModel(
            name="dual", description=description, semantic=complete_semantics(description, stated)
        )
        assert load(robot, tmp_path)["default_controllers"]["arm_0"] == name


def wheel(name: str, x: float, y: float) -> Wheel:
    """A wheel of 0.1 m whose axle is along -y."""
    return Wheel(joint=name, link=f"{name}_link", radius=0.1, centre=(x, y, 0.1), axis=(0.0, -1.0, 0.0))


def chassis(*names: str, **semantic: Any) -> RobotModel:
    """A base with one continuous joint for each name."""
    joints = tuple(Joint(name=n, type="continuous", parent="base", child=f"{n}_link") for n in names)
    links = ("base", *(f"{n}_link" for n in names))
    return RobotModel(
        name="dual",
        description=RobotDescription(name="c", links=tuple(Link(name=n) for n in links), joints=joints),
        semantic=SemanticDescription(base_link="base", **semantic),
    )


def test_wheels_of_a_skid_steered_base_are_listed_left_first(tmp_path: Path) -> None:
    """The robot faces -x, so its left is -y."""
    names = ("fl", "fr", "rl", "rr")
    wheels = tuple(
        wheel(n, x, y) for n, x, y in zip(names, (-0.3, -0.3, 0.3, 0.3), (-0.2, 0.2, -0.2, 0.2), strict=True)
    )
    robot = chassis(
        *names, base="differential", wheels=wheels[::-1], forward=(-1.0, 0.0, 0.0), base_joints=names
    )
    data = load(robot, tmp_path)
    assert data["locomotion"]["base_joint_names"] == ["fl", "rl", "fr", "rr"]
    assert data["two_wheel"] == {"wheel_radius": 0.1, "wheel_axle_length": 0.4}
    assert data["default_controllers"] == {"base": "DifferentialDriveController"}


def test_legs_head_and_casters(tmp_path: Path) -> None:
    """Legs are the base's joints, and what nothing drives belongs to no group."""
    robot = chassis(
        "hip",
        "knee",
        "neck",
        "swivel",
        "tail",
        base="legged",
        legs=(Leg(name="left", joints=("hip", "knee"), foot="knee_link"),),
        head_joints=("neck",),
        caster_joints=("swivel",),
    )
    data = load(robot, tmp_path)
    assert data["locomotion"] == {
        "base_joint_names": ["hip", "knee"],
        "floor_touching_base_link_names": ["knee_link"],
    }
    assert data["active_camera"] == {"camera_joint_names": ["neck"]}
    assert data["articulated_trunk"]["trunk_joint_names"] == ["tail"]
    assert data["raw_controller_order"] == ["base", "trunk", "camera"]


def test_a_tucked_posture_is_written_beside_the_rest_posture(robot: RobotModel, tmp_path: Path) -> None:
    postures = {REST: {"lift": 0.3}, TUCK: {"lift": 0.1, "left_joint1": -0.5}}
    tucked = replace(robot, semantic=replace(robot.semantic, postures=postures))
    block = load(tucked, tmp_path)["mobile_manipulation"]
    assert block["untucked_default_joint_pos"] == [0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.05]
    assert block["tucked_default_joint_pos"] == [0.1, 0.0, -0.5, 0.0, 0.0, 0.0, 0.05, 0.05]


def test_one_arm_has_the_default_name(robot: RobotModel, tmp_path: Path) -> None:
    data = load(with_semantics(robot, end_effectors=robot.semantic.end_effectors[:1]), tmp_path)
    assert data["manipulation"]["arm_names"] == ["0"]
    assert data["manipulation"]["arm_joint_names"] == {"0": ["lift", "right_joint1", "right_joint2"]}
