"""Where the camera of a driving page starts: in the robot's room, with no wall in between."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import add_robot
from roboyard.scenes import load_scene
from roboyard.transforms import matrix_from_quaternion, quaternion_from_rpy
from roboyard.viewer.driving.aim import SHOWN_THROUGH, clear_viewpoint, seen_heights

CLEARANCE = 0.02
"""Length by which walls are smaller in the test than in the flat (m)."""


def walls_of(world: Any) -> np.ndarray:
    """Return the (n, 2, 3) boxes of the flat's walls (m), which are parallel to the axes."""
    body = world.body("walls")
    position, quaternion = body.pose
    turn = matrix_from_quaternion(quaternion)
    boxes = []
    for shape in world.render_scene().shapes:
        if shape.owner[0] == body.id:
            points = (shape.mesh.vertices * shape.scale) @ np.asarray(shape.rotation).T + shape.position
            placed = points @ turn.T + position
            boxes.append([placed.min(axis=0) + CLEARANCE / 2, placed.max(axis=0) - CLEARANCE / 2])
    return np.array(boxes)


def is_crossed(boxes: np.ndarray, start: np.ndarray, end: np.ndarray) -> bool:
    """Return whether a segment passes through any of (n, 2, 3) boxes (slab method)."""
    way = np.where(np.abs(end - start) < 1e-9, 1e-9, end - start)
    shares = (boxes - start) / way
    enter, leave = shares.min(axis=1).max(axis=1), shares.max(axis=1).min(axis=1)
    return bool(((enter < leave) & (leave > 0.0) & (enter < 1.0)).any())


@pytest.fixture(scope="module")
def home() -> tuple[Any, Any, np.ndarray]:
    scene = load_scene("home")
    robot = add_robot(scene.world, "rover")
    return scene.world, robot, walls_of(scene.world)


@pytest.mark.parametrize("yaw", [0.0, 2.0, 4.0])
@pytest.mark.parametrize("place", [(-1.25, -1.2), (2.2, -1.8), (-2.9, 1.2), (2.9, 1.5)])
def test_the_camera_starts_in_the_room_of_the_robot(
    home: tuple[Any, Any, np.ndarray], place: tuple[float, float], yaw: float
) -> None:
    _, robot, walls = home
    z = robot.body.position[2]
    robot.body.set_pose(position=(*place, z), orientation=quaternion_from_rpy((0.0, 0.0, yaw)))
    eye, target = clear_viewpoint(robot)
    base = np.array(robot.base_link.pose[0])
    assert not any(is_crossed(walls, base + np.array([0.0, 0.0, up]), eye) for up in (0.05, 0.25, 0.45))
    assert not is_crossed(walls, target, np.array([eye[0], eye[1], target[2]]))
    assert is_crossed(walls, target, target + np.array([9.0, 0.0, 0.0]))  # the flat has walls at that height


def test_the_points_to_see_are_on_the_robot() -> None:
    scene = load_scene("empty")
    robot = add_robot(scene.world, "r1")
    lower, upper = robot.body.bounds[:, 2]
    heights = np.array(seen_heights(robot)) + robot.base_link.pose[0][2]
    np.testing.assert_allclose((heights - lower) / (upper - lower), SHOWN_THROUGH)
