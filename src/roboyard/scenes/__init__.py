"""Scenes for robots: an empty floor, a table, rough terrain, a flat, and MJCF, URDF or USD scene files.

>>> from roboyard.scenes import load_scene
>>> scene = load_scene("home")
>>> robot = scene.world.add_urdf("robot.urdf", scene.spawn, scene.spawn_orientation)
>>> scene.joints["bedroom_door/hinge"].position = 1.2
"""

from __future__ import annotations

from roboyard.scenes.empty_scene import empty
from roboyard.scenes.flat import home
from roboyard.scenes.load import SCENES, check_scene, load_scene
from roboyard.scenes.scene import Scene, let_sleep
from roboyard.scenes.tabletop_scene import tabletop
from roboyard.scenes.terrain_scene import terrain

__all__ = [
    "SCENES",
    "Scene",
    "check_scene",
    "empty",
    "home",
    "let_sleep",
    "load_scene",
    "tabletop",
    "terrain",
]
