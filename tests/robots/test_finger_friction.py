"""Fingers hold what they touch in one point each against turning about the line between them."""

from __future__ import annotations

import numpy as np

from roboyard.assets import assets_root
from roboyard.description.model import Collision, Inertial, Link, Pose, RobotDescription, Sphere
from roboyard.robots import add_robot
from roboyard.sim import World
from roboyard.transforms import matrix_from_quaternion


def test_a_gripped_ball_with_its_weight_aside_does_not_swing() -> None:
    """Its weight turns it by 0.02 N m; a pad of 8 mm radius holds 0.005 m times the force of each finger."""
    world = World()
    robot = add_robot(world, str(assets_root() / "franka_panda" / "panda.urdf"), self_collision=False)
    body = robot.body
    fingers = [joint for joint in body.joints if "finger_joint" in joint.name]
    for joint in fingers:
        joint.position = 0.025
    tips = [body.link(name).pose for name in ("panda_leftfinger", "panda_rightfinger")]
    hand = matrix_from_quaternion(tips[0][1])
    middle = (tips[0][0] + tips[1][0]) / 2 + hand[:, 2] * 0.045
    level = np.cross(hand[:, 1], (0.0, 0.0, 1.0))
    level /= np.linalg.norm(level)
    weight = Inertial(
        mass=0.05, inertia=(1e-4, 0.0, 0.0, 1e-4, 0.0, 1e-4), origin=Pose(position=tuple(0.04 * level))
    )  # type: ignore[arg-type]
    ball = Link(name="ball", collisions=(Collision(geometry=Sphere(radius=0.022)),), inertial=weight)
    held = world.add_description(RobotDescription(name="ball", links=(ball,), joints=()), tuple(middle))
    for step in range(240):
        if step == 60:  # the fingers have closed
            start = held.orientation.copy()
        for joint in fingers:
            joint.drive_position(0.0, max_effort=20.0)
        world.step()
    assert np.linalg.norm(held.position - middle) < 0.01
    turned = 2 * np.arccos(min(1.0, abs(float(held.orientation @ start))))
    assert turned < 0.15  # a pendulum without friction turns by over 2 rad meanwhile
