"""Wheels detected from shapes and joints."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from roboyard import import_robot
from roboyard.description import load_description
from roboyard.description.robot_model import RobotModel
from roboyard.export import definition
from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.wheels import find_wheel_pair, find_wheels

WHEEL = '<cylinder radius="0.1" length="0.04"/>'


def link(name: str, geometry: str, origin: str = "") -> str:
    moments = 'ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"'
    mass = f'<inertial><mass value="1"/><inertia {moments}/></inertial>'
    return f'<link name="{name}">{mass}<collision>{origin}<geometry>{geometry}</geometry></collision></link>'


def joint(parent: str, child: str, xyz: str, axis: str = "0 1 0", kind: str = "continuous") -> str:
    return (
        f'<joint name="{child}_joint" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
        '<limit effort="5" velocity="10" lower="-1" upper="1"/></joint>'
    )


def cart(*parts: str, axis: str = "0 1 0", radius: float = 0.1, wheel: str = WHEEL) -> str:
    """A box on two wheels, 0.4 m apart, and what is added."""
    lying = '<origin rpy="1.5707963 0 0"/>'
    right = wheel.replace("0.1", str(radius))
    body = '<box size="0.5 0.3 0.1"/>'
    return (
        f'<robot name="cart">{link("base", body)}'
        f"{link('left', wheel, lying)}{link('right', right, lying)}"
        f"{joint('base', 'left', '0 0.2 0')}{joint('base', 'right', '0 -0.2 0', axis)}"
        f"{''.join(parts)}</robot>"
    )


def found(text: str) -> list[str]:
    return [wheel.link for wheel in find_wheels(load_description(text))]


def test_two_wheels_make_an_axle() -> None:
    wheels = find_wheels(load_description(cart()))
    axle = find_wheel_pair(wheels)
    assert axle is not None
    assert (axle.left, axle.right) == ("left_joint", "right_joint")
    assert axle.radius == pytest.approx(0.1, rel=1e-3)
    assert axle.length == pytest.approx(0.4, abs=1e-6)


def test_casters_raised_rollers_and_turrets_are_no_wheels() -> None:
    swivel = link("fork", '<box size="0.02 0.02 0.02"/>') + joint("base", "fork", "-0.2 0 0", "0 0 1")
    caster = link("caster", '<sphere radius="0.04"/>') + joint("fork", "caster", "-0.02 0 -0.06")
    roller = link("roller", '<sphere radius="0.04"/>') + joint("base", "roller", "0.2 0 0.1")
    turret = link("turret", WHEEL) + joint("base", "turret", "0 0 0.2", "0 0 1")
    paddle = link("paddle", '<box size="0.2 0.02 0.06"/>') + joint("base", "paddle", "0.2 0 0")
    assert found(cart(swivel, caster, roller, turret, paddle)) == ["left", "right"]


def test_a_steered_wheel_is_one_but_makes_no_axle() -> None:
    knuckle = link("knuckle", '<box size="0.02 0.02 0.02"/>')
    knuckle += joint("base", "knuckle", "0.3 0 0", "0 0 1", "revolute")
    front = link("front", WHEEL, '<origin rpy="1.5707963 0 0"/>') + joint("knuckle", "front", "0 0 0")
    wheels = find_wheels(load_description(cart(knuckle, front)))
    assert [(wheel.link, wheel.is_direct) for wheel in wheels] == [
        ("left", True),
        ("right", True),
        ("front", False),
    ]
    assert find_wheel_pair(wheels) is None


@pytest.mark.parametrize("text", [cart(axis="0 -1 0"), cart(axis="0.3 1 0"), cart(radius=0.108)])
def test_wheels_that_do_not_match_make_no_axle(text: str) -> None:
    wheels = find_wheels(load_description(text))
    assert len(wheels) == 2
    assert find_wheel_pair(wheels) is None


def test_a_robot_without_shapes_has_none() -> None:
    assert found('<robot name="r"><link name="base"/></robot>') == []


def test_the_import_of_a_cart_drives_on_its_wheels(tmp_path: Path) -> None:
    """Without a configuration."""
    file = tmp_path / "cart.urdf"
    file.write_text(cart())
    import_robot(file, name="cart", out=tmp_path / "data", validate=False, report=False)
    (written,) = (tmp_path / "data").rglob("cart.yaml")
    data = yaml.safe_load(written.read_text())
    assert data["default_controllers"] == {"base": "DifferentialDriveController"}
    assert data["two_wheel"] == {"wheel_radius": 0.1, "wheel_axle_length": 0.4}
    assert data["locomotion"]["base_joint_names"] == ["left_joint", "right_joint"]


def test_wheels_whose_axles_point_apart_drive_on_two_sides_too(tmp_path: Path) -> None:
    description = load_description(cart(axis="0 -1 0"))
    robot = RobotModel(name="cart", description=description, semantic=infer_semantics(description))
    assert robot.semantic.wheel_links == ("left", "right")
    definition.write(robot, tmp_path / "cart.yaml")
    data = yaml.safe_load((tmp_path / "cart.yaml").read_text())
    assert [wheel.forward_sign for wheel in robot.semantic.wheels] == [1, -1]
    assert data["default_controllers"] == {"base": "DifferentialDriveController"}
    assert data["locomotion"]["base_joint_names"] == ["left_joint", "right_joint"]
