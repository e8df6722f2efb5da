"""Bases with wheels on two sides: axles to the right, several wheels a side, and a forward that is not +x."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.loader import load_description
from roboyard.description.model import RobotDescription
from roboyard.robots import Robot, add_robot, parse_definition
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.stability.casters import ASSUMED_CASTERS, with_casters
from roboyard.robots.stability.wheels import forward_in, rolling_signs
from roboyard.sim.world import World

RADIUS, TRACK = 0.1, 0.5


def base(
    places: dict[str, tuple[float, float]], axes: dict[str, str], velocity: str = "10"
) -> RobotDescription:
    """Return a box on wheels at (x, y), each with its joint axis in the box's frame."""
    links, joints = [], []
    for name, (x, y) in places.items():
        links.append(
            f'<link name="{name}_link"><inertial><mass value="1"/><inertia ixx="0.003" ixy="0" ixz="0" '
            f'iyy="0.005" iyz="0" izz="0.003"/></inertial><collision><origin rpy="1.5707963 0 0"/><geometry>'
            f'<cylinder radius="{RADIUS}" length="0.04"/></geometry></collision></link>'
        )
        joints.append(
            f'<joint name="{name}" type="continuous"><parent link="base"/><child link="{name}_link"/>'
            f'<origin xyz="{x} {y} 0"/><axis xyz="{axes[name]}"/>'
            f'<limit effort="20" velocity="{velocity}"/></joint>'
        )
    return load_description(
        '<robot name="rover"><link name="base"><inertial><mass value="12"/><inertia ixx="0.3" ixy="0" '
        'ixz="0" iyy="0.3" iyz="0" izz="0.4"/></inertial><collision><origin xyz="0 0 0.02"/><geometry>'
        '<box size="0.5 0.3 0.1"/></geometry></collision></link>' + "".join(links + joints) + "</robot>"
    )


def drive(robot: Robot, speed: float, turn: float, seconds: float) -> None:
    """Command a twist (m/s, rad/s) for a time."""
    action = np.zeros(robot.action_dim)
    action[robot.controller_action_idx["base"]] = robot.controllers["base"].scaling.invert(
        np.array([speed, turn])
    )
    for _ in range(round(seconds * robot.control_freq)):
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)


def definition(joints: list[str]) -> dict[str, object]:
    """Return a definition whose base has these wheels, the left ones first."""
    return {
        "raw_controller_order": ["base"],
        "default_controllers": {"base": "DifferentialDriveController"},
        "two_wheel": {"wheel_radius": RADIUS, "wheel_axle_length": TRACK},
        "locomotion": {
            "base_joint_names": joints,
            "floor_touching_base_link_names": [f"{joint}_link" for joint in joints],
        },
    }


FOUR = {"fl": (0.2, 0.25), "rl": (-0.2, 0.25), "fr": (0.2, -0.25), "rr": (-0.2, -0.25)}
AXES = (
    dict.fromkeys(FOUR, "0 1 0"),
    dict.fromkeys(FOUR, "0 -1 0"),
    {"fl": "0 -1 0", "rl": "0 1 0", "fr": "0 1 0", "rr": "0 -1 0"},
)


@pytest.mark.parametrize("axes", AXES)
def test_four_wheels_drive_straight_at_the_commanded_speed(axes: dict[str, str]) -> None:
    """Two seconds of 0.3 m/s after one of acceleration are 0.6 m."""
    world = World()
    world.add_plane()
    robot = add_robot(world, base(FOUR, axes), definition=definition(list(FOUR)))
    drive(robot, 0.3, 0.0, 1.0)
    start = robot.position
    drive(robot, 0.3, 0.0, 2.0)
    np.testing.assert_allclose(robot.position - start, [0.6, 0.0, 0.0], atol=0.01)
    drive(robot, 0.0, 0.8, 2.0)
    assert 0.4 < robot.velocity[1][2] < 1.1  # to the left, though its wheels slip sideways


def test_a_robot_that_faces_backwards_drives_its_own_way() -> None:
    """Listing the wheels at -y as the left ones makes -x forwards."""
    description = base(FOUR, AXES[0])
    assert rolling_signs_of(description, ["fl", "rl", "fr", "rr"]) == (1.0, 1.0, 1.0, 1.0)
    assert rolling_signs_of(description, ["fr", "rr", "fl", "rl"]) == (-1.0, -1.0, -1.0, -1.0)
    world = World()
    world.add_plane()
    robot = add_robot(world, description, definition=definition(["fr", "rr", "fl", "rl"]))
    drive(robot, 0.3, 0.0, 2.0)
    assert robot.position[0] < -0.4
    assert robot.two_wheel is not None
    assert robot.two_wheel.odometry()[0] == pytest.approx(0.3, rel=0.02)


def test_forward_is_where_the_left_wheels_are_on_the_left() -> None:
    """Wheels along x are those of a robot that faces y."""
    places = {"left": (-0.25, 0.0), "right": (0.25, 0.0)}
    description = base(places, dict.fromkeys(places, "1 0 0"))
    assert forward_in("base", parsed(["left", "right"]), description) == pytest.approx((0.0, 1.0))
    assert forward_in("base", parsed(["right", "left"]), description) == pytest.approx((0.0, -1.0))
    assert forward_in("base", parsed(list(FOUR)), base(FOUR, AXES[1])) == pytest.approx((1.0, 0.0))


def rolling_signs_of(description: RobotDescription, joints: list[str]) -> tuple[float, ...]:
    """Return the signs of a base with these joints."""
    return rolling_signs(parsed(joints), description)


def parsed(joints: list[str]) -> RobotDefinition:
    """Return the definition of a base with these wheels."""
    return parse_definition(definition(joints))


TWO = {"left": (0.0, 0.25), "right": (0.0, -0.25)}


@pytest.mark.parametrize("velocity", ["10", "100"])
def test_two_wheels_without_a_caster_get_casters_and_drive_straight(velocity: str) -> None:
    """The chassis would rock on its axle and drag; 0.3 m/s for two seconds are 0.6 m."""
    world = World()
    world.add_plane()
    description = base(TWO, dict.fromkeys(TWO, "0 1 0"), velocity=velocity)
    robot = add_robot(world, description, definition=definition(list(TWO)))
    assert robot.links[-1].name == ASSUMED_CASTERS
    drive(robot, 0.3, 0.0, 1.0)
    start = robot.position
    drive(robot, 0.3, 0.0, 2.0)
    np.testing.assert_allclose(robot.position - start, [0.6, 0.0, 0.0], atol=0.01)
    upright = 1.0 - 2.0 * float(np.sum(robot.orientation[:2] ** 2))
    assert upright > 0.999


def test_four_wheels_or_a_caster_of_its_own_need_no_casters() -> None:
    """Only a robot that its wheels do not carry gets casters."""
    four = base(FOUR, AXES[0])
    assert with_casters(parsed(list(FOUR)), four) == (parsed(list(FOUR)), four)
    three = base({**TWO, "third": (0.2, 0.0)}, dict.fromkeys([*TWO, "third"], "0 1 0"))
    block = parsed(list(TWO)).locomotion
    assert block is not None
    floor = ("left_link", "right_link", "third_link")
    stated = parsed(list(TWO)).model_copy(
        update={"locomotion": block.model_copy(update={"floor_touching_base_link_names": floor})}
    )
    assert with_casters(stated, three)[1] is three  # the third wheel draws the weight over the triangle


def test_legs_take_position_commands() -> None:
    """A base of joints with limits is legged: its joints follow positions; wheels follow speeds."""
    text = (
        '<robot name="leg"><link name="base"/><link name="foot"><collision><geometry><sphere radius="0.1"/>'
        '</geometry></collision></link><joint name="hip" type="{kind}"><parent link="base"/>'
        '<child link="foot"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="3"/></joint>'
        "</robot>"
    )
    data = {
        "raw_controller_order": ["base"],
        "default_controllers": {"base": "JointController"},
        "locomotion": {"base_joint_names": ["hip"]},
    }
    for kind, expected in (("revolute", "position"), ("continuous", "velocity")):
        description = load_description(text.format(kind=kind))
        robot = add_robot(World(), description, definition=data, fixed_base=True)
        assert robot.controllers["base"].control_type == expected


def test_a_speed_stops_at_the_limit_of_its_joint() -> None:
    """A motor that steers is driven by speeds as the wheels are; full speed must not break its stop."""
    text = (
        '<robot name="steer"><link name="base"/><link name="fork"><inertial><mass value="2"/>'
        '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>'
        '<joint name="turn" type="revolute">'
        '<parent link="base"/><child link="fork"/><axis xyz="0 0 1"/>'
        '<limit lower="-0.5" upper="0.5" effort="50" velocity="8"/></joint></robot>'
    )
    data = {"raw_controller_order": ["trunk"], "articulated_trunk": {"trunk_joint_names": ["turn"]}}
    robot = add_robot(
        World(),
        load_description(text),
        definition={**data, "default_controllers": {}},
        controllers={"trunk": {"name": "JointController", "motor_type": "velocity"}},
    )
    largest = 0.0
    for sign in (1.0, -1.0):
        for _ in range(40):
            robot.apply_action([sign])
            robot.world.step(robot.steps_per_control)
            largest = max(largest, abs(float(robot.joint_positions[0])))
        assert robot.joint_positions[0] == pytest.approx(0.5 * sign, abs=0.02)
    assert largest < 0.51
