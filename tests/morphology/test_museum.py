"""Conclusions about robots with one feature each, and those that must not be made."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import museum

from roboyard.description import RobotDescription
from roboyard.description.semantic import SemanticDescription
from roboyard.morphology.analyze import infer_semantics


def nothing_else(semantic: SemanticDescription, *expected: str) -> None:
    """Assert that no part but the expected ones was concluded."""
    parts = (
        "wheels",
        "steer_joints",
        "caster_joints",
        "trunk_joints",
        "head_joints",
        "legs",
        "arms",
        "grippers",
    )
    for part in parts:
        assert bool(getattr(semantic, part)) == (part in expected), part


@pytest.mark.parametrize(("axis", "sign"), [("0 1 0", 1), ("0 -1 0", -1)])
def test_wheels_drive_forwards_whatever_the_sign_of_their_axle(axis: str, sign: int) -> None:
    semantic = infer_semantics(museum.differential(axis))
    assert (semantic.kind, semantic.base, semantic.drive) == ("mobile_base", "differential", "plain")
    assert [(w.joint, w.forward_sign) for w in semantic.driven_wheels] == [("j1", sign), ("j2", sign)]
    assert semantic.forward == (1, 0, 0)
    assert [w.radius for w in semantic.driven_wheels] == pytest.approx([0.1, 0.1])
    assert semantic.caster_joints == ("j3", "j4")
    nothing_else(semantic, "wheels", "caster_joints")
    # a positive velocity of the joint rolls the wheel by cross(axis, up)
    for wheel in semantic.driven_wheels:
        rolled = np.cross(wheel.axis, [0, 0, 1]) * wheel.forward_sign
        assert rolled == pytest.approx(semantic.forward)


def test_wheels_behind_a_suspension_drive() -> None:
    semantic = infer_semantics(museum.suspended())
    assert (semantic.base, semantic.drive) == ("differential", "skid")
    assert [w.joint for w in semantic.driven_wheels] == ["j0", "j1", "j2", "j3"]
    assert [w.suspension_joints for w in semantic.wheels] == [(f"js{k}",) for k in range(4)]
    nothing_else(semantic, "wheels")


def test_four_wheels_move_sideways_only_with_rollers() -> None:
    plain, rolling = infer_semantics(museum.four_wheels()), infer_semantics(museum.four_wheels(8))
    assert (plain.base, plain.drive) == ("differential", "skid")
    assert (rolling.base, rolling.drive) == ("holonomic", "mecanum")
    assert len(rolling.wheels) == 4 and all(wheel.is_omni for wheel in rolling.wheels)
    assert rolling.wheels[0].radius == pytest.approx(0.11, rel=0.02)
    nothing_else(rolling, "wheels")


def test_three_axles_that_meet_are_omni_wheels() -> None:
    semantic = infer_semantics(museum.omni())
    assert (semantic.kind, semantic.base, semantic.drive) == ("mobile_base", "holonomic", "omni")
    nothing_else(semantic, "wheels")


def test_swerve_modules_steer_every_driven_wheel() -> None:
    semantic = infer_semantics(museum.swerve())
    assert (semantic.base, semantic.drive) == ("holonomic", "swerve")
    assert semantic.steer_joints == ("js0", "js1", "js2", "js3")
    assert [wheel.steer_joint for wheel in semantic.driven_wheels] == list(semantic.steer_joints)
    nothing_else(semantic, "wheels", "steer_joints")


def test_a_car_steers_in_front_and_drives_behind() -> None:
    semantic = infer_semantics(museum.ackermann())
    assert (semantic.kind, semantic.base) == ("vehicle", "ackermann")
    assert semantic.steer_joints == ("js0", "js1")
    assert [wheel.joint for wheel in semantic.driven_wheels] == ["j2", "j3"]
    assert semantic.forward == (1, 0, 0)
    nothing_else(semantic, "wheels", "steer_joints")


def test_a_lift_below_one_arm_is_the_trunk() -> None:
    semantic = infer_semantics(museum.lift_with_one_arm())
    assert (semantic.kind, semantic.base) == ("mobile_manipulator", "differential")
    assert semantic.trunk_joints == ("jl",)
    (arm,) = semantic.arms
    assert arm.joints == ("ja0", "ja1", "ja2", "ja3", "ja4")
    nothing_else(semantic, "wheels", "trunk_joints", "arms")


def test_four_like_chains_on_the_corners_are_legs() -> None:
    semantic = infer_semantics(museum.legs(museum.HIPS))
    assert (semantic.kind, semantic.base) == ("quadruped", "legged")
    names = {leg.joints[0]: leg.name for leg in semantic.legs}
    assert names == {"jp0": "front_left", "jq0": "front_right", "jr0": "rear_left", "js0": "rear_right"}
    assert semantic.legs[0].foot == "p2"
    nothing_else(semantic, "legs")


def test_hips_show_that_a_robot_is_drawn_with_y_up() -> None:
    semantic = infer_semantics(museum.legs(museum.HIPS, y_is_up=True))
    assert (semantic.kind, semantic.up) == ("quadruped", (0, 1, 0))
    assert {leg.name for leg in semantic.legs} == {"front_left", "front_right", "rear_left", "rear_right"}


def test_two_and_six_legs() -> None:
    two = infer_semantics(museum.legs({"p": (0, 0.1), "q": (0, -0.1)}, 5))
    assert (two.kind, [leg.name for leg in two.legs]) == ("biped", ["left", "right"])
    middle = {"m": (0.0, 0.15), "n": (0.0, -0.15)}
    six = infer_semantics(museum.legs({**museum.HIPS, **middle}))
    assert (six.kind, six.base, len(six.legs)) == ("other", "legged", 6)
    assert {leg.name for leg in six.legs} >= {"middle_left", "middle_right"}
    nothing_else(six, "legs")


def test_wheels_at_the_ends_of_legs_leave_a_legged_base() -> None:
    semantic = infer_semantics(museum.wheels_on_legs())
    assert (semantic.kind, semantic.base) == ("quadruped", "legged")
    assert [leg.wheel_joint for leg in semantic.legs] == ["jwp", "jwq", "jwr", "jws"]
    assert all(len(leg.joints) == 3 for leg in semantic.legs)
    nothing_else(semantic, "wheels", "legs")


def test_two_mirrored_chains_on_a_column_are_arms_and_not_legs() -> None:
    semantic = infer_semantics(museum.two_arms_without_hands())
    assert (semantic.kind, semantic.base) == ("dual_arm", "fixed")
    assert {arm.name: arm.joints[0] for arm in semantic.arms} == {"left": "jx0", "right": "jy0"}
    assert all(len(arm.joints) == 6 and arm.end_effector.gripper is None for arm in semantic.arms)
    assert semantic.head_joints == ("jh0", "jh1")
    nothing_else(semantic, "arms", "head_joints")


def test_four_flat_parts_that_spin_are_a_drone() -> None:
    semantic = infer_semantics(museum.drone())
    assert (semantic.kind, semantic.base) == ("drone", "floating")
    nothing_else(semantic)


@pytest.mark.parametrize(
    ("description", "kind", "base"),
    [(museum.table(), "object", "none"), (museum.pendulum(), "other", "fixed")],
    ids=["table", "pendulum"],
)
def test_nothing_is_invented_about_furniture_and_pendulums(
    description: RobotDescription, kind: str, base: str
) -> None:
    semantic = infer_semantics(description)
    assert (semantic.kind, semantic.base) == (kind, base)
    nothing_else(semantic)


def test_every_conclusion_has_reasons_a_confidence_and_a_setting() -> None:
    for made in (museum.differential(), museum.lift_with_one_arm(), museum.legs(museum.HIPS)):
        for found in infer_semantics(made).conclusions:
            assert found.evidence and found.setting, found.field
            assert 0 < found.confidence < 1


def test_thin_evidence_is_said() -> None:
    """A pendulum's kind is a question; a cart's base is not."""
    unsure = infer_semantics(museum.pendulum()).confidence("kind")
    sure = infer_semantics(museum.differential()).confidence("base")
    assert unsure is not None and sure is not None
    assert unsure < 0.5 < sure


def test_fingers_on_a_wrist_are_a_hand_and_no_arms() -> None:
    semantic = infer_semantics(museum.hand_on_a_wrist())
    assert (semantic.kind, semantic.base) == ("hand", "none")
    nothing_else(semantic, "grippers")


def test_two_hands_on_one_root_are_two_hands_and_no_arms() -> None:
    semantic = infer_semantics(museum.two_hands_on_wrists())
    assert (semantic.kind, semantic.base) == ("hand", "none")
    assert [len(gripper.joints) for gripper in semantic.grippers] == [12, 12]
    nothing_else(semantic, "grippers")


def test_a_long_forearm_belongs_to_a_hand_whose_names_say_finger() -> None:
    semantic = infer_semantics(museum.hand_on_a_forearm("ffproximal", "mfproximal", "thumbbase", "rfdistal"))
    assert (semantic.kind, semantic.base) == ("hand", "none")
    nothing_else(semantic, "grippers")
    assert infer_semantics(museum.hand_on_a_forearm("c", "d", "e", "f")).kind != "hand"


def test_an_unnamed_pan_and_tilt_between_two_arms_is_a_head() -> None:
    found = infer_semantics(museum.pan_tilt_between_arms())
    assert found.head_joints == ("jp", "jt")
    assert len(found.arms) == 2
