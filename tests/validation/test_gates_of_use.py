"""Gates on what a user meets first: parts, placement, standing, arms that carry, rest contact, spheres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import RobotDescription
from roboyard.robots import parse_definition
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.shapes import primitives
from roboyard.shapes.surface_points import share_near_spheres, surface_points
from roboyard.validation.gates.complete import complete_gates
from roboyard.validation.gates.drive import drive_gates
from roboyard.validation.gates.free_joints import free_joint_gates
from roboyard.validation.gates.rest_contact import rest_contact_gates
from roboyard.validation.gates.spheres import sphere_gates
from roboyard.validation.gates.stand import stand_gates
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld as ValidationWorld

INERTIAL = (
    '<inertial><origin xyz="{com}"/><mass value="{mass}"/>'
    '<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>'
)


def link(name: str, size: str, *, at: str = "0 0 0", com: str = "0 0 0", mass: float = 2.0) -> str:
    """Return a box of a size (m) and a mass (kg)."""
    shape = f'<origin xyz="{at}"/><geometry><box size="{size}"/></geometry>'
    inertial = INERTIAL.format(com=com, mass=mass)
    return f'<link name="{name}">{inertial}<visual>{shape}</visual><collision>{shape}</collision></link>'


def hinge(name: str, parent: str, child: str, xyz: str, extra: str = "", kind: str = "revolute") -> str:
    """Return a hinge about y with limits of 1.5 rad, unless it is continuous."""
    limit = '<limit lower="-1.5" upper="1.5" effort="60" velocity="5"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="0 1 0"/>{limit}{extra}</joint>'
    )


def legged(com: str = "0 0 0", foot: str = "0.3 0.2 0.02") -> RobotDescription:
    """Return a body on two legs with flat feet."""
    text = '<robot name="walker">' + link("body", "0.2 0.3 0.2", com=com, mass=8.0)
    for side, y in (("left", 0.15), ("right", -0.15)):
        text += link(side, foot, at="0 0 -0.4", com="0 0 -0.2", mass=1.0)
        text += hinge(f"{side}_hip", "body", side, f"0 {y} -0.1")
    return load_description(text + "</robot>")


def definition(**blocks: object) -> RobotDefinition:
    """Return a definition with the groups that its blocks make."""
    data = {"raw_controller_order": [], "default_controllers": {}, **blocks}
    return parse_definition(data)


LEGS = definition(
    raw_controller_order=["base"],
    default_controllers={"base": "JointController"},
    locomotion={
        "base_joint_names": ["left_hip", "right_hip"],
        "floor_touching_base_link_names": ["left", "right"],
    },
)


def gates(
    make: Callable[[ValidationWorld], tuple[Gate, ...]],
    description: RobotDescription,
    given: RobotDefinition,
    **more: Any,
) -> dict[str, Gate]:
    """Return the gates of one function by name."""
    world = ValidationWorld(name="x", source=description, definition=given, **more)
    return {gate.name: gate for gate in make(world)}


def test_a_robot_whose_weight_is_over_its_feet_stands() -> None:
    found = gates(stand_gates, legged(), LEGS)
    assert found["start"].passed
    assert found["start"].figure < 1e-3
    assert found["stand"].passed
    assert found["stand"].figure < 0.05


def test_a_robot_falls_whose_weight_is_beyond_its_feet() -> None:
    """Of 10 kg, 8 are 0.5 m in front: 0.4 m, and the feet reach to 0.15 m."""
    gate = gates(stand_gates, legged(com="0.5 0 0"), LEGS)["stand"]
    assert not gate.passed
    assert "falls after" in gate.findings[0]
    assert "cm outside its support polygon (left, right)" in gate.findings[0]
    margin = float(gate.findings[0].split("centre of mass is ")[1].split(" cm")[0])
    assert margin == pytest.approx(25.0, abs=2.0)


def test_two_legs_with_feet_of_no_area_need_a_controller() -> None:
    """It falls, as any such robot does: no robot that falls passes, and the cause is named."""
    gate = gates(stand_gates, legged(com="0.02 0 0", foot="0.004 0.2 0.02"), LEGS)["stand"]
    assert not gate.passed
    assert "no fixed posture balances" in gate.findings[0]
    assert "it needs a balancing controller" in gate.findings[0]


def test_feet_of_no_area_are_named_as_the_cause() -> None:
    """With a third leg a posture could balance it; this one stands on a line."""
    text = '<robot name="walker">' + link("body", "0.2 0.5 0.2", com="0.02 0 0", mass=8.0)
    for side, y in (("left", 0.2), ("middle", 0.0), ("right", -0.2)):
        text += link(side, "0.004 0.1 0.02", at="0 0 -0.4", com="0 0 -0.2", mass=1.0)
        text += hinge(f"{side}_hip", "body", side, f"0 {y} -0.1")
    names = ["left", "middle", "right"]
    given = definition(
        raw_controller_order=["base"],
        default_controllers={"base": "JointController"},
        locomotion={
            "base_joint_names": [f"{name}_hip" for name in names],
            "floor_touching_base_link_names": names,
        },
    )
    gate = gates(stand_gates, load_description(text + "</robot>"), given)["stand"]
    assert not gate.passed
    assert "no fixed posture balances" in gate.findings[0]


def test_an_arm_that_carries_the_robot_fails() -> None:
    both = definition(
        raw_controller_order=["base", "arm_0"],
        default_controllers={"arm_0": "JointController", "base": "JointController"},
        locomotion={"base_joint_names": ["right_hip"], "floor_touching_base_link_names": ["right"]},
        manipulation={
            "n_arms": 1,
            "arm_joint_names": {"0": ["left_hip"]},
            "eef_link_names": {"0": "left"},
        },
    )
    gate = gates(stand_gates, legged(), both)["arms_free"]
    assert not gate.passed
    assert gate.findings[0].startswith("arm '0' carries the robot: its link 'left' is on the floor")


def test_parts_that_the_kind_wants_are_missing() -> None:
    understood = {"kind": "biped", "base": "legged", "arms": {"left": ["x"]}, "grippers": {}}
    bare = definition(articulated_trunk={"trunk_joint_names": ["left_hip"]}, raw_controller_order=["trunk"])
    gate = gates(complete_gates, legged(), bare, understood=understood)["complete"]
    assert gate.figure == 2.0
    assert "no group moves the base" in gate.findings[0]
    assert "arm 'left' has no group" in gate.findings[1]
    sound = gates(complete_gates, legged(), LEGS, understood={"kind": "biped", "base": "legged"})["complete"]
    assert sound.passed
    nothing = gates(complete_gates, legged(), definition(), understood={"kind": "other"})["complete"]
    assert nothing.findings == ["it has 2 joints and no action drives any of them"]


@pytest.mark.parametrize(("mimic", "swings"), [("", True), ('<mimic joint="shoulder"/>', False)])
def test_a_finger_that_mimics_nothing_swings(mimic: str, swings: bool) -> None:
    text = (
        '<robot name="hand">'
        + link("base", "0.2 0.2 0.2")
        + link("arm", "0.05 0.05 0.3", at="0 0 0.15")
        + link("finger", "0.05 0.02 0.1", at="0.1 0 0", com="0.1 0 0", mass=0.1)
        + hinge("shoulder", "base", "arm", "0 0 1")
        + hinge("knuckle", "arm", "finger", "0 0 0.4", mimic, kind="revolute" if mimic else "continuous")
        + "</robot>"
    )
    trunk = definition(articulated_trunk={"trunk_joint_names": ["shoulder"]}, raw_controller_order=["trunk"])
    gate = gates(free_joint_gates, load_description(text), trunk)["free_joints"]
    assert gate.passed is not swings
    if swings:
        assert "joint 'knuckle' swings freely" in gate.findings[0]


@pytest.mark.parametrize(("rest", "touching"), [(0.0, 0), (1.4, 1)])
def test_a_posture_that_folds_into_the_body_is_a_rest_contact(rest: float, touching: int) -> None:
    """Disabling the pair must not hide it."""
    text = (
        '<robot name="folder">'
        + link("base", "0.2 0.2 0.5")
        + link("shoulder", "0.02 0.02 0.02")
        + link("arm", "0.05 0.05 0.4", at="0 0 0.2")
        + hinge("a", "base", "shoulder", "-0.25 0 0")
        + hinge("b", "shoulder", "arm", "0 0 0")
        + "</robot>"
    )
    given = definition(
        articulated_trunk={"trunk_joint_names": ["a", "b"]},
        raw_controller_order=["trunk"],
        default_joint_pos=[0.0, rest],
        disabled_collision_pairs=[["base", "arm"]],
    )
    gate = gates(rest_contact_gates, load_description(text), given)["rest_contact"]
    assert gate.figure == touching


def test_spheres_that_fit_a_small_collision_shape_leave_the_cover_bare() -> None:
    """A sphere of 0.1 m in a visual box of 0.6 m covers its collision shape and nothing that is seen."""
    text = (
        '<robot name="cover"><link name="base"><visual><geometry><box size="0.6 0.6 0.6"/></geometry>'
        '</visual><collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>'
    )
    spheres = {"base": [{"center": (0.0, 0.0, 0.0), "radius": 0.1}]}
    gate = gates(sphere_gates, load_description(text), definition(), spheres=spheres)["spheres"]
    assert (gate.passed, gate.figure) == (False, 0.0)
    large = {"base": [{"center": (0.0, 0.0, 0.0), "radius": 0.55}]}
    assert gates(sphere_gates, load_description(text), definition(), spheres=large)["spheres"].passed


def test_surface_points_are_uniform_by_area() -> None:
    """A box of 2 by 2 by 1 m has half of its surface on the two large sides; a sphere covers a cap of it."""
    points = surface_points([primitives.box(1.0, 1.0, 0.5)], 20000)
    on_large = np.isclose(np.abs(points[:, 2]), 0.5)
    assert on_large.mean() == pytest.approx(8.0 / 16.0, abs=0.02)
    disc = share_near_spheres(points, [(0.0, 0.0, 0.5)], [0.5], 0.0)
    assert disc == pytest.approx(np.pi * 0.25 / 16.0, abs=0.005)
    assert len(surface_points([])) == 0


@pytest.mark.parametrize(("axis", "straight"), [("0 1 0", True), ("0.3 0.954 0", False)])
def test_equal_wheel_speeds_have_to_drive_straight(axis: str, straight: bool) -> None:
    """A wheel whose axle points 17 degrees forwards pulls the robot aside; three wheels have no drive law."""
    text = '<robot name="cart">' + link("base", "0.5 0.3 0.1", mass=10.0)
    for name, x, y in (("front", 0.2, 0.0), ("left", -0.2, 0.2), ("right", -0.2, -0.2)):
        text += (
            f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.003" ixy="0" ixz="0" iyy="0.005"'
            ' iyz="0" izz="0.003"/></inertial><collision><origin rpy="1.5707963 0 0"/><geometry>'
            '<cylinder radius="0.1" length="0.04"/></geometry></collision></link>'
            f'<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="{x} {y} -0.05"/><axis xyz="{axis if name == "left" else "0 1 0"}"/>'
            '<limit effort="20" velocity="10"/></joint>'
        )
    names = ["front", "left", "right"]
    given = definition(
        raw_controller_order=["base"],
        default_controllers={"base": "JointController"},
        locomotion={
            "base_joint_names": [f"{name}_joint" for name in names],
            "floor_touching_base_link_names": names,
        },
    )
    gate = gates(drive_gates, load_description(text + "</robot>"), given)["drive"]
    assert gate.title == "Equal wheel speeds drive straight"
    assert gate.passed is straight
    assert bool(gate.findings) is not straight


@pytest.mark.parametrize(("understood", "measured"), [({"base": "legged"}, False), ({}, True)])
def test_continuous_joints_of_legs_are_not_wheels(understood: dict[str, Any], measured: bool) -> None:
    """Hips without limits are driven by speeds, as wheels are; a robot that walks has none to roll on."""
    text = '<robot name="walker">' + link("body", "0.6 0.3 0.1", mass=8.0)
    names = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
    for name in names:
        x, y = (0.25 if "front" in name else -0.25), (0.15 if "left" in name else -0.15)
        text += link(name, "0.04 0.04 0.3", at="0 0 -0.15", com="0 0 -0.1", mass=1.0)
        text += hinge(f"{name}_hip", "body", name, f"{x} {y} 0", kind="continuous")
    given = definition(
        raw_controller_order=["base"],
        default_controllers={"base": "JointController"},
        locomotion={
            "base_joint_names": [f"{name}_hip" for name in names],
            "floor_touching_base_link_names": names,
        },
    )
    gate = gates(drive_gates, load_description(text + "</robot>"), given, understood=understood)["drive"]
    assert bool(gate.skipped) is not measured


@pytest.mark.parametrize(("inertia", "follows"), [(0.008, True), (1.0, False)])
def test_a_base_on_four_wheels_follows_unless_their_inertia_is_of_no_wheel(
    inertia: float, follows: bool
) -> None:
    """Its weight is behind the middle, and it slips sideways as it turns; both are allowed for."""
    text = '<robot name="skid">' + link("base", "0.5 0.3 0.1", com="-0.08 0 0", mass=20.0)
    names = [f"{end}_{side}" for side in ("left", "right") for end in ("front", "rear")]
    for name in names:
        x, y = (0.2 if "front" in name else -0.2), (0.2 if "left" in name else -0.2)
        text += (
            f'<link name="{name}"><inertial><mass value="1"/><inertia ixx="{inertia}" ixy="0" ixz="0"'
            f' iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial><collision><origin rpy="1.5707963 0 0"/>'
            '<geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>'
            f'<joint name="{name}_joint" type="continuous"><parent link="base"/><child link="{name}"/>'
            f'<origin xyz="{x} {y} -0.05"/><axis xyz="0 1 0"/><limit effort="100" velocity="20"/></joint>'
        )
    given = definition(
        raw_controller_order=["base"],
        default_controllers={"base": "DifferentialDriveController"},
        two_wheel={"wheel_radius": 0.1, "wheel_axle_length": 0.4},
        locomotion={
            "base_joint_names": [f"{name}_joint" for name in names],
            "floor_touching_base_link_names": names,
        },
    )
    gate = gates(drive_gates, load_description(text + "</robot>"), given)["drive"]
    assert gate.passed is follows, gate.findings
    assert ("correct <inertia>" in " ".join(gate.findings)) is not follows


def test_a_robot_without_collision_shapes_cannot_stand() -> None:
    shown = legged()
    bare = replace(shown, links=tuple(replace(link, collisions=()) for link in shown.links))
    gate = gates(stand_gates, bare, LEGS)["stand"]
    assert not gate.passed
    assert list(gate.findings) == ["no link has a collision shape: it falls through the floor"]


def test_an_arm_whose_collision_shape_reaches_through_its_base_is_named() -> None:
    """A sphere of 0.2 m around the first joint, where a box of 0.1 m is seen."""
    arm = (
        f'<link name="arm">{INERTIAL.format(com="0 0 0", mass=1)}'
        '<visual><origin xyz="0 0 0.05"/><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
        '<collision><geometry><sphere radius="0.2"/></geometry></collision></link>'
    )
    text = '<robot name="inflated">' + link("base", "0.2 0.2 0.1") + arm
    described = load_description(text + hinge("j", "base", "arm", "0 0 0.05") + "</robot>")
    given = definition(
        raw_controller_order=["arm_0"],
        default_controllers={"arm_0": "JointController"},
        manipulation={
            "n_arms": 1,
            "arm_names": ["0"],
            "arm_link_names": {"0": ["arm"]},
            "arm_joint_names": {"0": ["j"]},
            "eef_link_names": {"0": "arm"},
            "finger_link_names": {"0": []},
            "finger_joint_names": {"0": []},
        },
    )
    found = gates(stand_gates, described, given)["arms_free"].findings
    assert "collision shapes (sphere) that the file gives it reach 200 mm below what is seen" in found[0]


def test_joints_that_no_drive_holds_are_named() -> None:
    """Legs on spherical joints, as some files have them that URDF does not know."""
    described = legged()
    joints = tuple(replace(joint, type="spherical", limit=None) for joint in described.joints)
    described = replace(described, joints=joints)
    arms = {"arms": {"left": ["left_hip"], "right": ["right_hip"]}, "kind": "humanoid", "base": "legged"}
    given = definition()
    world = ValidationWorld(name="r", source=described, definition=given, understood=arms)
    (complete,) = complete_gates(world)
    text = " ".join(complete.findings)
    assert "0 of 2 arms" in text
    assert "'left_hip', 'right_hip' is of type 'spherical'" in text
    world = ValidationWorld(
        name="r", source=described, definition=given, options={"fixed_base": False}, understood=arms
    )
    stand = {gate.name: gate for gate in stand_gates(world)}["stand"]
    assert not stand.passed
    assert "spherical" in " ".join(stand.findings)


@pytest.mark.parametrize("reach", [-0.3, 0.3])
def test_an_arm_that_hangs_below_its_mount_is_named_with_a_height(reach: float) -> None:
    """A swing of 0.3 m below or above a plate: the lower one's tip touches the floor."""
    text = (
        "<robot name='r'>"
        + link("plate", "0.2 0.2 0.02")
        + link("swing", "0.02 0.02 0.3", at=f"0 0 {reach / 2}")
        + hinge("swinging", "plate", "swing", f"0 0 {0.02 if reach > 0 else -0.02}")
        + "</robot>"
    )
    understood = {"kind": "fixed_arm", "base": "fixed"}
    more = {"understood": understood, "options": {"fixed_base": True}}
    start = gates(stand_gates, load_description(text), definition(), **more)["start"]
    if reach > 0:
        assert not start.warnings
        return
    (warning,) = start.warnings
    assert warning.startswith("only swing touches the floor, which moves")
    assert float(warning.split("(from ")[1].split(" m")[0]) == pytest.approx(0.34, abs=0.02)
