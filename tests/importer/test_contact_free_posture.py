"""Rest postures in which no two links overlap that the robot can hold apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.description import load_description
from roboyard.importer.build import build_package
from roboyard.importer.planning.contact_checker import ContactChecker
from roboyard.importer.planning.contact_free_posture import contact_free_posture, joints_between

LINK = """<link name="{name}"><collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry>
</collision></link>"""
HINGE = """<joint name="{child}_joint" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{xyz}"/><axis xyz="0 1 0"/><limit lower="{lower}" upper="{upper}" effort="9" velocity="1"/>
{mimic}</joint>"""


def link(name: str, size: str, xyz: str = "0 0 0") -> str:
    return LINK.format(name=name, size=size, xyz=xyz)


def hinge(child: str, parent: str, xyz: str, mimic: str = "") -> str:
    return HINGE.format(child=child, parent=parent, xyz=xyz, lower=-2, upper=1, mimic=mimic)


def folded_arm(mimic: str = "") -> str:
    """A column and an arm of two links, whose second is in the column at zero."""
    parts = [
        link("column", "0.1 0.1 0.92", "0 0 0.46"),
        link("upper", "0.3 0.04 0.04", "0.25 0 0"),
        link("fore", "0.44 0.04 0.04", "-0.22 0 0"),
        hinge("upper", "column", "0 0 0.8"),
        hinge("fore", "upper", "0.4 0 0.06", mimic),
    ]
    return f'<robot name="folded">{"".join(parts)}</robot>'


def test_the_smallest_turn_of_one_joint_frees_a_pair() -> None:
    checker = ContactChecker(load_description(folded_arm()))
    rest = {"upper_joint": 0.0, "fore_joint": 0.0}
    assert checker.overlaps(rest)["column", "fore"] > 0.02
    found = contact_free_posture(checker, rest)
    assert list(found) == ["fore_joint"]
    free = {**rest, **found}
    assert not checker.overlaps(free)
    nearer = {**free, "fore_joint": found["fore_joint"] - (0.15 if found["fore_joint"] > 0 else -0.15)}
    assert checker.overlaps(nearer)
    assert contact_free_posture(checker, free) == {}


def test_joints_that_have_to_stay_do() -> None:
    checker = ContactChecker(load_description(folded_arm()))
    rest = {"upper_joint": 0.0, "fore_joint": 0.0}
    assert contact_free_posture(checker, rest, still={"upper_joint", "fore_joint"}) == {}
    assert "fore_joint" not in contact_free_posture(checker, rest, still={"fore_joint"})


def test_a_cover_that_always_overlaps_is_left_alone() -> None:
    parts = [
        link("base", "0.1 0.1 0.4"),
        link("turret", "0.01 0.01 0.01"),
        link("cover", "0.3 0.3 0.3"),
        hinge("turret", "base", "0 0 0.1"),
        hinge("cover", "turret", "0 0 0"),
    ]
    checker = ContactChecker(load_description(f'<robot name="cover">{"".join(parts)}</robot>'))
    rest = {"turret_joint": 0.0, "cover_joint": 0.0}
    assert checker.overlaps(rest)["base", "cover"] > 0.1
    assert contact_free_posture(checker, rest) == {}


def test_a_follower_is_moved_by_its_leader() -> None:
    description = load_description(folded_arm('<mimic joint="upper_joint" multiplier="-1"/>'))
    checker = ContactChecker(description)
    rest = {"upper_joint": 0.0, "fore_joint": 0.0}
    assert [joint.name for joint in joints_between(description, "column", "fore")] == [
        "fore_joint",
        "upper_joint",
    ]
    found = contact_free_posture(checker, rest)
    assert list(found) == ["upper_joint"]
    assert not checker.overlaps({**rest, **found})
    turned = checker.overlaps({"upper_joint": found["upper_joint"], "fore_joint": -found["upper_joint"]})
    assert turned == checker.overlaps(found)


def test_an_import_rests_without_contact_and_says_so(tmp_path: Path) -> None:
    file = tmp_path / "folded.urdf"
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    inertial = f'<inertial><mass value="1"/>{inertia}</inertial>'
    file.write_text(folded_arm().replace("<collision>", inertial + "<collision>"))
    robot = build_package(file, name="folded", out=tmp_path / "data").robot
    rest = robot.semantic.postures["rest"]
    assert rest["fore_joint"] != pytest.approx(0.0)
    assert not ContactChecker(robot.description).overlaps(rest)
    log = (tmp_path / "data").rglob("import_log.json")
    assert "the robot can hold apart" in next(log).read_text()
