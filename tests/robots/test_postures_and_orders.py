"""Joint orders of random trees, postures of definition files in them, and groups of joints."""

from __future__ import annotations

from collections import deque

import mujoco
import numpy as np
import pytest

from roboyard.description import load_description
from roboyard.description.model import Joint, Limit, Link, RobotDescription
from roboyard.errors import ConfigError
from roboyard.kinematics.joint_order import (
    breadth_first_joint_names,
    depth_first_joint_names,
    prim_order_joints,
    reorder,
)
from roboyard.robots import parse_definition
from roboyard.robots.definition.groups import plan_groups
from roboyard.robots.definition.postures import file_postures, reset_posture, tuck_posture


def random_tree(seed: int, size: int = 14) -> RobotDescription:
    """Return a tree in which every third joint is fixed, its joints listed in random order."""
    rng = np.random.default_rng(seed)
    joints = [
        Joint(
            name=f"j{k}",
            type="fixed" if k % 3 == 0 else "revolute",
            parent=f"l{rng.integers(0, k)}",
            child=f"l{k}",
            limit=Limit(lower=-1, upper=1, effort=1, velocity=1),
        )
        for k in range(1, size)
    ]
    rng.shuffle(joints)
    return RobotDescription(
        name="tree", links=tuple(Link(name=f"l{k}") for k in range(size)), joints=tuple(joints)
    )


def children(description: RobotDescription, link: str) -> list[Joint]:
    return [joint for joint in description.joints if joint.parent == link]


def breadth_first(description: RobotDescription) -> list[str]:
    found, queue = [], deque(["l0"])
    while queue:
        for joint in children(description, queue.popleft()):
            found.append(joint)
            queue.append(joint.child)
    return [joint.name for joint in found if joint.type != "fixed"]


@pytest.mark.parametrize("seed", range(6))
def test_orders_of_a_random_tree(seed: int) -> None:
    tree = random_tree(seed)
    assert list(breadth_first_joint_names(tree)) == breadth_first(tree)

    def element(link: str) -> str:
        inner = "".join(
            f"<body name='{j.child}'>" + (f"<joint name='{j.name}'/>" if j.type != "fixed" else "")
            + "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>" + element(j.child) + "</body>"
            for j in children(tree, link)
        )  # fmt: skip
        return inner

    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{element('l0')}</worldbody></mujoco>")
    assert list(depth_first_joint_names(tree)) == [model.joint(k).name for k in range(model.njnt)]


@pytest.mark.parametrize("seed", range(3))
def test_prim_order_lists_the_children_of_a_link_together_after_those_above(seed: int) -> None:
    order = prim_order_joints(random_tree(seed))
    parents = [joint.parent for joint in order]
    runs = [parent for k, parent in enumerate(parents) if k == 0 or parents[k - 1] != parent]
    assert len(runs) == len(set(runs)) and len(order) == 13
    seen = {"l0"}
    for parent in runs:
        assert parent in seen
        seen |= {joint.child for joint in order if joint.parent == parent}


def test_vectors_are_reordered_by_name_along_their_last_axis() -> None:
    vectors = np.arange(6.0).reshape(2, 3)
    assert vectors[..., reorder("abc", "cab")].tolist() == [[2, 0, 1], [5, 3, 4]]
    assert vectors[..., reorder("abc", "b")].tolist() == [[1], [4]]
    with pytest.raises(KeyError, match="no joint named 'd'"):
        reorder("abc", "ad")


def tree_definition(tree: RobotDescription, **changed):
    names = depth_first_joint_names(tree)
    return parse_definition(
        {
            "raw_controller_order": ["trunk"],
            "default_controllers": {},
            "articulated_trunk": {"trunk_joint_names": list(names)},
            **changed,
        },
        tree,
    )


@pytest.mark.parametrize("seed", range(4))
def test_breadth_first_values_of_a_file_reach_the_joint_of_their_name(seed: int) -> None:
    """The value of joint jK is K / 100, listed in the file's order."""
    tree = random_tree(seed)
    values = [int(name[1:]) / 100 for name in breadth_first(tree)]
    names = depth_first_joint_names(tree)
    expected = [int(name[1:]) / 100 for name in names]
    block = {"untucked_default_joint_pos": values, "tucked_default_joint_pos": [-v for v in values]}
    definition = tree_definition(tree, default_joint_pos=values, mobile_manipulation=block)
    assert reset_posture(definition, tree, names) == pytest.approx(expected)
    assert tuck_posture(definition, tree, names, "tuck") == pytest.approx(-np.array(expected))
    found = file_postures(definition, tree, names)
    assert list(found) == [
        "default_joint_pos",
        "mobile_manipulation.untucked_default_joint_pos",
        "mobile_manipulation.tucked_default_joint_pos",
    ]
    assert found["default_joint_pos"] == pytest.approx(expected)


def test_postures_with_names_set_the_joints_they_name_and_zero_elsewhere() -> None:
    tree = random_tree(1)
    names = depth_first_joint_names(tree)
    block = {
        "joint_names": ["j5", "j2"],
        "untucked_default_joint_pos": [0.5, 0.2],
        "tucked_default_joint_pos": ["pi/4", "-pi/4"],
    }
    definition = tree_definition(tree, mobile_manipulation=block)
    given = {"j5": np.pi / 4, "j2": -np.pi / 4}
    assert tuck_posture(definition, tree, names, "tuck") == pytest.approx([given.get(n, 0.0) for n in names])
    assert reset_posture(definition, tree, names, mode="untuck")[names.index("j5")] == 0.5


def test_the_posture_of_a_reset_is_the_callers_the_definitions_or_none() -> None:
    tree = random_tree(2)
    names = depth_first_joint_names(tree)
    plain = tree_definition(tree)
    assert reset_posture(plain, tree, names) is None
    assert tuck_posture(plain, tree, names, "tuck") is None
    assert file_postures(plain, tree, names) == {}
    given = np.linspace(0, 1, len(names))
    resting = tree_definition(tree, default_joint_pos=[0.0] * len(names))
    assert reset_posture(resting, tree, names, given=given) == pytest.approx(given)
    for wrong in (given[:-1], np.full(len(names), np.nan), [[0.0]]):
        with pytest.raises(ConfigError, match=f"reset_joint_pos must be {len(names)} finite numbers"):
            reset_posture(resting, tree, names, given=wrong)


def test_groups_follow_the_order_of_actions_with_their_kind_and_tip() -> None:
    definition = parse_definition(
        {
            "raw_controller_order": ["gripper_left_1", "trunk", "arm_left_1", "camera"],
            "default_controllers": {},
            "articulated_trunk": {"trunk_joint_names": ["t1", "t2"]},
            "active_camera": {"camera_joint_names": ["pan"]},
            "manipulation": {
                "arm_names": ["left_1"],
                "arm_joint_names": {"left_1": ["a"]},
                "eef_link_names": {"left_1": "tool"},
                "finger_joint_names": {"left_1": ["f"]},
            },
        }
    )
    plans = plan_groups(definition, {"t1": "low", "t2": "high"})
    assert [(plan.name, plan.kind, plan.joints, plan.tip) for plan in plans.values()] == [
        ("gripper_left_1", "gripper", ("f",), None),
        ("trunk", "trunk", ("t1", "t2"), "high"),
        ("arm_left_1", "arm", ("a",), "tool"),
        ("camera", "camera", ("pan",), None),
    ]


def test_joint_orders_ignore_fixed_joints_and_keep_mimic_joints() -> None:
    text = (
        "<robot name='m'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>"
        "<joint name='f' type='fixed'><parent link='a'/><child link='b'/></joint>"
        "<joint name='lead' type='continuous'><parent link='b'/><child link='c'/></joint>"
        "<joint name='copy' type='prismatic'><parent link='a'/><child link='d'/><mimic joint='lead'/>"
        "<limit lower='0' upper='1' effort='1' velocity='1'/></joint></robot>"
    )
    description = load_description(text)
    assert depth_first_joint_names(description) == ("lead", "copy")
    assert breadth_first_joint_names(description) == ("copy", "lead")
