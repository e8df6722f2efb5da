"""Steps of joints under gravity, against hand calculations."""

from __future__ import annotations

import pytest

from roboyard.description import load_description
from roboyard.robots import add_robot, parse_definition
from roboyard.sim import World
from roboyard.validation import validate
from roboyard.validation.gates.tracking import Step, blocked_by, summarize, tracking_gates
from roboyard.validation.report import Gate
from roboyard.validation.test_world import TestWorld as GateWorld

ARM = """<robot name="lever"><link name="base"><inertial><mass value="5"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size=".1 .1 .1"/></geometry></collision></link>
<link name="beam"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
<inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0.3 0 0"/><geometry><box size=".2 .02 .02"/></geometry></collision></link>
<joint name="lift" type="revolute"><parent link="base"/><child link="beam"/><origin xyz="0 0 1"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="{effort}" velocity="2"/>
<dynamics damping="{damping}"/></joint></robot>"""
"""A horizontal beam that needs m g l = 2 kg x 9.81 m/s2 x 0.3 m = 5.9 N m at its joint."""
DEFINITION = {
    "raw_controller_order": ["trunk"],
    "default_controllers": {},
    "articulated_trunk": {"trunk_joint_names": ["lift"]},
    "default_joint_pos": [0.0],
}


def gates(effort: float) -> tuple[Gate, Gate]:
    """Return the gates of overshoot and error of a beam."""
    robot = load_description(ARM.format(effort=effort, damping=0))
    report = validate(robot, definition=parse_definition(DEFINITION), gates=["tracking"], fixed_base=True)
    return report.gate("overshoot"), report.gate("error")


def test_a_joint_that_carries_its_link_reaches_its_target() -> None:
    overshoot, error = gates(40.0)
    assert overshoot.passed and error.passed
    assert error.figure < 1e-3


@pytest.mark.parametrize(("effort", "holds"), [(7.0, True), (5.0, False)])
def test_a_joint_weaker_than_gravity_is_named_with_both_efforts(effort: float, holds: bool) -> None:
    _, error = gates(effort)
    assert error.passed is holds
    if not holds:
        assert "'lift'" in error.findings[0]
        assert "effort limit of 5" in error.findings[0]


@pytest.mark.parametrize(("height", "found"), [(0.009, True), (0.02, False)])
def test_a_joint_whose_link_lies_on_the_floor_names_both(height: float, found: bool) -> None:
    world = World()
    world.add_plane()
    low = load_description(ARM.format(effort=40, damping=0).replace('xyz="0 0 1"', 'xyz="0 0 -0.1"'))
    robot = add_robot(world, low, (0, 0, 0.1 + height), fixed_base=True, on_floor=False)
    cause = blocked_by(robot, "lift")  # the beam reaches 1 cm below its joint
    assert ("its link 'beam' touches 'plane'" in cause) is found
    assert bool(cause) is found


LEGS = ARM.replace(
    '<origin xyz="0.3 0 0"/><geometry><box size=".2 .02 .02"/>', '<geometry><box size=".4 .3 .02"/>'
)


@pytest.mark.parametrize(("base", "moves"), [("legged", True), ("fixed", False)])
def test_a_waist_above_legs_turns_them_in_the_air(base: str, moves: bool) -> None:
    """The base is the trunk above the waist; on the floor, legs leave the joint no room."""
    robot = load_description(LEGS.format(effort=40, damping=0).replace('xyz="0 0 1"', 'xyz="0 0 -0.5"'))
    definition = parse_definition(DEFINITION)
    test_world = GateWorld(name="legs", source=robot, definition=definition, understood={"base": base})
    _, error = tracking_gates(test_world)
    assert error.passed, error.findings
    assert bool(error.skipped) is not moves


def test_the_worst_joint_is_named_first() -> None:
    steps = [
        Step(joint="a", overshoot=0.06, error=0.0, cause=""),
        Step(joint="b", overshoot=0.2, error=0.02, cause=""),
    ]
    overshoot, error = summarize(steps, "")
    assert [text.split("'")[1] for text in overshoot.findings] == ["b", "a"]
    assert [text.split("'")[1] for text in error.findings] == ["b"]
    assert overshoot.figure == 0.2


def test_robots_without_arm_trunk_or_head_skip_it() -> None:
    assert all(gate.skipped and gate.passed for gate in summarize([], "no arm, trunk or head"))
