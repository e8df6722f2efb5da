"""Gates name what keeps joints where they are: loads above limits, links that touch, too few joints."""

from __future__ import annotations

import numpy as np

from roboyard.description import load_description
from roboyard.robots import parse_definition
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.validation.gates.drive import unloaded_wheels
from roboyard.validation.gates.ik_reach import hindrance
from roboyard.validation.gates.response import response_gates
from roboyard.validation.test_world import TestWorld as ValidationWorld
from roboyard.validation.test_world import all_contacts

LINK = (
    '<link name="{name}"><inertial><origin xyz="{x} 0 0"/><mass value="{mass}"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>'
    '<collision><origin xyz="{x} 0 0"/><geometry><box size="0.2 0.04 0.04"/></geometry></collision></link>'
)
JOINT = (
    '<joint name="j{name}" type="revolute"><parent link="{parent}"/><child link="{name}"/>'
    '<origin xyz="{x} 0 {z}"/><axis xyz="0 1 0"/>'
    '<limit lower="-3" upper="3" effort="{effort}" velocity="3"/></joint>'
)


def planar_arm(joints: int, effort: float = 50.0, mass: float = 0.5) -> str:
    """Return an arm whose joints all turn about y, stretched out along x at zero."""
    text = LINK.format(name="base", x=0, mass=5)
    for k in range(joints):
        parent, x, z = (f"l{k - 1}", 0.25, 0) if k else ("base", 0, 0.5)
        text += LINK.format(name=f"l{k}", x=0.125, mass=mass)
        text += JOINT.format(name=f"l{k}", parent=parent, x=x, z=z, effort=effort)
    return f'<robot name="planar">{text}</robot>'


def definition(joints: int, controller: str) -> RobotDefinition:
    names = [f"l{k}" for k in range(joints)]
    return parse_definition(
        {
            "raw_controller_order": ["arm_0"],
            "default_controllers": {"arm_0": controller},
            "default_joint_pos": [0.3, -0.9, 0.6, 0.8][:joints],
            "manipulation": {
                "n_arms": 1,
                "arm_names": ["0"],
                "arm_link_names": {"0": names},
                "arm_joint_names": {"0": [f"j{name}" for name in names]},
                "eef_link_names": {"0": names[-1]},
                "finger_link_names": {"0": []},
                "finger_joint_names": {"0": []},
            },
        }
    )


def world(text: str, given: RobotDefinition) -> ValidationWorld:
    return ValidationWorld(name="planar", source=load_description(text), definition=given)


def test_a_direction_that_an_arm_cannot_take_is_a_warning() -> None:
    given = definition(4, "InverseKinematicsController")
    response, _ = response_gates(world(planar_arm(4), given))
    assert response.passed, response.findings
    listed = " ".join(response.warnings)
    # all axes are parallel to y: neither a step along y nor a turn about x or z is possible
    assert [f"arm_0[{k}]" in listed for k in range(6)] == [False, True, False, True, False, True]
    assert "4 joints cannot" in listed


def test_a_joint_that_its_load_holds_down_is_named() -> None:
    given = definition(4, "JointController")
    response, _ = response_gates(world(planar_arm(4, effort=2.0, mass=8.0), given))
    assert not response.passed
    assert "gravity needs" in " ".join(response.findings)


def test_what_hinders_an_arm_is_named() -> None:
    given = definition(4, "InverseKinematicsController")
    robot = world(planar_arm(4, effort=20.0), given).robot()
    robot.world.step(1)
    usual = all_contacts(robot)
    assert hindrance(robot, "arm_0", usual) == ""
    robot.joint_arrays.q = np.array([0.0, -2.4, -2.4, 3.0])  # l2 crosses l0
    text = hindrance(robot, "arm_0", usual)
    assert "touch (collision shapes: box and box)" in text
    assert "'jl3' is at its limit of 3" in text


def test_a_drive_that_gives_way_is_named() -> None:
    """The last link is heavy and its drive weak: it lags behind when the first joint starts to turn."""
    text = planar_arm(2, effort=0.02).replace('effort="0.02"', 'effort="80"', 1)
    text = text.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 0 1"/>')
    described = load_description(text)
    given = parse_definition(
        {
            "raw_controller_order": ["trunk", "camera"],
            "default_controllers": {"trunk": "JointController", "camera": "JointController"},
            "articulated_trunk": {"trunk_joint_names": ["jl0"], "trunk_link_names": ["l0"]},
            "active_camera": {"camera_joint_names": ["jl1"]},
        }
    )
    _, isolation = response_gates(ValidationWorld(name="turret", source=described, definition=given))
    assert not isolation.passed
    assert "the drive of 'jl1' is at its effort limit of 0.02" in " ".join(isolation.findings)


def test_wheels_that_hang_on_slides_without_springs_are_named() -> None:
    """Casters of 5 cm carry a body of 20 kg; the wheels press with their own 1 kg only."""
    part = (
        '<link name="{n}"><inertial><mass value="{m}"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0"'
        ' izz="0.1"/></inertial>{shape}</link>'
    )
    ball = '<collision><origin xyz="{}"/><geometry><sphere radius="{}"/></geometry></collision>'
    slide = '<limit lower="-0.005" upper="0.005" effort="0" velocity="1"/>'
    joint = (
        '<joint name="j{n}" type="{t}"><parent link="{p}"/><child link="{n}"/><origin xyz="{xyz}"/>'
        '<axis xyz="{axis}"/>{limit}</joint>'
    )
    feet = "".join(ball.format(f"{x} {y} 0.05", 0.05) for x in (0.2, -0.2) for y in (0.15, -0.15))
    text = part.format(n="base", m=20, shape=feet)
    for side, y in (("l", 0.2), ("r", -0.2)):
        text += part.format(n=f"s{side}", m=0.1, shape="")
        text += part.format(n=side, m=0.9, shape=ball.format("0 0 0", 0.1))
        place = f"0 {y} 0.1"
        text += joint.format(n=f"s{side}", t="prismatic", p="base", xyz=place, axis="0 0 1", limit=slide)
        text += joint.format(n=side, t="continuous", p=f"s{side}", xyz="0 0 0", axis="0 1 0", limit="")
    given = parse_definition(
        {
            "raw_controller_order": ["base"],
            "default_controllers": {"base": "DifferentialDriveController"},
            "two_wheel": {"wheel_radius": 0.1, "wheel_axle_length": 0.4},
            "locomotion": {
                "base_joint_names": ["jl", "jr"],
                "floor_touching_base_link_names": ["l", "r", "base"],
            },
        }
    )
    described = load_description(f'<robot name="suspended">{text}</robot>')
    (found,) = unloaded_wheels(ValidationWorld(name="s", source=described, definition=given).robot())
    assert "of 216 N" in found  # 22 kg
    assert "suspensions (jsl, jsr) have no spring" in found
