"""Pictures of the robot's cameras and lidars, one after the other, and of the whole scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from roboyard._arrays import NDArray
from roboyard.sensors import CameraSensor, Lidar

if TYPE_CHECKING:
    from roboyard.recording import SceneSetup
    from roboyard.sensors import Scan

WIDTH, HEIGHT = 72, 54
"""Size of a picture (pixels)."""
NEAR, FAR, SELF = (255, 150, 40), (40, 110, 255), (255, 255, 255)
"""Colours in the picture of a lidar: nearest points, farthest points and the lidar itself."""


class Views:
    """The views of a robot and its scene, in a fixed order that repeats."""

    def __init__(self, scene_setup: SceneSetup) -> None:
        """Start with the first view of a scene with a robot."""
        self._robot, self._scene = scene_setup.robot, scene_setup.scene
        self._next = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all views: the robot's cameras and lidars, then the scene's camera."""
        sensors = self._robot.sensors if self._robot is not None else {}
        names = sensors.names if not isinstance(sensors, dict) else ()
        return (
            *(name for name in names if isinstance(sensors[name], (CameraSensor, Lidar))),
            f"scene {self._scene.name}",
        )

    def next_picture(self) -> tuple[str, NDArray[np.uint8]]:
        """Return the name and the (h, w, 3) uint8 picture of the next view."""
        names = self.names
        name = names[self._next % len(names)]
        self._next += 1
        return name, self.picture(name)

    def picture(self, name: str) -> NDArray[np.uint8]:
        """Return the present (h, w, 3) uint8 picture of a view."""
        robot, scene = self._robot, self._scene
        if robot is not None and name in robot.sensors.names:
            sensor = robot.sensors[name]
            if isinstance(sensor, CameraSensor):
                return sensor.image().rgb
            if isinstance(sensor, Lidar):
                return from_above(sensor.scan())
        return scene.world.render(scene.camera(width=WIDTH, height=HEIGHT)).rgb


def from_above(scan: Scan, size: int = HEIGHT) -> NDArray[np.uint8]:
    """Return a (size, size, 3) uint8 map of a scan, with x of the lidar up and y to the left.

    Args:
        scan: a scan of a lidar.
        size: width and height (pixels); half of it shows the distance of the farthest point.
    """
    picture = np.zeros((size, size, 3), dtype=np.uint8)
    points = scan.points(world=False)[:, :2]
    middle = size // 2
    if len(points):
        away = np.linalg.norm(points, axis=1)
        reach = max(float(away.max()), 1e-6)
        row, column = (np.rint(middle - axis / reach * (middle - 1)).astype(int) for axis in points.T)
        share = (away / reach)[:, None]
        order = np.argsort(-away)  # the nearest points drawn last
        picture[row[order], column[order]] = ((1 - share) * NEAR + share * FAR)[order]
    picture[middle, middle] = SELF
    return picture
