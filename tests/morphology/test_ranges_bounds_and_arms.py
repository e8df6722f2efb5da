"""Joint ranges, bounding boxes, chains and names of arms, on hand-made robots."""

from __future__ import annotations

import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
from small_robots import joint, link, robot

from roboyard.description import Joint, RobotDescription
from roboyard.description.model import Limit, Link, Mesh, Pose, Visual
from roboyard.description.semantic import EndEffector
from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.arms import find_arms, find_trunk, longest_chain_tip
from roboyard.morphology.bounds import robot_bounds
from roboyard.morphology.grippers import find_grippers
from roboyard.morphology.joint_ranges import full_range, home_position
from roboyard.transforms import matrix_from_quaternion

TURN = 2 * math.pi


def one(kind: str, limits: tuple[float, float] | None) -> Joint:
    limit = None if limits is None else Limit(lower=limits[0], upper=limits[1], effort=1, velocity=1)
    return Joint(name="j", type=kind, parent="a", child="b", limit=limit)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "limits", "home", "expected"),
    [
        ("revolute", (-1.0, 2.0), 0.0, (-1.0, 2.0)),
        ("revolute", (-10.0, 10.0), 0.0, (-math.pi, math.pi)),
        ("revolute", (-1.0, 10.0), 0.0, (-1.0, math.pi)),
        ("revolute", (5.0, 20.0), 12.5, (12.5 - math.pi, 12.5 + math.pi)),
        ("continuous", None, 0.5, (0.5, 0.5 + TURN)),
        ("prismatic", (-0.2, 0.7), 0.0, (-0.2, 0.7)),
        ("prismatic", None, 0.0, (-0.1, 0.1)),
        ("prismatic", (-1e6, 3.0), 0.0, (-100.0, 3.0)),
    ],
)
def test_full_range_keeps_the_limits_but_at_most_one_turn(kind, limits, home, expected) -> None:
    assert full_range(one(kind, limits), home) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("limits", "expected"), [(None, 0.0), ((-1.0, 1.0), 0.0), ((0.0, 2.0), 0.0), ((1.0, 2.0), 1.5),
                             ((-3.0, -1.0), -2.0)]
)  # fmt: skip
def test_home_is_zero_or_the_middle_of_limits_that_exclude_it(limits, expected) -> None:
    assert home_position(one("revolute", limits)) == expected


def test_bounds_follow_joint_origins_and_shape_rotations() -> None:
    """A rod of 1 m, turned onto x by its joint, beside a box."""
    description = robot(
        link("base", "box 0.2 0.4 0.6"),
        link("rod", "box 0.1 0.1 1", origin="0 0 0.5"),
        joint("j", "base", "rod", xyz="0 0 0.3", rpy="0 1.5707963267948966 0"),
    )
    bounds = robot_bounds(description)
    assert bounds is not None
    assert bounds[0] == pytest.approx([-0.1, -0.2, -0.3])
    assert bounds[1] == pytest.approx([1.0, 0.2, 0.35])


def test_bounds_count_only_the_requested_kind_of_shape() -> None:
    both = (
        '<link name="a"><visual><geometry><sphere radius="1"/></geometry></visual>'
        '<collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    )
    description = robot(both)
    visual, collision = robot_bounds(description, collision=False), robot_bounds(description, visual=False)
    assert visual is not None and collision is not None
    assert visual[1] == pytest.approx([1, 1, 1], rel=1e-3)
    assert collision[1] == pytest.approx([0.5, 0.5, 0.5])
    assert robot_bounds(description, visual=False, collision=False) is None


def test_bounds_of_one_file_in_many_places(tmp_path: Path) -> None:
    points = np.random.default_rng(3).normal(size=(30, 3))
    faces = "".join(f"f {k} {k + 1} {k + 2}\n" for k in range(1, 29))
    (tmp_path / "part.obj").write_text(
        "".join(f"v {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in points) + faces
    )
    places = [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0)),
        ((3.0, 1.0, -2.0), (0.0, 0.0, 0.0, 1.0), (1.0, 1.0, 1.0)),
        ((3.0, 1.0, -2.0), (0.0, 0.6, 0.0, 0.8), (1.0, 1.0, 1.0)),
        ((-9.0, 1.0, -2.0), (0.0, 0.6, 0.0, 0.8), (1.0, -2.0, 1.0)),
    ]
    for count in range(1, len(places) + 1):
        visuals = tuple(
            Visual(
                geometry=Mesh(uri="part.obj", path=tmp_path / "part.obj", scale=scale),
                origin=Pose(position=position, quaternion=turn),
            )
            for position, turn, scale in places[:count]
        )
        found = robot_bounds(RobotDescription(name="r", links=(Link(name="a", visuals=visuals),), joints=()))
        moved = [
            (points * scale) @ matrix_from_quaternion(np.array(turn)).T + position
            for position, turn, scale in places[:count]
        ]
        every = np.concatenate(moved)
        assert found == pytest.approx(np.stack([every.min(axis=0), every.max(axis=0)]), abs=1e-12)


def chain(prefix: str, start: str, count: int, kind: str = "revolute") -> list[str]:
    names = [start, *(f"{prefix}{k}" for k in range(1, count + 1))]
    parts = [link(name) for name in names[1:]]
    return parts + [joint(f"j_{b}", a, b, kind=kind) for a, b in pairwise(names)]


def fingers(palm: str, count: int, kind: str = "prismatic") -> list[str]:
    return [
        part
        for k in range(count)
        for part in (link(f"{palm}_f{k}"), joint(f"j_{palm}_f{k}", palm, f"{palm}_f{k}", kind=kind))
    ]


@pytest.mark.parametrize(("count", "is_gripper"), [(1, False), (2, True), (3, True), (5, True)])
def test_a_gripper_has_at_least_two_fingers(count: int, is_gripper: bool) -> None:
    description = robot(link("base"), *chain("a", "base", 5), *fingers("a5", count))
    found = find_grippers(description)
    assert [one.link for one in found] == (["a5"] if is_gripper else [])
    if is_gripper:
        assert found[0].gripper_links == tuple(f"a5_f{k}" for k in range(count))
        assert found[0].gripper_joints == ()


def test_one_finger_makes_the_finger_the_tip_of_the_longest_chain() -> None:
    description = robot(link("base"), *chain("a", "base", 5), *fingers("a5", 1))
    assert [one.link for one in infer_semantics(description).end_effectors] == ["a5_f0"]


@pytest.mark.parametrize(("joints", "found"), [(2, 0), (3, 1)])
def test_a_gripper_needs_three_joints_before_it(joints: int, found: int) -> None:
    assert (
        len(find_grippers(robot(link("base"), *chain("a", "base", joints), *fingers(f"a{joints}", 2))))
        == found
    )


def test_eyes_on_a_short_neck_are_no_gripper_beside_a_long_arm() -> None:
    parts = [link("base"), *chain("arm", "base", 7), *fingers("arm7", 2)]
    parts += [*chain("neck", "base", 3), *fingers("neck3", 2, "revolute")]
    assert [one.link for one in find_grippers(robot(*parts))] == ["arm7"]


def test_fixed_joints_do_not_lengthen_a_chain() -> None:
    parts = [link("base"), *chain("a", "base", 3), *chain("b", "base", 2), *chain("c", "b2", 6, "fixed")]
    assert longest_chain_tip(robot(*parts)) == "a3"


def test_a_trunk_of_a_torso_with_two_arms_is_shared_and_each_arm_keeps_its_own_joints() -> None:
    parts = [link("base"), *chain("t", "base", 2), *chain("l", "t2", 5), *chain("r", "t2", 5)]
    description = robot(*parts)
    effectors = [EndEffector(link="l5"), EndEffector(link="r5")]
    trunk = find_trunk(description, "base", effectors)
    assert trunk == ("j_t1", "j_t2")
    arms = find_arms(description, "base", effectors, trunk)
    assert [(arm.name, arm.joints) for arm in arms] == [
        ("left", tuple(f"j_l{k}" for k in range(1, 6))),
        ("right", tuple(f"j_r{k}" for k in range(1, 6))),
    ]


def test_a_third_effector_elsewhere_does_not_hide_the_trunk_of_the_arms() -> None:
    """A camera on the base shares no joint with the arms."""
    parts = [link("base"), *chain("t", "base", 1), *chain("l", "t1", 4), *chain("r", "t1", 4)]
    parts += chain("cam", "base", 1)
    effectors = [EndEffector(link=name) for name in ("l4", "r4", "cam1")]
    assert find_trunk(robot(*parts), "base", effectors) == ("j_t1",)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("left_hand", "right_hand"), ["left", "right"]),
        (("L_tool", "R_tool"), ["left", "right"]),
        (("arm_left_a", "arm_left_b"), ["left", "left_2"]),
        (("clefta", "toolr"), ["0", "1"]),
    ],
)
def test_arms_are_named_by_the_side_in_the_name_of_their_link(names, expected) -> None:
    parts = [link("base")]
    for index, name in enumerate(names):
        parts += [*chain(f"{'pq'[index]}", "base", 4), link(name)]
        parts.append(joint(f"tool{index}", f"{'pq'[index]}4", name, kind="fixed"))
    arms = find_arms(robot(*parts), "base", [EndEffector(link=name) for name in names])
    assert [arm.name for arm in arms] == expected


def test_a_chain_of_three_joints_without_gripper_is_no_arm() -> None:
    description = robot(link("base"), *chain("a", "base", 3))
    assert find_arms(description, "base", [EndEffector(link="a3")]) == ()
    (arm,) = find_arms(description, "base", [EndEffector(link="a3", gripper_links=("a3",))])
    assert arm.joints == ("j_a1", "j_a2", "j_a3")


def test_joints_of_a_gripper_and_followers_are_no_joints_of_the_arm() -> None:
    parts = [link("base"), *chain("a", "base", 5), link("copy")]
    parts.append(joint("j_copy", "a5", "copy", mimic='<mimic joint="j_a1"/>'))
    effector = EndEffector(link="copy", gripper_links=("a5",), gripper_joints=("j_a5",))
    (arm,) = find_arms(robot(*parts), "base", [effector])
    assert arm.joints == ("j_a1", "j_a2", "j_a3", "j_a4")
