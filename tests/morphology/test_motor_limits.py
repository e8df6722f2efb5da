"""Joints that say nothing of their motors, and those that mean an effort of 0."""

import pytest

from roboyard.description import load_description
from roboyard.morphology.motor_limits import with_motors

LINK = """<link name="{}"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="1 0 0"/>
<axis xyz="0 1 0"/><limit lower="-1" upper="0.25" effort="{}" velocity="{}"/></joint>"""


def robot(*joints):
    """A chain of 2 kg links, 1 m apart, masses half way; joints as (type, effort, velocity)."""
    text = LINK.format("l0")
    for k, (kind, effort, velocity) in enumerate(joints):
        text += LINK.format(f"l{k + 1}") + JOINT.format(f"j{k}", kind, f"l{k}", f"l{k + 1}", effort, velocity)
    return load_description(f'<robot name="r">{text}</robot>')


def limits(description):
    return [(joint.limit.effort, joint.limit.velocity) for joint in description.joints]


def test_each_motor_lifts_twice_what_it_carries():
    made, given = with_motors(robot(("revolute", 0, 2), ("revolute", 0, 0), ("prismatic", 0, 0)))
    assert given == ("j0", "j1", "j2")
    (first, v0), (second, v1), (third, v2) = limits(made)
    # closed form: 2 kg at 0.5 m, 1.5 m, and behind the slider, which reaches 1 m farther, at 3.5 m
    assert first == pytest.approx(2 * 9.81 * 2 * (0.5 + 1.5 + 3.5), rel=0.06)
    assert second == pytest.approx(2 * 9.81 * 2 * (0.5 + 2.5), rel=0.06)
    assert third == pytest.approx(2 * 9.81 * 2, rel=0.06)
    assert (v0, v1, v2) == (2, pytest.approx(3.14, abs=0.01), 0.5)


def test_figures_that_are_given_stay():
    mixed = robot(("revolute", 50, 2), ("revolute", 0, 2), ("revolute", 30, 2))
    made, given = with_motors(mixed)
    assert given == ("j1",)
    assert limits(made)[0] == (50, 2) and limits(made)[2] == (30, 2)


def test_a_single_joint_at_zero_among_many_is_meant_to_swing():
    joints = [("revolute", 50, 2)] * 3 + [("revolute", 0, 2)]
    assert with_motors(robot(*joints))[1] == ()
    assert with_motors(robot(("continuous", 0, 0), ("revolute", 5, 1)))[1] == ()


def test_a_wrist_is_made_to_carry_more_than_its_flange():
    tip = LINK.format("tip").replace('value="2"', 'value="0.01"').replace("0.5 0 0", "0 0 0")
    text = "".join(LINK.format(f"l{k}") for k in range(5)) + tip
    for k in range(5):
        text += JOINT.format(f"j{k}", "revolute", f"l{k}", f"l{k + 1}" if k < 4 else "tip", 0, 2)
    made, _ = with_motors(load_description(f'<robot name="r">{text}</robot>'))
    efforts = [effort for effort, _ in limits(made)]
    assert efforts[4] == pytest.approx(0.05 * efforts[0], rel=0.06)
