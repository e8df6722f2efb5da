"""Every code: a robot that has the fault gets the finding, one that nearly has it does not."""

import re
from pathlib import Path

import pytest
from audit_cases import CASES, arm, write_case

from roboyard.audit import CHECKS, ERROR, audit_urdf
from roboyard.description import load_description

TESTED_ELSEWHERE = {"file-unreadable", "not-loadable", "format-omitted"}  # no robot; any robot; test_mjcf.py


def test_a_robot_without_faults_has_no_findings(tmp_path: Path) -> None:
    result = audit_urdf(write_case(arm(), tmp_path))
    assert result.findings == ()
    assert result.status == "ok"
    assert (result.facts.links, result.facts.moving_joints, result.facts.mass) == (2, 1, 2.0)


def test_every_code_has_a_case() -> None:
    assert set(CASES) | TESTED_ELSEWHERE == set(CHECKS)


@pytest.mark.parametrize("code", CASES)
def test_the_fault_is_found(code: str, tmp_path: Path) -> None:
    result = audit_urdf(write_case(CASES[code][0], tmp_path))
    found = result.of(code)
    assert found, result.codes
    for finding in found:
        assert finding.message
        assert finding.remedy
        assert not re.search(r"[.;]$", finding.message)
    others = [f.code for f in result.findings if f.severity == ERROR and f.code != code]
    assert len(others) <= 1, f"one fault, {len(others)} other blocking findings: {others}"


@pytest.mark.parametrize("code", CASES)
def test_the_near_fault_is_not(code: str, tmp_path: Path) -> None:
    result = audit_urdf(write_case(CASES[code][1], tmp_path))
    assert code not in result.codes
    assert "not-loadable" not in result.codes


@pytest.mark.parametrize("code", [code for code in CASES if code != "too-many-links"])
def test_the_status_agrees_with_the_reader(code: str, tmp_path: Path) -> None:
    """A file without errors in its audit can be read."""
    from roboyard.errors import DescriptionError

    file = write_case(CASES[code][0], tmp_path)
    result = audit_urdf(file)
    assert "not-loadable" not in result.codes
    blocked = any(finding.severity == ERROR for finding in result.findings)
    try:
        load_description(file)
        # meshes are not opened yet, and masses are read as they are written
        assert not blocked or code.startswith("mesh-") or code == "mass-negative"
    except DescriptionError:
        assert blocked


@pytest.mark.parametrize("code", CHECKS)
def test_every_check_is_described(code: str) -> None:
    check = CHECKS[code]
    assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)+", code)
    assert check.about.endswith(".")
    assert check.remedy
    assert not check.remedy.endswith(".")
    assert check.example


def test_a_missing_file_is_a_finding_with_its_name(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.urdf", tmp_path):
        result = audit_urdf(path)
        assert result.codes == ("file-unreadable",)
        assert not result.is_usable


def test_what_only_the_reader_refuses_is_a_finding(tmp_path: Path) -> None:
    file = write_case(arm(axis='<axis xyz="1.7e308 1.7e308 0"/>'), tmp_path)
    result = audit_urdf(file)
    assert result.codes == ("not-loadable",)
    assert "<axis> is too large" in result.findings[0].message
