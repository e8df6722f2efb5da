"""Joint models: every part of Roboyard moves the same joint alike, and broken mimic chains end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from roboyard.description.model import Inertial, Mimic
from roboyard.errors import DescriptionError
from roboyard.kinematics import forward_kinematics as chain_poses
from roboyard.kinematics import from_description
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.kinematics.joint_models import mimic_source, plane_axes
from roboyard.sim import World
from roboyard.transforms import matrix_from_quaternion


def test_plane_axes_are_right_handed():
    for normal in ([0, 0, 1], [1, 0, 0], [0, 1, 0], [0.36, 0.48, 0.8], [-0.6, 0, 0.8]):
        first, second = plane_axes(normal)
        frame = np.stack([first, second, normal])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1)
    np.testing.assert_array_equal(plane_axes([0, 0, 1]), [[1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, -1), (0.36, 0.48, 0.8)])
def test_planar_joint_has_the_same_pose_in_world_chain_and_description(build, normal):
    joint, robot = build
    axis = tuple(map(float, normal))
    description = robot(
        "r", [joint("flat", "planar", "base", "plate", (0, 0, 1), (0.1, 0.2, 0.3), axis=axis)]
    )
    inertial = Inertial(mass=1.0, inertia=(0.1, 0.1, 0.1, 0, 0, 0))
    description = replace(
        description, links=tuple(replace(link, inertial=inertial) for link in description.links)
    )
    q = np.array([0.3, -0.2, 0.7])
    expected = forward_kinematics(description, {"flat": q})["plate"]
    np.testing.assert_allclose(chain_poses(from_description(description, "plate"), q), expected, atol=1e-12)
    body = World(gravity=(0, 0, 0)).add_urdf(description, fixed_base=True)
    body.joint("flat").position = q
    position, quaternion = body.link("plate").pose
    np.testing.assert_allclose(position, expected[:3, 3], atol=1e-9)
    np.testing.assert_allclose(matrix_from_quaternion(quaternion), expected[:3, :3], atol=1e-9)


def test_mimic_circle_beside_the_joint_ends_with_an_error(build):
    joint, robot = build
    joints = [
        joint("c", "prismatic", "base", "one", mimic=Mimic(joint="a", offset=0.5)),
        joint("a", "prismatic", "one", "two", mimic=Mimic(joint="b")),
        joint("b", "prismatic", "two", "three", mimic=Mimic(joint="a")),
    ]
    description = robot("ring", joints)
    source = mimic_source(description, description.joints[0])
    assert source.leader is None
    assert "c -> a -> b -> a" in str(source.error)
    assert forward_kinematics(description)["three"][0, 3] == pytest.approx(0.5)
    with pytest.raises(DescriptionError, match=r"c -> a -> b -> a"):
        from_description(description, "three")


def test_mimic_chain_ends_at_a_joint_with_a_given_position(build):
    joint, robot = build
    joints = [
        joint("a", "prismatic", "base", "one"),
        joint("b", "prismatic", "one", "two", mimic=Mimic(joint="a", multiplier=2.0, offset=0.1)),
        joint("c", "prismatic", "two", "three", mimic=Mimic(joint="b", multiplier=-3.0, offset=0.2)),
    ]
    description = robot("chain", joints)
    whole = mimic_source(description, description.joints[2])
    assert (whole.leader, whole.multiplier) == (description.joints[0], -6.0)
    assert whole.offset == pytest.approx(-3.0 * 0.1 + 0.2)
    part = mimic_source(description, description.joints[2], {"b"})
    assert (part.leader, part.multiplier, part.offset) == (description.joints[1], -3.0, 0.2)


def test_mimic_of_a_joint_with_several_degrees_of_freedom_is_an_error(build):
    joint, robot = build
    joints = [
        joint("ball", "spherical", "base", "one"),
        joint("b", "continuous", "one", "two", mimic=Mimic(joint="ball")),
    ]
    with pytest.raises(DescriptionError, match=r'"ball" \(spherical\); it needs a joint with one degree'):
        from_description(robot("r", joints), "two")
