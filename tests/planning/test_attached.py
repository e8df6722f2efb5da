"""Bodies that a robot holds are part of it: in spheres, in exact shapes, and no obstacle."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.description.robot_model import CollisionSphere
from roboyard.planning import attached_body, planner_for
from roboyard.planning.attached import spheres_around
from roboyard.robots import add_robot
from roboyard.robots.robot import Robot
from roboyard.sim import World
from roboyard.sim.body import Body
from roboyard.transforms import rotate


@pytest.fixture(scope="module")
def held() -> tuple[Robot, Body]:
    """R1 with a long stick in its left gripper."""
    world = World()
    world.add_plane()
    robot = add_robot(world, "r1")
    position, quaternion = robot.arms["left"].pose
    position = position + rotate(quaternion, (0.0, 0.0, 0.22))  # from the gripper outwards
    stick = world.add_box((0.02, 0.02, 0.5), position, orientation=quaternion, mass=0.1, name="stick")
    return robot, stick


def test_spheres_contain_the_points() -> None:
    points = np.random.default_rng(0).normal(size=(500, 3)) * (0.1, 0.02, 0.02)
    spheres = spheres_around(points, 6)
    assert 1 < len(spheres) <= 6

    def depth(one: CollisionSphere) -> np.ndarray:
        return np.linalg.norm(points - one.center, axis=1) - one.radius

    assert np.min([depth(one) for one in spheres], axis=0).max() < 1e-9
    whole = max(float(one.radius) for one in spheres)
    assert whole < 0.2, "several spheres are tighter than one"


def test_what_is_held_blocks_the_way_and_is_no_obstacle(held: tuple[Robot, Body]) -> None:
    robot, stick = held
    tool, near = (
        "left_eef_link",
        ["left_gripper_link1", "left_gripper_link2", "left_arm_link6", "left_arm_link5"],
    )
    post = stick.position + rotate(stick.orientation, (0.0, 0.0, 0.26))
    robot.world.add_sphere(0.03, post, mass=0.0, name="post")
    alone = planner_for(robot, "left", ignored=[stick])
    assert alone.plan(alone.start()).solved, "the arm itself is clear of the post"
    carrying = planner_for(robot, "left", held=[attached_body(robot, stick, tool, near)])
    plan = carrying.plan(carrying.start())
    assert plan.outcome == "start in collision"
    assert "post" in plan.reason, "the stick touches it"
    assert "stick" not in plan.reason
    as_obstacle = planner_for(robot, "left").plan(alone.start())
    assert "stick" in as_obstacle.reason, "the fingers are inside it"
