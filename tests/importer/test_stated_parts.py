"""Statements of a configuration about a robot: all that follows from them, and those that cannot be right."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "morphology"))
import museum  # pyright: ignore[reportMissingImports]
import unusual_robots  # pyright: ignore[reportMissingImports]

from roboyard.description import RobotDescription
from roboyard.description.semantic import SemanticDescription
from roboyard.errors import ConfigError
from roboyard.importer.build import build_package
from roboyard.importer.config.checks import check_against
from roboyard.importer.config.schema import Gripper as StatedGripper
from roboyard.importer.config.schema import ImportConfig, Understanding
from roboyard.importer.inferred_config import inferred_understanding
from roboyard.importer.stated_parts import with_stated_parts
from roboyard.morphology.analyze import infer_semantics


def _stated(description: RobotDescription, **keys: Any) -> SemanticDescription:
    semantic = infer_semantics(description)
    return with_stated_parts(semantic, Understanding.model_validate(keys), description)


def _problems(description: RobotDescription, **keys: Any) -> list[str]:
    config = ImportConfig.model_validate({"urdf_path": "r.urdf", "name": "r", "understanding": keys})
    return [problem.text for problem in check_against(config, description)]


@pytest.mark.parametrize(
    "description",
    [museum.differential(), museum.swerve(), museum.legs(museum.HIPS), museum.two_arms_without_hands()],
    ids=["differential", "swerve", "legs", "arms"],
)
def test_stating_what_was_inferred_changes_nothing(description: RobotDescription) -> None:
    semantic = infer_semantics(description)
    stated = inferred_understanding(semantic)
    assert with_stated_parts(semantic, stated, description) == semantic
    assert _problems(description, **stated.model_dump(exclude_none=True)) == []


def test_a_stated_head_moves_the_heads_link() -> None:
    semantic = _stated(museum.two_arms_without_hands(), head_joints=["jh0"])
    assert (semantic.head_joints, semantic.head_link) == (("jh0",), "h0")
    assert _stated(museum.two_arms_without_hands(), head_joints=[]).head_link is None
    assert semantic.confidence("head_joints") == 1.0


def test_a_stated_caster_neither_steers_nor_drives() -> None:
    semantic = _stated(museum.swerve(), caster_joints=["js2", "j2", "js3", "j3"])
    assert semantic.steer_joints == ("js0", "js1")
    assert [wheel.joint for wheel in semantic.driven_wheels] == ["j0", "j1"] == list(semantic.base_joints)
    assert semantic.wheel_links == ("0", "1") and semantic.caster_links == ("2", "3")
    assert {w.caster_joint for w in semantic.wheels if w.is_caster} == {"js2", "js3"}


def test_a_stated_steering_joint_makes_a_caster_drive() -> None:
    semantic = _stated(museum.differential(), steer_joints=["j3"])
    assert semantic.caster_joints == () == semantic.caster_links
    (wheel,) = (wheel for wheel in semantic.wheels if wheel.joint == "j4")
    assert (wheel.is_driven, wheel.is_caster, wheel.steer_joint) == (True, False, "j3")


def test_a_stated_base_takes_wheels_and_drive_with_it() -> None:
    fixed = _stated(museum.four_wheels(), base="fixed")
    assert (fixed.base, fixed.drive, fixed.base_joints, fixed.wheel_links) == ("fixed", None, (), ())
    assert not fixed.driven_wheels and len(fixed.wheels) == 4
    omni = _stated(museum.swerve(), base="differential")
    assert (omni.drive, omni.base_joints) == ("skid", ("j0", "j1", "j2", "j3"))
    pair = _stated(museum.differential(), base="ackermann")
    assert (pair.drive, pair.wheel_pair) == ("ackermann", None)


def test_an_opening_of_an_unknown_arm_is_an_error_that_names_the_known_ones() -> None:
    jaws = unusual_robots.single_jaw_arm()
    with pytest.raises(ConfigError, match=r"understanding\.opening\.lefft: .*'lefft'.*0"):
        _stated(jaws, opening={"lefft": "decreasing"})
    with pytest.raises(ConfigError, match=r"opening\.left: no gripper is known .*eef_to_gripper_info\.x5"):
        _stated(museum.two_arms_without_hands(), opening={"left": "increasing"})
    (arm,) = _stated(jaws, opening={"0": "decreasing"}).arms
    assert arm.end_effector.gripper is not None and arm.end_effector.gripper.opening == "decreasing"


def test_a_gripper_that_only_the_configuration_knows_opens_as_stated() -> None:
    description = museum.lift_with_one_arm()
    semantic = infer_semantics(description)
    (arm,) = semantic.arms
    stated = Understanding(arms={"0": list(arm.joints[:-1])}, opening={"0": "decreasing"})
    grippers = {arm.end_effector.link: StatedGripper(links=["a4"], joints=["ja4"])}
    (arm,) = with_stated_parts(semantic, stated, description, grippers).arms
    gripper = arm.end_effector.gripper
    assert gripper is not None and dict(gripper.opening_of) == {"ja4": "decreasing"}


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"arms": {"left": ["jx0", "jx2", "jx1"]}}, "joint 'jx1' is not carried by 'jx2'"),
        ({"arms": {"left": ["jx0", "jy1"]}}, "joint 'jy1' is not carried by 'jx0'"),
        ({"arms": {"left": ["jx0"], "right": ["jx0"]}}, "joint 'jx0' is also in arms.left"),
        ({"arms": {"left": ["jx0"]}, "legs": {"l": ["jx0"]}}, "joint 'jx0' is also in arms.left"),
        ({"head_joints": ["jh0"], "arms": {"0": ["jh0", "jh1"]}}, "joint 'jh0' is also in head_joints"),
        ({"legs": {"left": ["jx1", "jy0"]}}, "joint 'jy0' is not carried by 'jx1'"),
    ],
)
def test_chains_that_cannot_be_are_refused(keys: dict[str, Any], message: str) -> None:
    (text,) = _problems(museum.two_arms_without_hands(), **keys)
    assert message in text


def test_a_leg_may_be_two_chains_from_one_body_and_may_skip_joints() -> None:
    description = museum.two_arms_without_hands()
    assert _problems(description, legs={"left": ["jx0", "jx2", "jy0", "jy3"]}) == []
    assert _problems(museum.table(), arms={"0": ["j0"]}) == ["joint 'j0' is fixed; name joints that move"]


def test_a_wrong_chain_stops_an_import(tmp_path: Path) -> None:
    text = '<robot name="r"><link name="b"/>'
    for name, above in (("1", "b"), ("2", "1"), ("3", "2")):
        text += f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
        text += f'ixz="0" iyz="0"/></inertial></link><joint name="j{name}" type="revolute">'
        text += f'<parent link="{above}"/>'
        text += f'<child link="{name}"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    file = tmp_path / "r.urdf"
    file.write_text(text + "</robot>")
    config = {"urdf_path": str(file), "name": "r", "understanding": {"arms": {"0": ["j3", "j1"]}}}
    with pytest.raises(ConfigError, match=r"understanding\.arms\.0\[1\].*'j1' is not carried by 'j3'"):
        build_package(config, out=tmp_path / "data")
