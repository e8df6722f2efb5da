"""Lidar scans as point clouds in the scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray

if TYPE_CHECKING:
    from roboyard.robots import Robot
    from roboyard.sensors import Lidar, Scan

NEAR, FAR = 0.5, 10.0
"""Range of distances of the colour scale (m)."""
RAMP = np.array([(225, 50, 40), (245, 165, 30), (90, 190, 70), (40, 120, 220), (80, 60, 160)], dtype=float)
"""RGB colours from near to far, evenly spaced over the logarithm of the distance."""
ITSELF = (255, 0, 200)
"""RGB of points on the robot that carries the lidar."""
SIZE = 0.02
"""Size of a point (m)."""


class Scans:
    """One point cloud, which has a node in the scene only while it has points."""

    def __init__(self, server: Any, path: str = "/scans") -> None:
        """Start without points; `path` is the node of the cloud in the scene."""
        self._server, self._path = server, path
        self._node: Any = None
        self._points = np.zeros((0, 3), dtype=np.float32)

    @property
    def points(self) -> NDArray[np.float32]:
        """(k, 3) shown points in the world frame (m)."""
        return self._points

    def show(self, lidars: Sequence[Lidar]) -> None:
        """Scan once with each lidar and show the points; call it from the simulation thread."""
        scans = [lidar.scan() for lidar in lidars]
        points = np.concatenate([np.zeros((0, 3)), *(scan.points() for scan in scans)]).astype(np.float32)
        if np.array_equal(points, self._points):
            return
        colors = [scan_colors(scan, lidar.link.body.id) for scan, lidar in zip(scans, lidars, strict=True)]
        shades = np.concatenate([np.zeros((0, 3), dtype=np.uint8), *colors])
        with self._server.atomic():
            if not len(points):
                self.clear()
            elif self._node is None:
                self._node = self._server.scene.add_point_cloud(
                    self._path, points, shades, point_size=SIZE, point_shape="circle", precision="float32"
                )
            else:
                self._node.points, self._node.colors = points, shades
        self._points = points

    def clear(self) -> None:
        """Remove all points."""
        self._points = self._points[:0]
        if self._node is not None:
            self._node.remove()
            self._node = None


def lidars_of(robot: Robot) -> list[Lidar]:
    """Return the lidars of a robot."""
    from roboyard.sensors import Lidar

    sensors = robot.sensors
    return [sensor for name in sensors.names if isinstance(sensor := sensors[name], Lidar)]


def scan_colors(scan: Scan, carrier: int) -> NDArray[np.uint8]:
    """Return (k, 3) RGB of the points of a scan, by distance; points on the body `carrier` have `ITSELF`."""
    seen = scan.hit
    share = np.log(np.clip(scan.ranges[seen], NEAR, FAR) / NEAR) / np.log(FAR / NEAR)
    places = np.linspace(0.0, 1.0, len(RAMP))
    colors = np.stack([np.interp(share, places, RAMP[:, k]) for k in range(3)], axis=1)
    colors[scan.owners[seen][:, 0] == carrier] = ITSELF
    return np.round(colors).astype(np.uint8)
