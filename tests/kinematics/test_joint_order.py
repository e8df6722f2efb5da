"""Joint orders: checked against hand-written lists and MuJoCo's own order."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from roboyard.description import RobotDescription, load_description
from roboyard.kinematics.joint_order import (
    breadth_first_joint_names,
    breadth_first_joints,
    depth_first_joint_names,
    prim_order_joints,
    reorder,
    single_dof_joints,
)

TREE = """<robot name="tree">
  <link name="base"/><link name="left"/><link name="left_tip"/><link name="right"/><link name="right_tip"/>
  <link name="plate"/>
  <joint name="j_left" type="continuous"><parent link="base"/><child link="left"/></joint>
  <joint name="j_right" type="continuous"><parent link="base"/><child link="right"/></joint>
  <joint name="j_left_tip" type="prismatic"><parent link="left"/><child link="left_tip"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="j_plate" type="fixed"><parent link="left"/><child link="plate"/></joint>
  <joint name="j_right_tip" type="continuous"><parent link="right"/><child link="right_tip"/>
    <mimic joint="j_left"/></joint>
</robot>"""
DEPTH = ("j_left", "j_left_tip", "j_right", "j_right_tip")
BREADTH = ("j_left", "j_right", "j_left_tip", "j_right_tip")


@pytest.fixture
def tree(tmp_path) -> RobotDescription:
    file = tmp_path / "tree.urdf"
    file.write_text(TREE)
    return load_description(file)


def test_orders_of_a_tree_with_two_branches(tree: RobotDescription) -> None:
    assert depth_first_joint_names(tree) == DEPTH
    assert breadth_first_joint_names(tree) == BREADTH
    every = [joint.name for joint in breadth_first_joints(tree)]
    assert every == ["j_left", "j_right", "j_left_tip", "j_plate", "j_right_tip"]
    prims = [joint.name for joint in prim_order_joints(tree)]
    assert prims == ["j_left", "j_right", "j_left_tip", "j_plate", "j_right_tip"]


def test_prim_order_goes_down_one_branch_before_the_next() -> None:
    # base has two branches of depth two; prim order visits all of the first before the second
    from roboyard.description.model import Joint, Link

    names = ["base", "a", "b", "a1", "a2", "b1"]
    pairs = [("base", "a"), ("base", "b"), ("b", "b1"), ("a", "a1"), ("a1", "a2")]
    tree = RobotDescription(
        name="tree",
        links=tuple(Link(name=name) for name in names),
        joints=tuple(Joint(name=child, type="continuous", parent=up, child=child) for up, child in pairs),
    )
    assert [joint.name for joint in prim_order_joints(tree)] == ["a", "b", "a1", "a2", "b1"]
    assert [joint.name for joint in breadth_first_joints(tree)] == ["a", "b", "a1", "b1", "a2"]
    assert depth_first_joint_names(tree) == ("a", "a1", "a2", "b", "b1")


def test_depth_first_is_the_order_of_mujoco(tree: RobotDescription) -> None:
    body = '<body name="{0}"><joint name="j_{0}"/><geom size="0.1" mass="1"/>{1}</body>'
    left = body.format("left", body.format("left_tip", ""))
    right = body.format("right", body.format("right_tip", ""))
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{left}{right}</worldbody></mujoco>")
    assert tuple(model.joint(i).name for i in range(model.njnt)) == depth_first_joint_names(tree)


def test_single_dof_joints_skip_fixed_and_frozen(tree: RobotDescription) -> None:
    assert [joint.name for joint in single_dof_joints(tree.joints, {"j_left"})] == [
        "j_right",
        "j_left_tip",
        "j_right_tip",
    ]


def test_reorder_converts_and_returns() -> None:
    there, back = reorder(DEPTH, BREADTH), reorder(BREADTH, DEPTH)
    values = np.arange(8.0).reshape(2, 4)
    assert values[:, there].tolist() == [[0, 2, 1, 3], [4, 6, 5, 7]]
    assert np.array_equal(values[:, there][:, back], values)
    assert reorder(DEPTH, ("j_right",)).tolist() == [2]
    assert reorder(DEPTH, ()).dtype == np.intp
    with pytest.raises(KeyError, match="j_up"):
        reorder(DEPTH, ("j_up",))
