"""Forward kinematics and Jacobians against SciPy's rotations, finite differences and Pinocchio's numbers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.kinematics import forward_kinematics, jacobian, manipulability, sample_reachable


def compose(description, positions, link):
    """Pose of `link` in the root, joint by joint with SciPy; mimics and continuous joints included."""
    if link == description.root.name:
        return np.eye(4)
    joint = description.parent_joint[link]
    motion = np.eye(4)
    if joint.type != "fixed":
        value = positions.get(joint.name, 0.0)
        if joint.mimic:
            value = joint.mimic.multiplier * positions[joint.mimic.joint] + joint.mimic.offset
        if joint.type == "prismatic":
            motion[:3, 3] = value * np.array(joint.axis)
        else:
            motion[:3, :3] = Rotation.from_rotvec(value * np.array(joint.axis)).as_matrix()
    origin = np.eye(4)
    origin[:3, 3] = joint.origin.position
    origin[:3, :3] = Rotation.from_quat(joint.origin.quaternion).as_matrix()
    return compose(description, positions, joint.parent) @ origin @ motion


def test_every_link_is_where_the_joints_put_it(arm, arm_description, two_arms, two_arms_description):
    for chain, description in ((arm, arm_description), (two_arms, two_arms_description)):
        q, _ = sample_reachable(chain, 20, seed=1)
        poses = forward_kinematics(chain, q, chain.links)
        for row, found in zip(q, poses, strict=True):
            positions = dict(zip(chain.joint_names, row, strict=True))
            for link, pose in zip(chain.links, found, strict=True):
                assert np.allclose(pose, compose(description, positions, link), atol=1e-12), link


def test_shapes_follow_q_and_links(arm, two_arms):
    assert forward_kinematics(arm, np.zeros(7)).shape == (4, 4)
    assert forward_kinematics(arm, np.zeros((5, 2, 7))).shape == (5, 2, 4, 4)
    assert forward_kinematics(arm, np.zeros(7), ["link1", "tool"]).shape == (2, 4, 4)
    assert forward_kinematics(two_arms, np.zeros((3, 12))).shape == (3, 2, 4, 4)
    assert forward_kinematics(two_arms, np.zeros(12), "chest").shape == (4, 4)
    assert np.array_equal(forward_kinematics(arm, np.zeros(7), "link0"), np.eye(4))


def test_pose_and_jacobian_are_pinocchios(arm, home):
    # Recorded with Pinocchio 4.1: frame placement, and columns of the LOCAL_WORLD_ALIGNED Jacobian.
    position = [0.7002892935429023, 0.184554153700101, 0.6099571766949441]
    x_axis = [-0.3416097392457491, 0.6961430340184438, -0.6314171855754699]
    column4 = [0.12583726427171493, 0.01329806035811781, 0.5033043204644985,
               0.076727964194055, -0.9970263610869494, 0.00715924635362833]  # fmt: skip
    column7 = [-0.00526129214569399, 0.00236388831470769, -0.00816889447803359,
               -0.8419051905514443, -0.28025889849534813, 0.46114054249947545]  # fmt: skip
    pose, columns = forward_kinematics(arm, home), jacobian(arm, home)
    assert np.allclose(pose[:3, 3], position, atol=1e-13)
    assert np.allclose(pose[:3, 0], x_axis, atol=1e-13)
    assert np.allclose(columns[:, 3], column4, atol=1e-13)
    assert np.allclose(columns[:, 6], column7, atol=1e-13)


@pytest.mark.parametrize("link", ["tool", "link4"])
def test_jacobian_is_the_derivative_of_a_point_and_of_the_rotation(arm, home, link):
    point, step = np.array([0.1, -0.05, 0.2]), 1e-6
    found = jacobian(arm, home, point, link=link)
    base = forward_kinematics(arm, home, link)
    for i in range(7):
        ahead, behind = home.copy(), home.copy()
        ahead[i] += step
        behind[i] -= step
        a, b = forward_kinematics(arm, ahead, link), forward_kinematics(arm, behind, link)
        linear = ((a - b) @ np.append(point, 1.0))[:3] / (2 * step)
        angular = Rotation.from_matrix(a[:3, :3] @ b[:3, :3].T).as_rotvec() / (2 * step)
        assert np.allclose(found[:3, i], linear, atol=1e-8)
        assert np.allclose(found[3:, i], angular, atol=1e-8)
    own = jacobian(arm, home, point, link=link, frame="link")
    assert np.allclose(base[:3, :3] @ own[:3], found[:3], atol=1e-13)
    assert np.allclose(base[:3, :3] @ own[3:], found[3:], atol=1e-13)


def test_manipulability_is_the_root_of_the_determinant(arm, home, planar):
    columns = jacobian(arm, home)
    assert manipulability(arm, home) == pytest.approx(np.sqrt(np.linalg.det(columns @ columns.T)))
    assert manipulability(planar, [0.3, 0.0]) == pytest.approx(
        np.sqrt(np.linalg.det(jacobian(planar, [0.3, 0.0]).T @ jacobian(planar, [0.3, 0.0])))
    )


def test_samples_are_inside_the_limits_and_repeat(two_arms):
    q, poses = sample_reachable(two_arms, 50, seed=3)
    assert np.all(q >= np.where(np.isfinite(two_arms.lower), two_arms.lower, -np.pi))
    assert np.all(q <= np.where(np.isfinite(two_arms.upper), two_arms.upper, np.pi))
    assert np.array_equal(q, sample_reachable(two_arms, 50, seed=3)[0])
    assert np.array_equal(poses, forward_kinematics(two_arms, q))


def test_wrong_sizes_are_named(arm):
    with pytest.raises(ValueError, match=r"q has shape \(6,\); the chain has 7 joints \(joint1, joint2"):
        forward_kinematics(arm, np.zeros(6))
    with pytest.raises(ValueError, match="no link of the chain named 'tol'; did you mean 'tool'"):
        jacobian(arm, np.zeros(7), link="tol")
    with pytest.raises(ValueError, match='frame must be "base" or "link"'):
        jacobian(arm, np.zeros(7), frame="world")
