"""Every fix: the fault is gone, the robot moves as before, and a second repair changes nothing."""

from pathlib import Path

import numpy as np
import pytest
from audit_cases import CASES, write_case

from roboyard.audit import CHECKS, audit_urdf
from roboyard.description import RobotDescription, load_description
from roboyard.errors import DescriptionError
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.repair import FIXES, repair_urdf

FIXABLE = [code for code, check in CHECKS.items() if check.fixable]
UNREADABLE = ("xml-unsafe", "xml-syntax", "root-not-robot", "too-many-links", "format-refused")
READABLE = [code for code in CASES if code not in UNREADABLE]


def contents(folder: Path) -> dict[str, bytes]:
    """The robot's files, without the logs."""
    logs = {"repair_log.json", "repair.diff", "renames.json"}
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in folder.rglob("*")
        if file.is_file() and file.name not in logs
    }


def random_positions(robot: RobotDescription) -> dict[str, float]:
    rng = np.random.default_rng(7)
    one_axis = ("revolute", "continuous", "prismatic")
    return {j.name: rng.uniform(-2, 2) for j in robot.joints if j.type in one_axis and j.mimic is None}


def test_every_fixable_code_has_a_fix() -> None:
    assert set(FIXABLE) == set(FIXES)


@pytest.mark.parametrize("code", FIXABLE)
def test_the_fault_is_fixed_and_logged(code: str, tmp_path: Path) -> None:
    file = write_case(CASES[code][0], tmp_path)
    assert all(finding.fixable for finding in audit_urdf(file).of(code))
    result = repair_urdf(file, tmp_path / "out")
    assert code not in result.after.codes
    fixes = [fix for fix in result.fixes if fix.code == code]
    assert fixes
    assert all(fix.before != fix.after for fix in fixes)
    assert set(result.after.codes) <= set(result.before.codes)


@pytest.mark.parametrize("code", READABLE)
def test_repairing_a_repaired_robot_changes_nothing(code: str, tmp_path: Path) -> None:
    first = repair_urdf(write_case(CASES[code][0], tmp_path), tmp_path / "one")
    second = repair_urdf(first.urdf, tmp_path / "two")
    assert second.fixes == ()
    assert second.diff == ""
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


@pytest.mark.parametrize("code", READABLE)
def test_the_robot_moves_as_before(code: str, tmp_path: Path) -> None:
    file = write_case(CASES[code][0], tmp_path)
    try:
        before = load_description(file)
    except DescriptionError as error:
        assert str(error).startswith(file.name)
        assert audit_urdf(file).status in ("usable after repair", "not usable")
        return
    result = repair_urdf(file, tmp_path / "out")
    after = load_description(result.urdf)
    links, joints = result.renames["links"], result.renames["joints"]
    q = random_positions(before)
    old = forward_kinematics(before, q)
    new = forward_kinematics(after, {joints.get(name, name): value for name, value in q.items()})
    assert [links.get(link.name, link.name) for link in before.links] == [link.name for link in after.links]
    for name, pose in old.items():
        np.testing.assert_allclose(new[links.get(name, name)], pose, atol=1e-9)


def test_a_rod_keeps_the_moments_that_were_not_rounded_away(tmp_path: Path) -> None:
    tip = '<inertial><mass value="0.03"/><inertia ixx="1.2e-4" ixy="0" ixz="0" iyy="1.2e-4" iyz="0" izz="0"/>'
    file = tmp_path / "rod.urdf"
    file.write_text(
        f'<robot name="rod"><link name="base"/><link name="tip">{tip}</inertial></link>'
        '<joint name="turn" type="continuous"><parent link="base"/><child link="tip"/></joint></robot>'
    )
    result = repair_urdf(file, tmp_path / "out")
    assert [fix.code for fix in result.fixes if fix.element == 'link "tip"'] == ["inertia-not-positive"]
    inertial = load_description(result.urdf).link_by_name["tip"].inertial
    assert inertial is not None
    np.testing.assert_allclose(inertial.matrix(), np.diag([1.2e-4, 1.2e-4, 1.2e-7]), rtol=1e-6)


LEAVES_A_NOTE = {"mimic-cycle", "material-undefined", "texture-missing", "geometry-unknown", "xacro-color"}


@pytest.mark.parametrize("code", [code for code in READABLE if code not in LEAVES_A_NOTE])
def test_a_usable_robot_is_read_strictly_after_repair(code: str, tmp_path: Path) -> None:
    file = write_case(CASES[code][0], tmp_path)
    result = repair_urdf(file, tmp_path / "out")
    if not result.before.is_usable:
        assert not result.after.is_usable
        return
    assert result.after.is_usable
    assert load_description(result.urdf, strict=True).notes == ()


FIXED_BY_WRITING = {"xml-tolerated", "mesh-found-nearby"}


@pytest.mark.parametrize("code", [code for code in FIXABLE if code not in FIXED_BY_WRITING])
def test_keep_leaves_a_code_as_it_is(code: str, tmp_path: Path) -> None:
    result = repair_urdf(write_case(CASES[code][0], tmp_path), tmp_path / "out", keep=[code])
    assert code in result.after.codes
    assert code not in {fix.code for fix in result.fixes}


def test_only_fixes_the_named_codes(tmp_path: Path) -> None:
    text = str(CASES["axis-not-unit"][0]).replace('name="j"', 'name="joint 1"')
    result = repair_urdf(write_case(text, tmp_path), tmp_path / "out", only=["axis-not-unit"])
    assert {fix.code for fix in result.fixes} == {"axis-not-unit"}
    assert result.after.codes == ("joint-name-odd",)
