"""URDF_MERGE_FIXED_LINKS, as real PyBullet 3.2.7 has it."""

from __future__ import annotations

from pathlib import Path

import pytest

import roboyard.pybullet as p


@pytest.mark.parametrize(
    ("is_fixed", "height", "parent", "mass", "center"),  # recorded with PyBullet 3.2.7
    [(False, 1.0 + 2 / 15, 0.4 - 2 / 15, 3.0, 2 / 15), (True, 1.0, 0.4, 0.0, 0.0)],
)
def test_a_fixed_base_that_links_are_merged_into_loses_its_inertial_frame(
    client: int, tmp_path: Path, is_fixed: bool, height: float, parent: float, mass: float, center: float
) -> None:
    inertia = '<inertia ixx=".1" ixy="0" ixz="0" iyy=".2" iyz="0" izz=".3"/>'
    links = "".join(
        f'<link name="{name}"><inertial><origin xyz="{place}"/><mass value="{m}"/>{inertia}</inertial></link>'
        for name, place, m in (("a", "0 0 .1", 1), ("b", "0 0 .1", 2), ("c", "0 .1 0", 1), ("d", "0 0 .2", 3))
    )
    limit = '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    joints = "".join(
        f'<joint name="{ends}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/>'
        f'<origin xyz="0 0 {z}"/>{limit}</joint>'
        for ends, kind, z in (("ab", "fixed", 0.2), ("ac", "revolute", 0.4), ("cd", "fixed", 0.5))
    )
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{links}{joints}</robot>')
    body = p.loadURDF(
        str(tmp_path / "r.urdf"), [0, 0, 1], useFixedBase=is_fixed, flags=p.URDF_MERGE_FIXED_LINKS
    )
    assert p.getBasePositionAndOrientation(body)[0] == pytest.approx((0, 0, height), abs=1e-9)
    assert p.getJointInfo(body, 0)[14] == pytest.approx((0, 0, parent), abs=1e-9)
    base, link = p.getDynamicsInfo(body, -1), p.getDynamicsInfo(body, 0)
    assert base[0] == mass
    assert base[3] == pytest.approx((0, 0, center), abs=1e-9)
    assert link[0] == 4.0
    assert link[3] == pytest.approx((0, 0, 0.375), abs=1e-9)
    assert p.getLinkState(body, 0)[0] == pytest.approx((0, 0, 1.775), abs=1e-9)
