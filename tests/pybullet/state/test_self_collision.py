"""Which links of one body touch one another, compared with PyBullet 3.2.7."""

from __future__ import annotations

from pathlib import Path

import pytest

import roboyard.pybullet as p

SELF, NO_PARENTS = p.URDF_USE_SELF_COLLISION, p.URDF_USE_SELF_COLLISION_EXCLUDE_PARENT
NO_ANCESTORS = p.URDF_USE_SELF_COLLISION_EXCLUDE_ALL_PARENTS
BODY = """<inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.2"/></geometry></collision>"""


def _chain(folder: Path, kinds: str) -> str:
    """Write balls within one another, one for each joint and the base."""
    links, joints, parent = [f'<link name="base">{BODY}</link>'], [], "base"
    for number, kind in enumerate(kinds):
        links.append(f'<link name="l{number}">{BODY}</link>')
        joint = {"r": "revolute", "f": "fixed"}[kind]
        joints.append(
            f'<joint name="j{number}" type="{joint}"><parent link="{parent}"/>'
            f'<child link="l{number}"/><origin xyz="0 0 0.01"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )
        parent = f"l{number}"
    file = folder / f"{kinds}.urdf"
    file.write_text(f'<robot name="chain">{"".join(links + joints)}</robot>')
    return str(file)


@pytest.mark.parametrize(
    ("kinds", "flags", "fixed", "pairs"),
    [
        ("rrr", SELF, False, {(-1, 1), (-1, 2), (0, 2)}),
        ("rrr", SELF, True, {(-1, 1), (-1, 2), (0, 2)}),
        ("rrr", SELF | NO_PARENTS, True, {(-1, 1), (-1, 2), (0, 2)}),
        ("rrr", SELF | NO_ANCESTORS, True, set()),
        ("rrr", 0, True, set()),
        ("frr", SELF, False, {(-1, 1), (-1, 2), (0, 2)}),
        ("frr", SELF, True, {(-1, 1), (-1, 2), (0, 2)}),
        ("rfr", SELF, False, {(-1, 1), (-1, 2), (0, 2)}),
        ("frfr", SELF, False, {(-1, 1), (-1, 2), (-1, 3), (0, 2), (0, 3), (1, 3)}),
        ("frfr", SELF | NO_ANCESTORS, False, set()),
    ],
)
def test_links_touch_all_but_their_parents(
    client: int, tmp_path: Path, kinds: str, flags: int, fixed: bool, pairs: set[tuple[int, int]]
) -> None:
    body = p.loadURDF(_chain(tmp_path, kinds), useFixedBase=fixed, flags=flags)
    p.stepSimulation()
    assert {tuple(sorted(point[3:5])) for point in p.getContactPoints(body)} == pairs


def test_a_pair_that_is_enabled_does_not_touch_its_parent(client: int, tmp_path: Path) -> None:
    body = p.loadURDF(_chain(tmp_path, "r"), useFixedBase=True, flags=SELF)
    p.setCollisionFilterPair(body, body, -1, 0, 1)
    p.stepSimulation()
    assert p.getContactPoints(body) == ()
