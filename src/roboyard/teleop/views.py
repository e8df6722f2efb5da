"""What the robot's sensors see, one after the other, and at last the scene as a whole."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboyard.sensors import CameraSensor, Lidar

if TYPE_CHECKING:
    from roboyard.recording import SceneSetup
    from roboyard.sensors import Scan

WIDTH, HEIGHT = 72, 54
"""Pixels of a picture."""
NEAR, FAR, SELF = (255, 150, 40), (40, 110, 255), (255, 255, 255)
"""Colours in a lidar's picture: of the nearest and the farthest points, and of the lidar."""


class Views:
    """A ring of pictures; each look takes the next."""

    def __init__(self, stage: SceneSetup) -> None:
        self._stage = stage
        self._next = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Of all views: the robot's cameras and lidars, then the scene's own view."""
        sensors = self._stage.robot.sensors if self._stage.robot is not None else {}
        names = sensors.names if not isinstance(sensors, dict) else ()
        return (
            *(name for name in names if isinstance(sensors[name], (CameraSensor, Lidar))),
            f"scene {self._stage.scene.name}",
        )

    def look(self) -> tuple[str, NDArray[np.uint8]]:
        """Name and (h, w, 3) picture of the next view."""
        names = self.names
        name = names[self._next % len(names)]
        self._next += 1
        return name, self.picture(name)

    def picture(self, name: str) -> NDArray[np.uint8]:
        """(h, w, 3) what a view shows now."""
        robot, scene = self._stage.robot, self._stage.scene
        if robot is not None and name in robot.sensors.names:
            sensor = robot.sensors[name]
            if isinstance(sensor, CameraSensor):
                return sensor.image().rgb
            if isinstance(sensor, Lidar):
                return from_above(sensor.scan())
        return scene.world.render(scene.camera(width=WIDTH, height=HEIGHT)).rgb


def from_above(scan: Scan, size: int = HEIGHT) -> NDArray[np.uint8]:
    """(size, size, 3) map of a scan, x of the lidar up and y to the left, as wide as the farthest point."""
    picture = np.zeros((size, size, 3), dtype=np.uint8)
    points = scan.points(world=False)[:, :2]
    middle = size // 2
    if len(points):
        away = np.linalg.norm(points, axis=1)
        reach = max(float(away.max()), 1e-6)
        row, column = (np.rint(middle - axis / reach * (middle - 1)).astype(int) for axis in points.T)
        share = (away / reach)[:, None]
        order = np.argsort(-away)  # the nearest on top
        picture[row[order], column[order]] = ((1 - share) * NEAR + share * FAR)[order]
    picture[middle, middle] = SELF
    return picture
