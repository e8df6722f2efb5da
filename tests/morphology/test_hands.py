"""Grippers of one feature each: kind, driven and following joints, opening, end effector and grasp frame."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.evidence.read import read_evidence
from roboyard.description.loader import load_description
from roboyard.morphology.hands.attach import end_effector, has_suction
from roboyard.morphology.hands.describe import FoundGripper, describe_gripper


def _box(name: str, size: str, xyz: str = "0 0 0") -> str:
    shape = f'<origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry>'
    return f'<link name="{name}"><collision>{shape}</collision></link>'


def _joint(
    name: str, parent: str, child: str, kind: str, xyz: str, axis: str, limits: str, more: str = ""
) -> str:
    lower, upper = limits.split()
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        f'<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>{more}</joint>'
    )


def _describe(body: str, joints: list[str], palm: tuple[str, ...] = ("palm",)) -> FoundGripper:
    description = load_description(f'<robot name="g">{body}</robot>')
    return describe_gripper(description, palm, joints, read_evidence(description))


PALM = _box("palm", "0.04 0.1 0.04")
FINGER = "0.08 0.01 0.02"
TWO = (
    PALM
    + _box("left_finger", FINGER, "0.06 0 0")
    + _box("right_finger", FINGER, "0.06 0 0")
    + _joint("left_slide", "palm", "left_finger", "prismatic", "0.02 0.006 0", "0 1 0", "0 0.04")
)


@pytest.mark.parametrize(
    ("axis", "limits", "way"), [("0 -1 0", "0 0.04", "increasing"), ("0 1 0", "-0.04 0", "decreasing")]
)
def test_two_sliding_jaws_open_where_their_tips_move_apart(axis: str, limits: str, way: str):
    body = TWO + _joint("right_slide", "palm", "right_finger", "prismatic", "0.02 -0.006 0", axis, limits)
    found = _describe(body, ["left_slide", "right_slide"])
    gripper = found.gripper
    assert (gripper.kind, gripper.palm, found.link) == ("two_jaw", "palm", "palm")
    assert gripper.joints == ("left_slide", "right_slide") and gripper.mimic_joints == ()
    assert gripper.opening_of == {"left_slide": "increasing", "right_slide": way}
    assert gripper.opening == ("increasing" if way == "increasing" else None)
    assert gripper.fingertips == ("left_finger", "right_finger")
    assert gripper.width == pytest.approx(0.082, abs=1e-6)  # 2 (0.006 + 0.04 - 0.005)
    assert found.frame is not None
    frame = found.frame.matrix()
    np.testing.assert_allclose(frame[:3, 2], [1, 0, 0], atol=1e-9)  # out of the tips
    np.testing.assert_allclose(frame[:3, 1], [0, -1, 0], atol=1e-9)  # from the left to the right finger
    np.testing.assert_allclose(frame[:3, 3], [0.12, 0, 0], atol=1e-9)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1.0)


def test_a_declared_follower_and_the_vendors_grasp_frame():
    follow = '<mimic joint="left_slide"/>'
    body = (
        TWO
        + _joint(
            "right_slide", "palm", "right_finger", "prismatic", "0.02 -0.006 0", "0 -1 0", "0 0.04", follow
        )
        + '<link name="grasp_frame"/><joint name="g" type="fixed"><parent link="palm"/>'
        '<child link="grasp_frame"/></joint>'
    )
    found = _describe(body, ["left_slide", "right_slide"], ("palm", "grasp_frame"))
    assert (found.gripper.joints, found.gripper.mimic_joints) == (("left_slide",), ("right_slide",))
    assert (found.link, found.frame, found.gripper.opening) == ("grasp_frame", None, "increasing")


@pytest.mark.parametrize(
    ("axis", "limits", "way"), [("0 0 1", "0 1.2", "increasing"), ("0 0 1", "-1.2 0", "decreasing")]
)
def test_one_jaw_opens_away_from_the_fixed_jaw(axis: str, limits: str, way: str):
    side = 0.03 if way == "increasing" else -0.03
    body = (
        _box("palm", "0.1 0.02 0.02", "0.05 0 0")
        + _box("jaw", "0.08 0.01 0.02", "0.05 0 0")
        + _joint("jaw_hinge", "palm", "jaw", "revolute", f"0.02 {side} 0", axis, limits)
    )
    found = _describe(body, ["jaw_hinge"])
    assert (found.gripper.kind, found.gripper.opening) == ("single_jaw", way)
    assert found.frame is not None and abs(found.frame.position[1]) < 0.03  # between the jaws


def test_turning_jaws_that_cross_their_middle_keep_their_direction():
    """Both fingers turn 0.6 rad each way; the file's zero is neither open nor closed."""
    body = PALM
    for name, y, axis in (("left", 0.02, "0 0 1"), ("right", -0.02, "0 0 -1")):
        body += _box(f"{name}_finger", FINGER, "0.06 0 0")
        body += _joint(f"{name}_hinge", "palm", f"{name}_finger", "revolute", f"0 {y} 0", axis, "-0.6 0.6")
    assert _describe(body, ["left_hinge", "right_hinge"]).gripper.opening == "increasing"


def _hand(extra: str = "", follow: bool = True) -> str:
    body = PALM
    places = {"thumb": -0.05, "index": -0.02, "middle": 0.0, "ring": 0.02}
    for name, y in places.items():
        z = -0.03 if name == "thumb" else 0.0
        axis = "0 -1 0" if name == "thumb" else "0 1 0"
        body += _box(f"{name}_1", "0.03 0.01 0.01", "0.02 0 0") + _box(
            f"{name}_2", "0.03 0.01 0.01", "0.02 0 0"
        )
        body += _joint(f"{name}_mcp", "palm", f"{name}_1", "revolute", f"0.02 {y} {z}", axis, "0 1.5")
        leader = f'<mimic joint="{name}_mcp" multiplier="1.1"/>' if follow else ""
        body += _joint(f"{name}_pip", f"{name}_1", f"{name}_2", "revolute", "0.04 0 0", axis, "0 1.5", leader)
    return body + extra


JOINTS = [f"{finger}_{part}" for finger in ("thumb", "index", "middle", "ring") for part in ("mcp", "pip")]


def test_an_underactuated_hand_has_one_driven_joint_a_finger():
    gripper = _describe(_hand(), JOINTS).gripper
    assert gripper.kind == "hand"
    assert gripper.joints == ("thumb_mcp", "index_mcp", "middle_mcp", "ring_mcp")
    assert gripper.mimic_joints == ("thumb_pip", "index_pip", "middle_pip", "ring_pip")
    assert set(gripper.fingertips) == {"thumb_2", "index_2", "middle_2", "ring_2"}


def test_joints_without_a_motor_follow_though_the_file_has_no_mimic():
    motors = "".join(
        f'<transmission name="{n}"><joint name="{n}"/></transmission>' for n in JOINTS if n.endswith("mcp")
    )
    found = _describe(_hand(motors, follow=False), JOINTS)
    assert found.gripper.joints == ("thumb_mcp", "index_mcp", "middle_mcp", "ring_mcp")
    assert any("have a motor" in reason for reason in found.evidence)


def test_without_any_statement_every_joint_counts_as_driven():
    assert set(_describe(_hand(follow=False), JOINTS).gripper.joints) == set(JOINTS)


def test_suction_is_known_by_its_name_or_plugin_and_has_no_joints():
    description = load_description(
        '<robot name="g"><link name="flange"/><link name="vacuum_cup"/><joint name="j" type="fixed">'
        '<parent link="flange"/><child link="vacuum_cup"/></joint></robot>'
    )
    assert has_suction(("flange", "vacuum_cup")) and not has_suction(("flange",))
    effector, found = end_effector(description, ("flange", "vacuum_cup"), ())
    assert found is not None and (found.gripper.kind, found.gripper.joints) == ("suction", ())
    assert effector.gripper is found.gripper


def test_an_arm_without_gripper_ends_at_the_vendors_tool_frame_or_its_last_shape():
    description = load_description(
        f'<robot name="g">{_box("link_6", "0.1 0.1 0.1")}<link name="flange"/><link name="tool0"/>'
        '<link name="force_sensor"/>'
        '<joint name="a" type="fixed"><parent link="link_6"/><child link="flange"/></joint>'
        '<joint name="b" type="fixed"><parent link="flange"/><child link="tool0"/></joint>'
        '<joint name="c" type="fixed"><parent link="flange"/><child link="force_sensor"/></joint></robot>'
    )
    assert end_effector(description, ("link_6", "flange", "tool0", "force_sensor"), ())[0].link == "tool0"
    assert end_effector(description, ("link_6", "flange", "force_sensor"), ())[0].link == "link_6"


def test_slides_without_shapes_open_where_their_frames_part():
    body = '<link name="palm"/><link name="left"/><link name="right"/>'
    body += _joint("l", "palm", "left", "prismatic", "0 0 0", "0 1 0", "0 0.04")
    body += _joint("r", "palm", "right", "prismatic", "0 0 0", "0 -1 0", "0 0.04")
    gripper = _describe(body, ["l", "r"]).gripper
    assert gripper.opening_of == {"l": "increasing", "r": "increasing"}


def test_turning_jaws_without_shapes_open_where_their_outermost_frames_part():
    """Two knuckles with a pad frame at their ends, which swing inwards with rising positions."""
    body = '<link name="palm"/>'
    for side, y, sign in (("l", 0.03, 1), ("r", -0.03, -1)):
        body += f'<link name="{side}_knuckle"/><link name="{side}_pad"/>'
        more = "" if side == "l" else '<mimic joint="l"/>'
        body += _joint(
            side, "palm", f"{side}_knuckle", "revolute", f"0 {y} 0.05", f"{sign} 0 0", "0 0.8", more
        )
        body += _joint(
            f"{side}_fix", f"{side}_knuckle", f"{side}_pad", "fixed", f"0 {sign * 0.03} 0.05", "1 0 0", "0 0"
        )
    gripper = _describe(body, ["l", "r"]).gripper
    assert gripper.joints == ("l",)
    assert gripper.opening == "decreasing"


def test_grasp_points_are_on_the_inner_faces_of_the_tips():
    body = TWO + _joint(
        "right_slide", "palm", "right_finger", "prismatic", "0.02 -0.006 0", "0 -1 0", "0 0.04"
    )
    gripper = _describe(body, ["left_slide", "right_slide"]).gripper
    points = dict(gripper.start_points) | dict(gripper.end_points)
    assert points.keys() == {"left_finger", "right_finger"}
    # the fingers are boxes of 0.08 x 0.01 x 0.02 m about x = 0.06 m: half a width inwards, near the tip
    assert points["left_finger"] == pytest.approx((0.1, -0.005, 0), abs=0.001)
    assert points["right_finger"] == pytest.approx((0.1, 0.005, 0), abs=0.001)
