"""Hands of robots without a configuration, by the shape of their tree of joints."""

from itertools import pairwise

from roboyard.description import load_description
from roboyard.morphology.grippers import find_grippers

AXIS = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'


def robot(*edges):
    """A robot of edges (parent, child, kind): m moves, f is fixed, c copies another joint's motion."""
    names = dict.fromkeys(name for parent, child, _ in edges for name in (parent, child))
    text = "".join(f'<link name="{name}"/>' for name in names)
    leader = next(child for _, child, kind in edges if kind == "m")
    for parent, child, kind in edges:
        body = "" if kind == "f" else AXIS + (f'<mimic joint="j_{leader}"/>' if kind == "c" else "")
        word = "fixed" if kind == "f" else "revolute"
        ends = f'<parent link="{parent}"/><child link="{child}"/>'
        text += f'<joint name="j_{child}" type="{word}">{ends}{body}</joint>'
    return load_description(f'<robot name="r">{text}</robot>')


def arm(start, name, count=6):
    links = [start, *(f"{name}{k}" for k in range(1, count + 1))]
    return [(a, b, "m") for a, b in pairwise(links)]


def test_a_gripper_is_where_the_arm_parts_into_fingers():
    found = find_grippers(
        robot(
            *arm("base", "a"),
            ("a6", "flange", "f"),
            ("flange", "palm", "f"),
            ("palm", "finger1", "m"),
            ("palm", "finger2", "c"),
            ("finger2", "pad", "f"),
            ("palm", "camera", "f"),
        )
    )
    assert [hand.link for hand in found] == ["palm"]
    assert found[0].gripper_links == ("finger1", "finger2", "pad")


def test_both_hands_of_a_humanoid_but_not_its_trunk_eyes_or_legs():
    edges = [("pelvis", "waist", "m"), ("waist", "chest", "m")]
    for side in "lr":
        edges += [*arm("chest", f"{side}arm"), *arm("pelvis", f"{side}leg")]
        for finger in range(3):
            edges += arm(f"{side}arm6", f"{side}f{finger}_", 3)
    edges += [*arm("chest", "neck", 2), ("neck2", "eye_l", "m"), ("neck2", "eye_r", "m")]
    found = find_grippers(robot(*edges))
    assert {hand.link for hand in found} == {"larm6", "rarm6"}
    assert all(len(hand.gripper_links) == 9 for hand in found)


def test_arms_without_hands_hands_without_arms_and_wheels_have_none():
    assert find_grippers(robot(*arm("base", "a"))) == ()
    assert find_grippers(robot(*arm("palm", "f0_", 3), *arm("palm", "f1_", 3))) == ()
    assert find_grippers(robot(("base", "left", "m"), ("base", "right", "m"), ("base", "caster", "m"))) == ()
    assert find_grippers(robot(*arm("chest", "l"), *arm("chest", "r"))) == ()


def test_virtual_joints_of_a_base_carry_nothing():
    base = [(f"v{k}", f"v{k + 1}", "m") for k in range(6)]
    edges = robot(*base, *arm("v6", "l", 5), *arm("v6", "r", 5))
    assert [hand.link for hand in find_grippers(edges)] == ["v6"]
    assert find_grippers(edges, [f"j_v{k}" for k in range(1, 7)]) == ()
