"""A walker that slides and turns in a plane is fixed by its root link, and its legs alone are driven."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.morphology.base.virtual import guide_joints
from roboyard.robots import add_robot
from roboyard.sim.world import World

LINK = (
    '<link name="{name}"><inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/><inertia ixx="0.02" ixy="0" '
    'ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>{shape}</link>'
)
BOX = '<collision><origin xyz="0 0 {z}"/><geometry><box size="{size}"/></geometry></collision>'


def part(name: str, size: str = "", z: float = 0.0, mass: float = 0.01) -> str:
    return LINK.format(name=name, mass=mass, z=z, shape=BOX.format(size=size, z=z) if size else "")


def joint(
    name: str, parent: str, child: str, kind: str, axis: str, xyz: str = "0 0 0", limit: str = ""
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


LIMIT = '<limit lower="-1.5" upper="1.5" effort="80" velocity="8"/>'


def walker(root: str = "", rail: str = "") -> RobotDescription:
    """Return two legs with feet under a body that moves in the y-z plane.

    `root` and `rail` are sizes of boxes, none by default.
    """
    slide = '<limit lower="-50" upper="50" effort="0" velocity="10"/>'
    text = part("world", root, mass=0.0) + part("ry", rail) + part("rz")
    text += part("body", "0.1 0.1 0.4", mass=6)
    text += joint("y", "world", "ry", "prismatic", "0 1 0", limit=slide)
    text += joint("z", "ry", "rz", "prismatic", "0 0 1", limit=slide)
    text += joint("turn", "rz", "body", "continuous", "1 0 0", "0 0 1")
    for side, x in (("left", -0.06), ("right", 0.06)):
        text += part(f"{side}_thigh", "0.05 0.05 0.3", -0.15, 1) + part(
            f"{side}_shin", "0.05 0.05 0.3", -0.15, 1
        )
        text += part(f"{side}_foot", "0.06 0.3 0.04", -0.02, 0.5)
        text += joint(f"{side}_hip", "body", f"{side}_thigh", "revolute", "1 0 0", f"{x} 0 -0.2", LIMIT)
        text += joint(f"{side}_knee", f"{side}_thigh", f"{side}_shin", "revolute", "1 0 0", "0 0 -0.3", LIMIT)
        text += joint(f"{side}_ankle", f"{side}_shin", f"{side}_foot", "revolute", "1 0 0", "0 0 -0.3", LIMIT)
    return load_description(f'<robot name="planar">{text}</robot>')


def test_its_root_is_fixed_and_its_base_moves_in_the_plane() -> None:
    world = World()
    world.add_plane()
    robot = add_robot(world, walker())
    assert robot.body.is_fixed
    assert robot.guide_joints == ("y", "z", "turn")
    assert list(robot.groups) == ["base"]
    assert not {"y", "z", "turn"} & set(robot.groups["base"].joints)
    height = robot.position[2]
    assert height == pytest.approx(0.2 + 0.6 + 0.04, abs=1e-6)  # on its feet
    robot.apply_action(robot.no_op_action())
    world.step(240)
    np.testing.assert_allclose(robot.position, [0, 0, height], atol=3e-3)  # it stands
    tilted = robot.joint_positions
    tilted[robot.joint_arrays.index["turn"]] = 0.6
    robot.joint_arrays.q = tilted
    world.step(360)
    assert robot.position[2] < 0.5 * height  # it falls in its plane
    assert abs(robot.position[0]) < 1e-6
    assert np.isfinite(robot.joint_positions).all()


@pytest.mark.parametrize(("root", "rail"), [("1 1 0.1", ""), ("", "0.1 0.1 0.1")])
def test_joints_that_move_drawn_parts_are_no_guides(root: str, rail: str) -> None:
    assert guide_joints(walker(root, rail), "body") == ()


def test_joints_above_other_robots_bases_are_guides_of_none() -> None:
    description = load_description(
        f'<robot name="r">{part("a", "1 1 1")}{part("b", "1 1 1")}'
        f"{joint('j', 'a', 'b', 'continuous', '0 0 1')}</robot>"
    )
    assert guide_joints(description, "a") == ()
    assert guide_joints(description, "b") == ()
