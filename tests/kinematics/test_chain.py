"""Chains: joints taken from a description, their order, and invalid requests."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description.model import Mimic
from roboyard.errors import DescriptionError
from roboyard.kinematics import forward_kinematics, from_description, jacobian


def test_entries_of_q_are_depth_first_in_file_order(two_arms):
    left, right = [f"left{i}" for i in range(1, 6)], [f"right{i}" for i in range(1, 6)]
    assert two_arms.joint_names == ("lift", "turn", *left, *right)
    assert two_arms.tip_names == ("left_hand", "right_hand")


def test_order_of_tips_is_the_callers(two_arms_description):
    swapped = from_description(two_arms_description, ["right_hand", "left_hand"])
    poses = forward_kinematics(swapped, np.zeros(12))
    assert poses[0, 1, 3] < 0.0 < poses[1, 1, 3]


def test_limits_are_the_files_and_continuous_joints_have_none(two_arms):
    assert two_arms.lower[:3].tolist() == [0.0, -np.inf, -2.0]
    assert two_arms.upper[:3].tolist() == [0.4, np.inf, 2.0]
    assert two_arms.velocity[0] == 2.0
    assert two_arms.velocity[1] == np.inf
    assert two_arms.period[:2].tolist() == [0.0, 2 * np.pi]


def test_only_joints_on_the_way_are_taken_unless_the_whole_tree_is_asked_for(two_arms_description):
    one = from_description(two_arms_description, "left_hand", base_link="chest")
    assert one.joint_names == tuple(f"left{i}" for i in range(1, 6))
    whole = from_description(two_arms_description, "left_hand", whole_tree=True)
    assert whole.size == 13
    right = whole.joint_names.index("right1")
    assert np.all(jacobian(whole, np.zeros(13))[:, right] == 0.0)


def test_base_link_shifts_the_frame(two_arms_description):
    whole = from_description(two_arms_description, "left_hand")
    part = from_description(two_arms_description, "left_hand", base_link="chest")
    q = np.linspace(0.05, 0.5, 7)
    chest = forward_kinematics(whole, q, "chest")
    assert np.allclose(chest @ forward_kinematics(part, q[2:]), forward_kinematics(whole, q), atol=1e-12)


def test_locked_joints_leave_q_and_keep_their_position(two_arms_description):
    free = from_description(two_arms_description, "left_hand")
    held = from_description(two_arms_description, "left_hand", locked={"turn": 0.7, "left3": -0.4})
    assert held.joint_names == ("lift", "left1", "left2", "left4", "left5")
    q = np.array([0.1, 0.7, 0.2, 0.3, -0.4, 0.5, 0.6])
    assert np.allclose(
        forward_kinematics(held, np.delete(q, [1, 4])), forward_kinematics(free, q), atol=1e-12
    )


def test_mimic_follows_its_leader_and_narrows_its_limits(two_arms_description):
    chain = from_description(two_arms_description, ["finger_a", "finger_b"], base_link="left_hand")
    assert chain.joint_names == ("finger_a",)
    a, b = forward_kinematics(chain, [0.02])[:, 1, 3]
    assert a == pytest.approx(0.02)
    assert b == pytest.approx(-2.0 * 0.02 + 0.01)
    # finger_b in -0.05..0 means finger_a in 0.005..0.03
    assert chain.lower[0] == pytest.approx(0.005)
    assert chain.upper[0] == pytest.approx(0.03)
    assert jacobian(chain, [0.02], link="finger_b")[1, 0] == pytest.approx(-2.0)


def test_mimic_of_a_locked_leader_is_constant(two_arms_description):
    chain = from_description(
        two_arms_description, "finger_b", base_link="left_hand", locked={"finger_a": 0.02}
    )
    assert chain.size == 0
    assert forward_kinematics(chain, [])[1, 3] == pytest.approx(-0.03)


def test_mimic_can_be_ignored(two_arms_description):
    chain = from_description(two_arms_description, "finger_b", base_link="left_hand", follow_mimic=False)
    assert chain.joint_names == ("finger_b",)


def test_mimic_in_a_circle_is_named(build):
    joint, robot = build
    joints = [
        joint("a", "continuous", "base", "one", mimic=Mimic(joint="b")),
        joint("b", "continuous", "one", "two", mimic=Mimic(joint="a")),
    ]
    with pytest.raises(DescriptionError, match=r'joint "a": <mimic> goes round in a circle \(a -> b -> a\)'):
        from_description(robot("ring", joints), "two")


def test_mimic_of_nothing_names_the_nearest_joint(build):
    joint, robot = build
    joints = [
        joint("elbow", "continuous", "base", "one"),
        joint("b", "continuous", "one", "two", mimic=Mimic(joint="elbou")),
    ]
    with pytest.raises(DescriptionError, match="did you mean 'elbow'"):
        from_description(robot("r", joints), "two")


def test_zero_axis_raises(build):
    joint, robot = build
    with pytest.raises(
        DescriptionError, match=r'joint "a": <axis> is \(0.0, 0.0, 0.0\); give a non-zero axis'
    ):
        from_description(robot("r", [joint("a", "continuous", "base", "one", axis=(0.0, 0.0, 0.0))]), "one")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tip_links": "tol"}, "no link named 'tol'; did you mean 'tool'"),
        ({"tip_links": []}, "tip_links must name at least one link"),
        ({"tip_links": "link2", "base_link": "link4"}, "link 'link2' is not below 'link4'"),
        ({"tip_links": "tool", "locked": {"joint9": 0.0}}, "no joint coordinate named 'joint9'"),
    ],
)
def test_unknown_names_list_the_nearest_ones(arm_description, arguments, message):
    with pytest.raises(ValueError, match=message):
        from_description(arm_description, **arguments)


def test_spherical_joint_turns_about_x_then_y_then_z(build):
    joint, robot = build
    chain = from_description(robot("r", [joint("ball", "spherical", "base", "end", (0.1, 0, 0))]), "end")
    assert chain.joint_names == ("ball:rx", "ball:ry", "ball:rz")
    pose = forward_kinematics(chain, [0.3, -0.5, 0.8])
    assert np.allclose(pose[:3, :3], Rotation.from_euler("XYZ", [0.3, -0.5, 0.8]).as_matrix())
    assert np.allclose(pose[:3, 3], [0.1, 0, 0])


def test_planar_joint_stays_in_its_plane(build):
    joint, robot = build
    normal = np.array([0.6, 0.0, 0.8])
    flat = joint("flat", "planar", "base", "end", axis=tuple(normal.tolist()))
    chain = from_description(robot("r", [flat]), "end")
    pose = forward_kinematics(chain, [0.3, 0.4, 0.9])
    assert pose[:3, 3] @ normal == pytest.approx(0.0)
    assert np.linalg.norm(pose[:3, 3]) == pytest.approx(0.5)
    assert np.allclose(pose[:3, :3], Rotation.from_rotvec(0.9 * normal).as_matrix())


def test_floating_joint_reaches_every_pose(build):
    joint, robot = build
    chain = from_description(robot("r", [joint("free", "floating", "base", "end")]), "end")
    pose = forward_kinematics(chain, [1, 2, 3, 0.3, -0.5, 0.8])
    assert np.allclose(pose[:3, 3], [1, 2, 3])
    assert np.allclose(pose[:3, :3], Rotation.from_euler("XYZ", [0.3, -0.5, 0.8]).as_matrix())


def test_arrays_cannot_be_written_to(arm):
    with pytest.raises(ValueError, match="read-only"):
        arm.lower[0] = 0.0
