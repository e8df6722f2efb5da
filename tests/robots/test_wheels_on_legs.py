"""Robots whose legs end in wheels: all joints in one group, and wheels that turn without end."""

from __future__ import annotations

from roboyard import World, add_robot
from roboyard.description import load_description


def test_wheels_at_the_ends_of_legs_are_driven_with_them() -> None:
    """Four legs of three joints, each with a wheel: one group of position drives."""
    parts = ['<robot name="r">', _solid("b", '<box size="0.6 0.3 0.1"/>', 10)]
    for name, x, y in (("p", 0.25, 0.2), ("q", 0.25, -0.2), ("r", -0.25, 0.2), ("s", -0.25, -0.2)):
        above, place = "b", f"{x} {y} 0"
        for k, axis in enumerate(("1 0 0", "0 1 0", "0 1 0")):
            parts.append(_solid(f"{name}{k}", '<box size="0.03 0.03 0.2"/>', 0.5, "0 0 -0.1"))
            parts.append(_turning(f"{name}{k}", above, place, axis, "revolute"))
            above, place = f"{name}{k}", "0 0 -0.2"
        parts.append(_solid(f"{name}w", '<cylinder radius="0.06" length="0.03"/>', 0.3, rpy="1.5708 0 0"))
        parts.append(_turning(f"{name}w", above, "0 0 -0.2", "0 1 0", "continuous"))
    description = load_description("".join([*parts, "</robot>"]))
    robot = add_robot(World(gravity=(0, 0, 0)), description)
    group = robot.groups["base"]
    assert len(group.joints) == 16 and {"jpw", "jqw", "jrw", "jsw"} <= set(group.joints)
    action = robot.no_op_action()
    index = group.joints.index("jpw")
    for _ in range(10):
        action[index] = 0.2
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
    turned = dict(zip(robot.joint_names, robot.joint_positions, strict=True))
    assert turned["jpw"] > 1.0
    assert max(abs(turned[name]) for name in group.joints if name != "jpw") < 0.1


def _solid(name: str, shape: str, mass: float, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<collision><origin xyz="{xyz}" rpy="{rpy}"/>'
        f"<geometry>{shape}</geometry></collision></link>"
    )


def _turning(child: str, parent: str, xyz: str, axis: str, kind: str) -> str:
    return (
        f'<joint name="j{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        '<limit lower="-1.5" upper="1.5" effort="30" velocity="20"/></joint>'
    )
