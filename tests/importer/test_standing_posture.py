"""Robots with four legs stand with their feet under their hips where the file's posture would topple."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.semantic import Leg
from roboyard.importer.planning.standing_posture import standing_posture
from roboyard.importer.planning.tuck_posture import _rounded
from roboyard.kinematics.description_poses import forward_kinematics

THIGH, CALF = 0.2, 0.2
LINK = """
<link name="{name}">
  <inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0 0 {z}"/><geometry><box size="{size}"/></geometry></collision>
</link>"""
JOINT = """
<joint name="{child}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="{xyz}"/><axis xyz="0 1 0"/>
  <limit lower="{lower}" upper="{upper}" effort="50" velocity="20"/></joint>"""


def dog(tmp_path: Path, calf_range: tuple[float, float]) -> Path:
    """Write a quadruped whose legs are thighs and calves of equal length, with small cubes as feet."""
    parts = [LINK.format(name="trunk", z=0, mass=10, size="0.5 0.2 0.1")]
    for front, x in (("f", 0.2), ("r", -0.2)):
        for side, y in (("l", 0.12), ("r", -0.12)):
            leg = front + side
            parts += [
                LINK.format(name=f"{leg}_thigh", z=-THIGH / 2, mass=1, size="0.03 0.03 0.16"),
                LINK.format(name=f"{leg}_calf", z=-CALF, mass=0.2, size="0.02 0.02 0.02"),
                JOINT.format(child=f"{leg}_thigh", parent="trunk", xyz=f"{x} {y} 0", lower=-1.5, upper=3),
                JOINT.format(
                    child=f"{leg}_calf",
                    parent=f"{leg}_thigh",
                    xyz=f"0 0 {-THIGH}",
                    lower=calf_range[0],
                    upper=calf_range[1],
                ),
            ]
    file = tmp_path / "dog.urdf"
    file.write_text(f'<robot name="dog">{"".join(parts)}</robot>')
    return file


LEGS = [
    Leg(name=leg, joints=(f"{leg}_thigh", f"{leg}_calf"), foot=f"{leg}_calf")
    for leg in ("fl", "fr", "rl", "rr")
]


def test_feet_are_brought_under_the_hips(tmp_path: Path) -> None:
    description = load_description(dog(tmp_path, (-2.7, -0.9)))
    rest = {name: -0.9 if name.endswith("calf") else 0.0 for leg in LEGS for name in leg.joints}
    found = standing_posture(description, LEGS, rest)
    poses = forward_kinematics(description, found)
    for leg in LEGS:
        foot = poses[leg.foot] @ np.array([0, 0, -CALF, 1.0])
        hip = poses[leg.joints[0]][:3, 3]
        assert foot[0] == pytest.approx(hip[0], abs=0.03)
        # two links of 0.2 m, about 0.8 of what they can reach; closed form of the triangle
        bend = -found[leg.joints[1]]
        assert hip[2] - foot[2] == pytest.approx(2 * THIGH * math.cos(bend / 2), abs=0.01)
        assert 0.28 < hip[2] - foot[2] < 0.36
        assert -2.7 <= found[leg.joints[1]] <= -0.9
    assert len({found[leg.joints[1]] for leg in LEGS}) <= 3  # legs that are alike, up to a digit


def test_a_robot_that_stands_is_left_alone(tmp_path: Path) -> None:
    description = load_description(dog(tmp_path, (-1.5, 1.5)))
    assert standing_posture(description, LEGS, {name: 0.0 for leg in LEGS for name in leg.joints}) == {}


def test_two_legs_are_left_alone(tmp_path: Path) -> None:
    description = load_description(dog(tmp_path, (-2.7, -0.9)))
    assert standing_posture(description, LEGS[:2], {}) == {}


def test_rounded_positions_stay_within_limits(tmp_path: Path) -> None:
    description = load_description(dog(tmp_path, (-2.70049, -0.90049)))
    assert _rounded(description, "fl_calf", -0.90049) == -0.90049
    assert _rounded(description, "fl_calf", -1.23456) == pytest.approx(-1.23456, abs=6e-4)
