"""Cameras as pyramids, lidars as rings and end effectors as frames, with live pictures and scans."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import NDArray
from roboyard.sensors.camera import FOVX
from roboyard.transforms import Array, matrix_from_quaternion, quaternion_from_matrix, to_wxyz
from roboyard.viewer.inspector.edits.edit_state import EditState, SensorPose
from roboyard.viewer.scene.scans import Scans

if TYPE_CHECKING:
    from roboyard.sim.body import Body
    from roboyard.viewer.viewer import Viewer

ASPECT = 4.0 / 3.0
FOVY = 2.0 * math.atan(math.tan(FOVX / 2.0) / ASPECT)
"""Vertical field of view (rad)."""
TO_OPTICAL = np.diag([1.0, -1.0, -1.0, 1.0])
"""Rotation from a camera frame with viewing direction -z and +y up to one with +z and +y down."""
PLAIN, PICKED = (60, 60, 70), (250, 120, 10)
RINGS = 48
"""Points of a ring."""
NEAREST = 0.05
"""Least range of a live scan (m)."""


class SensorLayer:
    """Nodes of all sensors; created when first shown and again after each change."""

    def __init__(self, viewer: Viewer, body: Body, edits: EditState, size: float) -> None:
        """Start hidden; the `size` of the robot (m) scales the nodes."""
        self._viewer, self._body, self._edits = viewer, body, edits
        self._length = 0.07 * size
        self.nodes: list[Any] = []
        self.is_on = False
        self.picked: SensorPose | None = None
        self.scans = Scans(viewer.server)

    @property
    def all_nodes(self) -> list[Any]:
        """The nodes of all sensors."""
        return list(self.nodes)

    def path_of(self, sensor: SensorPose) -> tuple[str, Array] | None:
        """Return the parent node of a sensor and its (4, 4) pose there (m); None: the link does not exist."""
        name, pose = self._edits.place_of(sensor)
        node = self.node_of(name)
        return None if node is None else (node, pose)

    def node_of(self, name: str) -> str | None:
        """Return the path of a link's node; None: the link does not exist."""
        link = next((link for link in self._body.links if link.name == name), None)
        return None if link is None else self._viewer.path_of(link)

    def show(self, on: bool) -> None:
        """Show or hide all sensors."""
        self.is_on = on
        for node in self.nodes:
            node.visible = on
        self.draw()

    def clear(self) -> None:
        """Remove all nodes from the scene."""
        for node in self.nodes:
            node.remove()
        self.nodes.clear()

    def draw(self) -> None:
        """Update all nodes."""
        if not self.is_on:
            return
        with self._viewer.server.atomic():
            self.clear()
            for k, sensor in enumerate(self._edits.sensors):
                place = self.path_of(sensor)
                if place is not None:
                    self.nodes.append(self._add(f"{place[0]}/sensor {k + 1}", sensor, place[1]))

    def _add(self, name: str, sensor: SensorPose, pose: Array) -> Any:
        scene, color = self._viewer.server.scene, PICKED if sensor is self.picked else PLAIN
        if sensor.kind == "camera_links":
            return scene.add_camera_frustum(
                name,
                fov=FOVY,
                aspect=ASPECT,
                scale=self._length,
                color=color,
                thickness=0.02 * self._length,
                variant="filled",
                cast_shadow=False,
                receive_shadow=False,
                **_at(pose @ TO_OPTICAL),
            )
        if sensor.kind == "lidar_links":
            angles = np.linspace(0.0, 2.0 * math.pi, RINGS + 1)
            ring = (
                0.6 * self._length * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
            )
            lines = np.stack([ring[:-1], ring[1:]], axis=1)
            return scene.add_line_segments(
                name, points=lines, colors=color, thickness=0.05 * self._length, **_at(pose)
            )
        return scene.add_frame(
            name,
            axes_length=0.6 * self._length,
            axes_radius=0.03 * self._length,
            origin_color=color,
            **_at(pose),
        )

    def picture(self, sensor: SensorPose, width: int, height: int, kind: str) -> NDArray[np.uint8] | None:
        """Return the current (height, width, 3) uint8 picture of a camera; None: its link does not exist.

        `kind` is "colour", "depth" or "segmentation".
        """
        from roboyard.sensors import CameraSensor
        from roboyard.viewer.inspector.panels.camera_panel import shown_as

        name, pose = self._edits.place_of(sensor)
        if not any(link.name == name for link in self._body.links):
            return None
        camera = CameraSensor(
            self._body.link(name),
            position=pose[:3, 3],
            orientation=quaternion_from_matrix(pose[:3, :3]),
            width=width,
            height=height,
        )
        return shown_as(camera.image(), kind)

    def scan(self, sensor: SensorPose) -> None:
        """Show the current hits of a lidar; nothing if its link does not exist.

        The pattern is that of imports; hits on the robot itself are shown from 5 cm on.
        """
        from roboyard.sensors import IMPORTED_PATTERN, Lidar

        name, pose = self._edits.place_of(sensor)
        if not any(link.name == name for link in self._body.links):
            self.scans.clear()
            return
        lidar = Lidar(
            self._body.link(name),
            position=pose[:3, 3],
            orientation=quaternion_from_matrix(pose[:3, :3]),
            pattern=replace(IMPORTED_PATTERN, min_range=NEAREST),
            sees_itself=True,
        )
        self.scans.show([lidar])


def world_pose(body: Body, edits: EditState, sensor: SensorPose) -> Array | None:
    """Return the (4, 4) pose of a sensor in the world frame (m); None: its link does not exist."""
    name, pose = edits.place_of(sensor)
    link = next((link for link in body.links if link.name == name), None)
    if link is None:
        return None
    position, quaternion = link.pose
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = matrix_from_quaternion(quaternion), position
    return whole @ pose


def _at(pose: Array) -> dict[str, Array]:
    return {"position": pose[:3, 3].copy(), "wxyz": to_wxyz(quaternion_from_matrix(pose[:3, :3]))}
