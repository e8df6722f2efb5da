"""Robots that files draw in unusual ways: conclusions about them, and those that must not be made."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import unusual_robots
from museum import chain
from small_robots import joint, link, robot
from test_museum import nothing_else

from roboyard.description import load_description
from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.upright import turn_to_upright, turned


def test_a_plugin_and_a_caster_show_a_base_whose_wheels_have_no_joints() -> None:
    semantic = infer_semantics(unusual_robots.wheels_without_joints(unusual_robots.DIFF_DRIVE))
    assert (semantic.kind, semantic.base) == ("mobile_base", "differential")
    assert semantic.caster_joints == ("jcaster", "j4") and not semantic.driven_wheels
    nothing_else(semantic, "wheels", "caster_joints")


def test_an_arm_on_wheels_without_joints_is_a_question() -> None:
    semantic = infer_semantics(unusual_robots.wheels_without_joints(arm=True))
    assert (semantic.kind, semantic.base) == ("mobile_manipulator", "differential")
    sure = semantic.confidence("base")
    assert sure is not None and sure < 0.5
    nothing_else(semantic, "arms")


def test_a_trolley_is_no_robot() -> None:
    semantic = infer_semantics(unusual_robots.trolley())
    assert (semantic.kind, semantic.base) == ("object", "none")
    nothing_else(semantic)


def test_wheels_on_one_carriage_that_steers_without_limits_are_holonomic() -> None:
    semantic = infer_semantics(unusual_robots.carriage())
    assert (semantic.kind, semantic.base, semantic.drive) == ("mobile_base", "holonomic", "swerve")
    assert semantic.steer_joints == ("js",)
    assert semantic.caster_joints == ("jl0", "jl1", "jl2", "jr0", "jr1", "jr2")
    nothing_else(semantic, "wheels", "steer_joints", "caster_joints")


def test_a_turn_and_a_slide_without_end_stand_for_a_base() -> None:
    semantic = infer_semantics(unusual_robots.on_rails(1000))
    assert (semantic.kind, semantic.base, semantic.base_link) == ("mobile_manipulator", "differential", "b")
    assert [len(arm.joints) for arm in semantic.arms] == [5]
    assert infer_semantics(unusual_robots.on_rails(0.5)).kind == "fixed_arm"


def test_joints_between_the_root_and_the_body_on_wheels_are_the_trunk() -> None:
    semantic = infer_semantics(unusual_robots.hung_from_the_top())
    assert (semantic.kind, semantic.base) == ("mobile_manipulator", "differential")
    assert semantic.trunk_joints == ("jh0", "jh1", "jh2")
    assert {wheel.suspension_joints for wheel in semantic.wheels} == {()}
    nothing_else(semantic, "wheels", "trunk_joints", "arms")


def test_the_only_arm_of_a_robot_that_stands_still_begins_at_its_base() -> None:
    semantic = infer_semantics(unusual_robots.head_above_the_first_joint())
    assert [arm.joints for arm in semantic.arms] == [tuple(f"ja{k}" for k in range(7))]
    assert semantic.head_joints == ("head_pan",)
    nothing_else(semantic, "arms", "head_joints")


def test_a_steering_joint_without_a_wheel_is_no_head() -> None:
    semantic = infer_semantics(unusual_robots.steering_for_show())
    assert (semantic.kind, semantic.base) == ("vehicle", "ackermann")
    nothing_else(semantic, "wheels", "steer_joints")


@pytest.mark.parametrize(
    ("name", "kind"), [("suction_cup", "gripper"), ("vacuum_brush", "object"), ("foot", "object")]
)
def test_suction_cups_on_their_own_are_a_gripper_and_vacuum_cleaners_are_not(name: str, kind: str) -> None:
    semantic = infer_semantics(unusual_robots.suction_cups(name))
    assert (semantic.kind, semantic.base) == (kind, "none")
    assert [gripper.kind for gripper in semantic.grippers] == ["suction"] * (kind == "gripper")


@pytest.mark.parametrize(("state", "kind"), [("none", "gripper"), ("box 0.05 0.05 0.05", "object")])
def test_a_suction_gripper_may_state_by_a_joint_without_a_shape_whether_it_holds(
    state: str, kind: str
) -> None:
    semantic = infer_semantics(unusual_robots.suction_cups(state=state))
    assert (semantic.kind, semantic.base) == (kind, "none")
    assert [gripper.joints for gripper in semantic.grippers] == [()] * (kind == "gripper")


def test_blades_that_follow_a_frame_without_a_shape_open_as_it_turns() -> None:
    (gripper,) = infer_semantics(unusual_robots.scissors()).grippers
    assert (gripper.joints, gripper.opening) == (("jaw",), "increasing")
    assert set(gripper.mimic_joints) == {"jaw_1_joint", "jaw_2_joint"}


def test_of_a_neck_and_its_gear_the_one_that_carries_the_head_is_said() -> None:
    semantic = infer_semantics(unusual_robots.gears_beside_a_neck())
    assert semantic.head_joints == ("neck_yaw_driven", "neck_pitch")
    assert semantic.head_link == "head"
    assert len(semantic.arms) == 2


def test_a_jaw_against_the_last_link_of_an_arm() -> None:
    semantic = infer_semantics(unusual_robots.single_jaw_arm())
    (arm,) = semantic.arms
    gripper = arm.end_effector.gripper
    assert (semantic.kind, len(arm.joints)) == ("fixed_arm", 5)
    assert gripper is not None
    assert (gripper.kind, gripper.joints, gripper.opening) == ("single_jaw", ("jaw_joint",), "increasing")


def test_a_jaw_that_names_say_twice_needs_no_long_fixed_one() -> None:
    semantic = infer_semantics(unusual_robots.jaw_beside_a_short_one())
    (arm,) = semantic.arms
    gripper = arm.end_effector.gripper
    assert len(arm.joints) == 5 and gripper is not None
    assert (gripper.kind, gripper.joints) == ("single_jaw", ("gripper",))
    assert arm.end_effector.link == "fixed_jaw"  # the tip of one jaw is no grasp frame


def test_the_motor_of_two_fingers_opens_them_whatever_springs_are_in_them() -> None:
    (gripper,) = infer_semantics(unusual_robots.gripper_of_springs()).grippers
    assert gripper.joints[0] == "motor" and gripper.opening == "increasing"
    assert set(gripper.opening_of) == {"motor"}


def test_fingers_that_follow_their_first_joint_are_a_hand_of_three_motors() -> None:
    semantic = infer_semantics(unusual_robots.underactuated_hand())
    (gripper,) = semantic.grippers
    assert semantic.kind == "hand"
    assert gripper.joints == ("jc0", "jd0", "je0") and len(gripper.mimic_joints) == 6


def test_fingers_with_linkages_are_a_hand_and_no_arms() -> None:
    semantic = infer_semantics(unusual_robots.fingers_with_linkages())
    assert semantic.kind == "hand"
    nothing_else(semantic, "grippers")


def test_two_joints_in_a_row_may_be_a_pendulum() -> None:
    parts = [link("b"), link("1", "box 0.05 0.05 0.5", 1, origin="0 0 0.25")]
    parts.append(link("2", "box 0.05 0.05 0.5", 1, origin="0 0 0.25"))
    parts += [joint("j1", "b", "1", axis="0 1 0"), joint("j2", "1", "2", xyz="0 0 0.5", axis="0 1 0")]
    sure = infer_semantics(robot(*parts)).confidence("kind")
    assert sure is not None and sure < 0.5


def test_round_motors_beside_legs_are_no_wheels() -> None:
    semantic = infer_semantics(unusual_robots.motors_beside_legs())
    assert (semantic.kind, semantic.base, len(semantic.legs)) == ("quadruped", "legged", 4)
    nothing_else(semantic, "legs")


def test_a_pan_tilt_unit_is_no_arm() -> None:
    semantic = infer_semantics(unusual_robots.pan_tilt_unit())
    assert semantic.kind == "other"
    nothing_else(semantic)


def test_a_car_with_front_wheel_drive_is_no_swerve_base() -> None:
    semantic = infer_semantics(unusual_robots.front_wheel_drive())
    assert (semantic.kind, semantic.base) == ("vehicle", "ackermann")
    assert [wheel.joint for wheel in semantic.driven_wheels] == ["j0", "j1"]


def test_gears_on_a_ring_are_no_wheels() -> None:
    semantic = infer_semantics(unusual_robots.gears())
    assert semantic.base not in ("holonomic", "differential")
    nothing_else(semantic)


def test_three_fixed_wheels_around_a_base_may_be_omni_wheels() -> None:
    semantic = infer_semantics(unusual_robots.arm_on_three_fixed_wheels())
    assert (semantic.kind, semantic.base) == ("mobile_manipulator", "holonomic")
    sure = semantic.confidence("base")
    assert sure is not None and sure < 0.5


def test_a_round_motor_in_a_wheel_is_a_wheel() -> None:
    semantic = infer_semantics(unusual_robots.arm_on_hub_motors())
    assert (semantic.kind, semantic.base) == ("mobile_manipulator", "holonomic")
    sure = semantic.confidence("base")
    assert sure is not None and sure < 0.5


def test_two_slides_and_a_turn_without_shapes_stand_for_a_base_however_short_they_are() -> None:
    arm = chain("a", "b", "0 0 0.2", unusual_robots.ARM, "0.1 0 0.1")
    semantic = infer_semantics(unusual_robots.on_planar_joints(*arm))
    assert (semantic.kind, semantic.base, semantic.base_link) == ("mobile_manipulator", "holonomic", "b")
    assert [len(one.joints) for one in semantic.arms] == [5]
    assert infer_semantics(unusual_robots.on_planar_joints(*arm, shape="box 0.1 0.1 0.1")).base == "fixed"


def test_what_slides_in_a_plane_is_a_base_where_it_carries_a_sensor() -> None:
    lidar = link("lidar"), joint("l", "b", "lidar", kind="fixed", xyz="0.1 0 0.1")
    semantic = infer_semantics(unusual_robots.on_planar_joints(*lidar))
    assert (semantic.kind, semantic.base) == ("mobile_base", "holonomic")
    assert (
        infer_semantics(unusual_robots.on_planar_joints(link("lid"), joint("l", "b", "lid"))).kind
        != "mobile_base"
    )


def test_three_joints_on_a_base_on_the_floor_are_an_arm_where_the_first_axis_is_upright() -> None:
    semantic = infer_semantics(unusual_robots.small_arm())
    assert (semantic.kind, semantic.base) == ("fixed_arm", "fixed")
    assert [arm.joints for arm in semantic.arms] == [("jq0", "jq1", "jq2")]
    assert infer_semantics(unusual_robots.small_arm("1 0 0")).kind == "other"


def test_a_body_named_for_suction_is_a_gripper_of_its_own() -> None:
    text = '<robot name="suction_gripper"><link name="base"/></robot>'
    assert infer_semantics(load_description(text)).kind == "gripper"
    pump = link("pump_head"), joint("p", "q2", "pump_head", kind="fixed", xyz="0 0 0.15")
    body = link("b", "box 0.2 0.2 0.1", 5)
    arm = robot(body, *chain("q", "b", "0 0 0.1", ("0 0 1", "0 1 0", "0 1 0"), "0 0 0.15"), *pump)
    (found,) = infer_semantics(arm).grippers
    assert found.kind == "suction" and not found.joints


def test_legs_that_end_in_grippers_are_legs_where_names_say_so() -> None:
    semantic = infer_semantics(unusual_robots.climber())
    assert (semantic.kind, semantic.base) == ("humanoid", "legged")
    assert [len(leg.joints) for leg in semantic.legs] == [6, 6]
    assert {arm.joints[0] for arm in semantic.arms} == {"jleft_arm0", "jright_arm0"}
    assert len(semantic.grippers) == 2


def test_a_joint_that_turns_an_empty_frame_is_no_finger() -> None:
    (arm,) = infer_semantics(unusual_robots.jaw_beside_an_empty_frame()).arms
    gripper = arm.end_effector.gripper
    assert gripper is not None and gripper.joints == ("gripper_joint",)


def test_limbs_that_hang_below_an_unseen_base_are_not_legs() -> None:
    semantic = infer_semantics(unusual_robots.arms_on_a_base_without_shape())
    assert (semantic.kind, semantic.base) == ("dual_arm", "fixed")
    nothing_else(semantic, "arms")


def test_wheels_with_axles_upright_are_those_of_a_file_with_y_up() -> None:
    drawn = load_description(unusual_robots.cart_with_y_up())
    semantic = infer_semantics(drawn)
    assert (semantic.kind, semantic.base, semantic.up) == ("mobile_base", "differential", (0.0, 1.0, 0.0))
    assert {wheel.joint: wheel.centre for wheel in semantic.driven_wheels}["jfl"] == pytest.approx(
        (0.2, 0, 0.2)
    )
    nothing_else(semantic, "wheels")
    turn = turn_to_upright(semantic)
    assert turn is not None
    upright = infer_semantics(turned(drawn, turn))
    assert upright.up == (0.0, 0.0, 1.0) and upright.base == "differential"
    centres = {wheel.joint: wheel.centre for wheel in upright.driven_wheels}
    for wheel in semantic.driven_wheels:
        assert centres[wheel.joint] == pytest.approx(tuple(turn @ wheel.centre))
    assert upright.forward == pytest.approx((1.0, 0.0, 0.0))
