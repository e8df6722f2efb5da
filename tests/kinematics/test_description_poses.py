"""Chains and forward kinematics against closed forms with scipy's rotations."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from roboyard.description import load_description
from roboyard.kinematics.description_poses import chain, forward_kinematics, vector_joints
from roboyard.kinematics.joint_models import position_size

ARM = Path(__file__).parents[1] / "data" / "urdf" / "arm.urdf"


@pytest.fixture(scope="module")
def arm():
    return load_description(ARM)


def transform(position=(0, 0, 0), rotation=None) -> np.ndarray:
    out = np.eye(4)
    out[:3, 3] = position
    if rotation is not None:
        out[:3, :3] = rotation.as_matrix()
    return out


def expected_poses(shoulder: float, elbow: float, slide: float) -> dict[str, np.ndarray]:
    upper = transform((0, 0, 0.25), Rotation.from_euler("xyz", [0, 0, np.pi / 2]))
    upper = upper @ transform(rotation=Rotation.from_rotvec([0, shoulder, 0]))
    forearm = upper @ transform((0.3, 0, 0), Rotation.from_euler("xyz", [0.4, -0.3, 0.2]))
    forearm = forearm @ transform(rotation=Rotation.from_rotvec(elbow * np.array([0.36, 0.48, 0.8])))
    return {
        "base": np.eye(4),
        "upper": upper,
        "fore arm": forearm,
        "手": forearm @ transform((slide, 0, 0)),
        "0": upper @ transform((0, 0.1, 0)),
        "ball": transform((0, 0, 0.1)),
        "raft": transform((0, 0, 0.1)),
    }


def assert_poses(found, expected):
    assert list(found) == list(expected)
    for name, pose in expected.items():
        np.testing.assert_allclose(found[name], pose, atol=1e-12, err_msg=name)


def test_zero_configuration(arm):
    assert_poses(forward_kinematics(arm), expected_poses(0, 0, 0.01))


def test_mimic_follows_unless_given(arm):
    found = forward_kinematics(arm, {"shoulder": 0.7, "elbow": -1.1})
    assert_poses(found, expected_poses(0.7, -1.1, 0.05 * -1.1 + 0.01))
    found = forward_kinematics(arm, {"shoulder": 0.7, "elbow": -1.1, "slide": 0.3})
    assert_poses(found, expected_poses(0.7, -1.1, 0.3))


def test_array_follows_the_documented_order(arm):
    assert [joint.name for joint in vector_joints(arm)] == ["shoulder", "elbow"]
    found = forward_kinematics(arm, [0.2, 0.4])
    assert_poses(found, expected_poses(0.2, 0.4, 0.05 * 0.4 + 0.01))


def test_many_configurations_at_once(arm):
    rng = np.random.default_rng(0)
    q = rng.uniform(-3, 3, size=(4, 5, 2))
    found = forward_kinematics(arm, q)
    assert found["手"].shape == (4, 5, 4, 4)
    assert found["base"].shape == (4, 5, 4, 4)
    for i, j in np.ndindex(4, 5):
        one = expected_poses(q[i, j, 0], q[i, j, 1], 0.05 * q[i, j, 1] + 0.01)
        for name, pose in one.items():
            np.testing.assert_allclose(found[name][i, j], pose, atol=1e-12)


def test_positions_broadcast(arm):
    found = forward_kinematics(arm, {"shoulder": np.zeros((3, 1)), "elbow": np.linspace(0, 1, 7)})
    assert found["fore arm"].shape == (3, 7, 4, 4)


def test_spherical_and_planar_joints(arm):
    turn = Rotation.from_rotvec([0.3, -0.5, 0.9])
    found = forward_kinematics(arm, {"socket": turn.as_quat(), "drift": [0.4, -0.2, 0.8]})
    ball = transform((0, 0, 0.1), turn)
    np.testing.assert_allclose(found["ball"], ball, atol=1e-12)
    raft = ball @ transform((0.4, -0.2, 0), Rotation.from_rotvec([0, 0, 0.8]))
    np.testing.assert_allclose(found["raft"], raft, atol=1e-12)


def test_floating_joint():
    robot = load_description(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="free" type="floating">'
        '<origin xyz="0 0 1"/><parent link="a"/><child link="b"/></joint></robot>'
    )
    assert position_size(robot.joints[0]) == 7
    turn = Rotation.from_rotvec([0.1, 0.2, 0.3])
    found = forward_kinematics(robot, {"free": [1, 2, 3, *turn.as_quat()]})
    np.testing.assert_allclose(found["b"], transform((1, 2, 4), turn), atol=1e-12)
    np.testing.assert_allclose(forward_kinematics(robot)["b"], transform((0, 0, 1)), atol=1e-12)


def test_mimics_of_mimics_add_up():
    joints = "".join(
        f'<joint name="j{i}" type="prismatic"><parent link="l{i}"/><child link="l{i + 1}"/>'
        + (f'<mimic joint="j{i - 1}" multiplier="2" offset="0.5"/>' if i else "")
        + "</joint>"
        for i in range(3)
    )
    robot = load_description(
        '<robot name="r">' + "".join(f'<link name="l{i}"/>' for i in range(4)) + joints + "</robot>"
    )
    x = forward_kinematics(robot, {"j0": 1.0})["l3"][0, 3]
    assert x == pytest.approx(1.0 + (2 * 1 + 0.5) + (2 * 2.5 + 0.5))
    x = forward_kinematics(robot, {"j0": 1.0, "j1": 0.0})["l3"][0, 3]
    assert x == pytest.approx(1.0 + 0.0 + 0.5)


def test_chain_between_any_two_links(arm):
    def names(a, b):
        return [joint.name for joint in chain(arm, a, b)]

    assert names("base", "手") == ["shoulder", "elbow", "slide"]
    assert names("手", "base") == ["slide", "elbow", "shoulder"]
    assert names("0", "fore arm") == ["weld", "elbow"]
    assert names("upper", "upper") == []
    assert names("手", "raft") == ["slide", "elbow", "shoulder", "socket", "drift"]


def test_wrong_names_and_shapes(arm):
    with pytest.raises(KeyError, match="did you mean 'elbow'"):
        forward_kinematics(arm, {"elbw": 0})
    with pytest.raises(KeyError, match="no link named 'hand'"):
        chain(arm, "base", "hand")
    with pytest.raises(ValueError, match="'weld' is fixed"):
        forward_kinematics(arm, {"weld": 0})
    with pytest.raises(ValueError, match=r"takes positions of shape \(\.\.\., 4\)"):
        forward_kinematics(arm, {"socket": [0, 0, 1]})
    with pytest.raises(ValueError, match=r"must have shape \(\.\.\., 2\)"):
        forward_kinematics(arm, [0, 0, 0])
