"""Pictures of robots: one in its world as it stands, and one of each registered robot, kept once rendered.

They lie in `<data>/.pictures/<name>-<digest>.png`; the digest is that of definition and URDF, so that a robot
that changes gets another picture.
"""

from __future__ import annotations

import hashlib
import math
from typing import TYPE_CHECKING

import numpy as np

from roboyard.paths import data_folder
from roboyard.robots.registry import RegisteredRobot, Registry

if TYPE_CHECKING:
    from pathlib import Path

    from roboyard.rendering import Image
    from roboyard.robots.robot_body import RobotBody

WIDTH, HEIGHT = 480, 360
"""pixels"""
FOVY = math.radians(30.0)
VIEW_FROM = (0.80, -0.48, 0.36)
"""Unit direction from the robot to the camera: robots face +x."""
ROOM = 0.52
"""Radius of the ball round the robot's box that is shown; of the box's diagonal."""


def portrait(robot: RobotBody, *, width: int = WIDTH, height: int = HEIGHT) -> Image:
    """A picture of a robot where it stands, from the front and its right."""
    from roboyard.rendering import Camera

    low, high = robot.body.bounds
    target = (low + high) / 2
    reach = ROOM * max(float(np.linalg.norm(high - low)), 0.05)
    across = 2.0 * math.atan(math.tan(FOVY / 2) * width / height)
    direction = np.asarray(VIEW_FROM) / np.linalg.norm(VIEW_FROM)
    eye = target + direction * reach / math.sin(min(FOVY, across) / 2)
    return robot.world.render(Camera.look_at(eye, target, width=width, height=height, fovy=FOVY))


def picture_of(robot: RegisteredRobot, registry: Registry) -> Path:
    """A picture file of a registered robot: its own where it has one, else one that is rendered now and kept.

    Raises:
        ConfigError: the robot's definition is wrong.
        DescriptionError: its URDF cannot be used.
    """
    if robot.picture is not None:
        return robot.picture
    definition = robot.definition
    digest = hashlib.sha256(robot.file.read_bytes() + robot.urdf_of(definition).read_bytes()).hexdigest()
    file = data_folder(registry.data) / ".pictures" / f"{robot.name}-{digest[:12]}.png"
    if not file.is_file():
        from roboyard.rendering import png_bytes
        from roboyard.robots.spawn import add_robot
        from roboyard.sim.world import World

        world = World()
        world.add_plane()
        made = add_robot(world, robot)
        position, _ = made.get_position_orientation(backend="numpy")
        made.set_position_orientation(position - [0.0, 0.0, made.body.bounds[0, 2]])
        image = png_bytes(portrait(made))
        file.parent.mkdir(parents=True, exist_ok=True)
        draft = file.with_name(f".{file.name}")
        draft.write_bytes(image)
        draft.replace(file)
    return file
