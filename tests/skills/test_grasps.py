"""Grasps of objects and handles: between the fingers, clear of what is behind."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.model import Box, Collision, Cylinder, Joint, Limit, Link, Pose, RobotDescription
from roboyard.planning.body_points import body_points
from roboyard.robots import add_robot
from roboyard.robots.robot import Robot
from roboyard.scenes import household_objects
from roboyard.sim import World
from roboyard.skills.grasps import handle_grasps, object_grasps
from roboyard.skills.gripper_frame import gripper_frame, pointing, shifted


@pytest.fixture(scope="module")
def robot() -> Robot:
    world = World()
    world.add_plane()
    return add_robot(world, "r1")


def test_the_gripper_frame_is_between_the_fingers(robot: Robot) -> None:
    gripper = gripper_frame(robot, "left")
    assert gripper.opening == pytest.approx(0.10, abs=0.01), "the fingers open by 5 cm each"
    np.testing.assert_allclose(gripper.offset[:3, 3], (0, 0, 0), atol=0.015)
    np.testing.assert_allclose(np.abs(gripper.offset[:3, :3]), np.eye(3), atol=1e-6)
    assert gripper.offset[2, 2] > 0, "z points out of the gripper"
    np.testing.assert_allclose(gripper.tool_pose(gripper.offset), np.eye(4), atol=1e-12)


def test_pointing_and_shifted() -> None:
    pose = pointing(np.array([0.0, 2.0, 0.0]), np.array([1.0, 1.0, 0.0]), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(pose[:3, 2], (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(pose[:3, 1], (1, 0, 0), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    np.testing.assert_allclose(shifted(pose, -0.1)[:3, 3], (1, 1.9, 3), atol=1e-12)


def test_grasps_hold_the_mug_across_its_body(robot: Robot) -> None:
    gripper = gripper_frame(robot, "left")
    world = World()
    mug = world.add_description(household_objects.mug(), (0.3, 0.2, 0.5), (0, 0, np.sin(0.4), np.cos(0.4)))
    grasps = object_grasps(body_points(mug), gripper)
    assert len(grasps) > 50
    assert [g.cost for g in grasps] == sorted(g.cost for g in grasps)
    for grasp in grasps[:50]:
        center = (grasp.pose[:3, 3] - mug.position)[:2]
        assert np.linalg.norm(center) < 0.05, "the grasp is at the mug"
        assert 0.5 < grasp.pose[2, 3] < 0.6
        # the fingers are on either side of the mug's wall, which has a radius of 4 cm
        across = np.abs((grasp.pose[:3, 3] - mug.position) @ grasp.pose[:3, 1])
        assert across + 0.04 < gripper.opening / 2 + 0.02


def test_what_is_wider_than_the_fingers_has_no_grasp(robot: Robot) -> None:
    world = World()
    crate = world.add_box((0.3, 0.3, 0.3), (0, 0, 0.15))
    assert object_grasps(body_points(crate), gripper_frame(robot, "left")) == []


def test_a_handle_is_gripped_across_its_bar_from_outside(robot: Robot) -> None:
    gripper = gripper_frame(robot, "right")
    front = Collision(geometry=Box(size=(0.02, 0.5, 0.2)))
    turn = (np.sin(np.pi / 4), 0.0, 0.0, np.cos(np.pi / 4))
    bar = Collision(
        geometry=Cylinder(radius=0.006, length=0.15),
        origin=Pose(position=(-0.05, 0.1, 0.03), quaternion=turn),
    )
    drawer = RobotDescription(
        name="drawer",
        links=(Link(name="case"), Link(name="box", collisions=(front, bar))),
        joints=(
            Joint(
                name="slide",
                type="prismatic",
                parent="case",
                child="box",
                axis=(-1, 0, 0),
                limit=Limit(lower=0.0, upper=0.3, effort=10, velocity=1),
            ),
        ),
    )
    world = World()
    body = world.add_description(drawer, (1.0, 0.0, 0.5), fixed_base=True)
    grasps = handle_grasps(body.link("box"), gripper)
    assert len(grasps) == 2, "with either finger up"
    for grasp in grasps:
        np.testing.assert_allclose(grasp.pose[:3, 2], (1, 0, 0), atol=0.06)  # towards the front
        np.testing.assert_allclose(np.abs(grasp.pose[:3, 1]), (0, 0, 1), atol=0.06)  # fingers above and below
        np.testing.assert_allclose(grasp.pose[1:3, 3], (0.1, 0.53), atol=0.005)
        tips = grasp.pose[0, 3] + gripper.ahead
        assert 0.95 < tips < 0.99, "beyond the bar, before the front"
        assert grasp.swivel is not None
        np.testing.assert_allclose(np.abs(grasp.swivel), (0, 1, 0), atol=1e-6)
