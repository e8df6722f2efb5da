"""Obstacles from a depth picture: surface points without the robot's own, as a distance field."""

from __future__ import annotations

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import Pose
from roboyard.errors import ConfigError
from roboyard.kinematics import forward_kinematics
from roboyard.planning.distance_fields import cloud_field
from roboyard.planning.obstacles import Obstacle
from roboyard.planning.spheres.sphere_model import SphereRobot
from roboyard.rendering.camera import Camera
from roboyard.transforms import Array

OWN = 0.03
"""Distance from the robot's spheres within which a point counts as the robot's own (m)."""
FARTHEST = 4.0
"""Largest distance of points that are used, from the robot's root link (m)."""


def depth_obstacle(
    depth: ArrayLike,
    camera: Camera,
    robot: SphereRobot,
    q: ArrayLike,
    root: Array,
    *,
    cell: float = 0.02,
    name: str = "seen",
) -> Obstacle:
    """Return what a depth picture shows besides the robot; space behind surfaces counts as free.

    Args:
        depth: (height, width) distances along the camera's axis (m); inf or NaN where there is none.
        camera: that took the picture.
        robot: its spheres.
        q: (n,) joint positions when the picture was taken (rad or m), in the order of `robot.joint_names`.
        root: (4, 4) pose of the robot's root link in the world frame (m).
        cell: edge of the cells that points are sorted into (m).
        name: of the obstacle, in messages.

    Raises:
        ConfigError: the picture has another size than the camera, or shows nothing but the robot.
    """
    picture = np.asarray(depth, dtype=float)
    if picture.shape != (camera.height, camera.width):
        raise ConfigError(
            f"depth has shape {picture.shape}; the camera's pictures are {(camera.height, camera.width)}"
        )
    points = camera.deproject(picture).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    points = points[np.linalg.norm(points - root[:3, 3], axis=1) < FARTHEST]
    points = _thinned(points, cell / 2)
    points = points[~_is_own(points, robot, np.asarray(q, dtype=float), root)]
    if not len(points):
        raise ConfigError(f"depth picture: none of {picture.size} pixels shows an obstacle; move the camera")
    return Obstacle(name=name, shape=cloud_field(points, cell), pose=Pose())


def _thinned(points: Array, cell: float) -> Array:
    """Return one of the points in each cell."""
    _, first = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_index=True)
    return points[first]


def _is_own(points: Array, robot: SphereRobot, q: Array, root: Array) -> np.ndarray:
    """Return (p,) whether points (p, 3) are at the robot's spheres."""
    own = np.zeros(len(points), dtype=bool)
    frames = root @ forward_kinematics(robot.chain, q, list(robot.links))
    for name, frame in zip(robot.links, frames, strict=True):
        for sphere in robot.model.spheres[name]:
            center = frame[:3, :3] @ np.array(sphere.center) + frame[:3, 3]
            own |= ((points - center) ** 2).sum(axis=1) < (sphere.radius + OWN) ** 2
    return own
