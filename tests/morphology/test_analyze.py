"""Semantics inferred from geometry and joints, compared with robots whose parts are known."""

from __future__ import annotations

from dataclasses import replace

from roboyard.assets import asset_path
from roboyard.description import Joint, Link, RobotDescription, load_description
from roboyard.description.semantic import EndEffector, SemanticDescription
from roboyard.morphology.analyze import complete_semantics, infer_semantics

SWIVEL_CART = """<robot name="cart"><link name="base"><inertial><mass value="5"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 0.3"/><geometry><box size="0.4 0.3 0.1"/></geometry></collision></link>
{parts}</robot>"""
WHEEL = """<link name="{name}"><collision><origin rpy="1.5707963 0 0"/><geometry>
<cylinder radius="0.1" length="0.05"/></geometry></collision></link>
<joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/>
<origin xyz="{x} {y} {z}"/><axis xyz="0 1 0"/></joint>"""
FORK = """<link name="fork"/><joint name="swivel" type="continuous"><parent link="base"/><child link="fork"/>
<origin xyz="-0.3 0 0.2"/><axis xyz="0 0 1"/></joint>"""


def cart() -> RobotDescription:
    parts = [WHEEL.format(name=f"{s}_wheel", parent="base", x=0, y=y, z=0.1) for s, y in
             (("left", 0.2), ("right", -0.2))]  # fmt: skip
    caster = WHEEL.format(name="caster", parent="fork", x=0.02, y=0, z=-0.1)
    return load_description(SWIVEL_CART.format(parts="".join([*parts, FORK, caster])))


def two_arms() -> RobotDescription:
    """A lift with two arms of two joints, each with a gripper of two fingers."""
    joints = [Joint(name="lift", type="prismatic", parent="base", child="torso")]
    for side in ("left", "right"):
        joints += [
            Joint(name=f"{side}_1", type="revolute", parent="torso", child=f"{side}_link1"),
            Joint(name=f"{side}_2", type="revolute", parent=f"{side}_link1", child=f"{side}_link2"),
            Joint(name=f"{side}_3", type="revolute", parent=f"{side}_link2", child=f"{side}_palm"),
            Joint(name=f"{side}_f1", type="prismatic", parent=f"{side}_palm", child=f"{side}_finger1"),
            Joint(name=f"{side}_f2", type="prismatic", parent=f"{side}_palm", child=f"{side}_finger2"),
        ]
    names = ["base", *(joint.child for joint in joints)]
    return RobotDescription(name="two", links=tuple(Link(name=name) for name in names), joints=tuple(joints))


def test_a_cart_has_a_differential_drive_and_a_caster() -> None:
    semantic = infer_semantics(cart())
    assert semantic.base == "differential"
    assert semantic.base_joints == ("left_wheel_joint", "right_wheel_joint")
    assert set(semantic.wheel_links) == {"left_wheel", "right_wheel"}
    assert semantic.caster_links == ("caster",)
    assert semantic.wheel_pair is not None
    assert abs(semantic.wheel_pair.length - 0.4) < 1e-9
    assert semantic.groups["base"] == semantic.base_joints


def test_arms_share_the_trunk_and_end_in_grippers() -> None:
    semantic = infer_semantics(two_arms())
    assert (semantic.base, semantic.base_joints) == ("fixed", ())
    assert semantic.trunk_joints == ("lift",)
    assert [arm.name for arm in semantic.arms] == ["left", "right"]
    assert semantic.arms[0].joints == ("left_1", "left_2", "left_3")
    assert semantic.arms[1].end_effector.gripper_links == ("right_finger1", "right_finger2")
    assert list(semantic.groups) == ["trunk", "arm_left", "gripper_left", "arm_right", "gripper_right"]


def test_an_arm_without_gripper_ends_at_its_tip() -> None:
    semantic = infer_semantics(load_description(asset_path("arm7")))
    (arm,) = semantic.arms
    assert (arm.name, len(arm.joints)) == ("0", 7)


def test_stated_fields_are_kept() -> None:
    robot = two_arms()
    gripper = EndEffector(link="left_palm", gripper_links=("left_finger1",), gripper_joints=("left_f1",))
    stated = SemanticDescription(base_link="base", end_effectors=(gripper,), postures={"rest": {"lift": 0.2}})
    semantic = complete_semantics(robot, stated)
    (kept,) = semantic.end_effectors
    assert kept.gripper is not None and kept.gripper.joints == ("left_f1",)  # found; the rest is as stated
    assert replace(kept, gripper=None) == gripper
    assert semantic.arms[0].joints == ("lift", "left_1", "left_2", "left_3")
    assert semantic.groups["gripper_0"] == ("left_f1",)
    assert semantic.rest == {"lift": 0.2}
    named = complete_semantics(robot, replace(stated, trunk_joints=("lift", "left_1")))
    assert named.arms[0].joints == ("left_2", "left_3")
