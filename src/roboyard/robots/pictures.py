"""Cached pictures of registered robots.

Pictures are `<data>/.pictures/<name>-<digest>.png`, with a digest of definition and URDF, so that a robot
whose files change gets another picture.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

from roboyard.paths import data_folder
from roboyard.robots.registry import RegisteredRobot, Registry

if TYPE_CHECKING:
    from pathlib import Path


def picture_of(robot: RegisteredRobot, registry: Registry) -> Path:
    """Return a picture file of a registered robot: its own, else a rendered and cached one.

    Raises:
        ConfigError: the robot's definition is wrong.
        DescriptionError: its URDF cannot be loaded.
    """
    if robot.picture is not None:
        return robot.picture
    definition = robot.definition
    digest = hashlib.sha256(robot.file.read_bytes() + robot.urdf_of(definition).read_bytes()).hexdigest()
    file = data_folder(registry.data) / ".pictures" / f"{robot.name}-{digest[:12]}.png"
    if not file.is_file():
        from roboyard.rendering import png_bytes
        from roboyard.robots.portrait import render_portrait
        from roboyard.robots.spawn import add_robot
        from roboyard.sim.world import World

        world = World()
        world.add_plane()
        spawned = add_robot(world, robot)
        spawned.set_pose(spawned.position - [0.0, 0.0, spawned.body.bounds[0, 2]])
        image = png_bytes(render_portrait(spawned))
        file.parent.mkdir(parents=True, exist_ok=True)
        draft = file.with_name(f".{file.name}")
        draft.write_bytes(image)
        draft.replace(file)
    return file
