"""Wheels that a file draws on fixed joints, on a base that virtual joints move."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from roboyard import World, add_robot
from roboyard.importer.build import build_package
from roboyard.robots import Registry

INERTIAL = """<inertial><origin xyz="0 0 {z}"/><mass value="{mass}"/>
<inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial>"""
SHAPE = '<collision><origin xyz="0 0 {z}" rpy="{rpy}"/><geometry>{shape}</geometry></collision>'
ROUND = '<cylinder radius="0.1" length="0.05"/>'


def link(name: str, shape: str, mass: float, rpy: str = "0 0 0", z: float = 0.0) -> str:
    inside = INERTIAL.format(mass=mass, z=z) + SHAPE.format(shape=shape, rpy=rpy, z=z)
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, kind: str, parent: str, child: str, xyz: str, axis: str = "0 0 1") -> str:
    limits = '<limit lower="-2" upper="2" effort="90" velocity="2"/>' if kind == "revolute" else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limits}</joint>'
    )


def three_wheels_and_an_arm() -> str:
    """A platform on three wheels at thirds of a circle, all on fixed joints, and an arm of four joints."""
    parts = [link("base", '<box size="0.5 0.5 0.2"/>', 40.0)]
    for k, angle in enumerate(np.radians((0.0, 120.0, 240.0))):
        x, y = 0.3 * np.cos(angle), 0.3 * np.sin(angle)
        parts.append(link(f"wheel_{k}", ROUND, 2.0, f"1.5708 0 {angle + np.pi / 2:.4f}"))
        parts.append(joint(f"wheel_{k}_joint", "fixed", "base", f"wheel_{k}", f"{x:.4f} {y:.4f} -0.1"))
    above, place = "base", "0 0 0.1"
    for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "0 1 0")):
        parts.append(link(f"arm_{k}", '<box size="0.05 0.05 0.18"/>', 0.5, z=0.1))
        parts.append(joint(f"arm_{k}_joint", "revolute", above, f"arm_{k}", place, axis))
        above, place = f"arm_{k}", "0 0 0.2"
    return f'<robot name="platform">{"".join(parts)}</robot>'


def test_a_base_on_wheels_without_joints_drives_every_way(tmp_path: Path) -> None:
    file = tmp_path / "platform.urdf"
    file.write_text(three_wheels_and_an_arm())
    built = build_package(file, name="platform", out=tmp_path / "data").robot
    assert built.semantic.base == "holonomic"
    world = World(timestep=1 / 240)
    world.add_plane()
    robot = add_robot(world, Registry(tmp_path / "data")["platform"])
    assert robot.locomotion is not None
    floor = {item.name for item in robot.locomotion.floor_touching_links}
    assert floor == {"wheel_0", "wheel_1", "wheel_2"}
    action = robot.no_op_action()
    action[robot.controller_action_idx["base"]] = robot.controllers["base"].scaling.invert(
        np.array([0.0, 0.2, 0.0])
    )
    start = robot.position
    for _ in range(round(2 * robot.control_freq)):
        robot.apply_action(action)
        world.step(robot.steps_per_control)
    moved = robot.position - start
    assert 0.3 < moved[1] < 0.42 and abs(moved[0]) < 0.01
