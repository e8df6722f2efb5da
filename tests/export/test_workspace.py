"""Workspace ranges from sampled reach, against arms whose reach is known in closed form."""

from __future__ import annotations

import math

import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.description.semantic import Arm, EndEffector
from roboyard.export.workspace import workspace_range


def _arm(limits: str, mount: str = "0 0 0", yaw: float = 0.0) -> RobotDescription:
    """Return an arm of 1 m that turns about z on a mount, with a telescope of 0.1 m."""
    low, high = limits.split()
    return load_description(
        '<robot name="r"><link name="base"/><link name="m"/><link name="a"/><link name="t"/>'
        f'<joint name="mount" type="fixed"><parent link="base"/><child link="m"/>'
        f'<origin xyz="{mount}" rpy="0 0 {yaw}"/></joint>'
        '<joint name="j" type="revolute"><parent link="m"/><child link="a"/><axis xyz="0 0 1"/>'
        f'<limit lower="{low}" upper="{high}" effort="1" velocity="1"/></joint>'
        '<joint name="p" type="prismatic"><parent link="a"/><child link="t"/><origin xyz="0.9 0 0"/>'
        '<axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint></robot>'
    )


ARM = Arm(name="0", joints=("j", "p"), end_effector=EndEffector(link="t"))


@pytest.mark.parametrize(
    ("limits", "yaw", "expected"),
    [("-0.78 0.78", 0.0, (-45, 45)), ("0 1.56", 0.0, (0, 90)), ("-0.78 0.78", math.pi, (135, 225))],
)
def test_the_range_is_that_of_the_joint_about_the_base(limits: str, yaw: float, expected) -> None:
    assert workspace_range(_arm(limits, yaw=yaw), ARM, "base", {}) == expected


def test_an_arm_that_turns_all_around_reaches_all_around() -> None:
    assert workspace_range(_arm("-3.1 3.1"), ARM, "base", {}) == (-180, 180)


def test_a_mount_beside_the_middle_moves_the_range_to_its_side() -> None:
    """An arm of 1 m at y = 1 m reaches at least 1.6 m within 36.9 degrees of the y axis."""
    found = workspace_range(_arm("-3.14 3.14", mount="0 1 0"), ARM, "base", {})
    assert found is not None
    away = math.degrees(math.acos(0.8))  # a chord of the circle about (0, 1) from the origin is 2 cos(a)
    assert found == pytest.approx((90 - away, 90 + away), abs=5.1)


def test_nothing_beside_the_base_has_no_range() -> None:
    upright = Arm(name="0", joints=(), end_effector=EndEffector(link="base"))
    assert workspace_range(_arm("-1 1"), upright, "base", {}) is None
