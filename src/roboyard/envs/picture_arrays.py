"""Pictures and scans of n environments, from the cameras and lidars of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from roboyard.envs.runner import Runner
from roboyard.errors import ConfigError
from roboyard.rendering import Camera
from roboyard.robots.robot import Robot
from roboyard.sensors import CameraSensor, Lidar

VIEW = "view"
"""Name of the task's own camera, which a robot without cameras observes with."""
VIEW_SIZE = (128, 96)
"""Its width and height (pixels)."""
_BOUNDS: dict[str, tuple[float, float, Any]] = {
    "rgb": (0, 255, np.uint8),
    "depth": (0.0, np.inf, np.float32),
    "seg": (-1, np.iinfo(np.int32).max, np.int32),
    "scan": (0.0, np.inf, np.float32),
}


class PictureArrays:
    """Takes the pictures of all environments, one after another."""

    def __init__(self, runner: Runner, modalities: Sequence[str]) -> None:
        """Find the robot's cameras and lidars that have these modalities.

        Raises:
            ConfigError: the robot has no lidar, and "scan" is asked for.
        """
        self._runner = runner
        robot = next(body for body in runner.bodies.values() if isinstance(body, Robot))
        sensors = [robot.sensors[name] for name in robot.sensors.names]
        cameras = [s for s in sensors if isinstance(s, CameraSensor)]
        lidars = [s for s in sensors if isinstance(s, Lidar)]
        self._wanted: list[tuple[str, Any]] = []
        seen = [name for name in modalities if name != "scan"]
        for camera in cameras:
            camera.outputs = tuple(seen)
        if seen:
            sources: list[tuple[str, Any]] = [(camera.link.name, camera) for camera in cameras]
            self._wanted += sources or [(VIEW, None)]
        if "scan" in modalities:
            if not lidars:
                raise ConfigError(f"obs_modalities: robot {robot.name!r} has no lidar for 'scan'")
            self._wanted += [(lidar.link.name, lidar) for lidar in lidars]
        self._modalities = tuple(modalities)
        self._first = self._of_row(0)

    def spaces(self) -> dict[str, spaces.Box]:
        """Return "link/modality" to its space for one environment."""
        found = {}
        for name, values in self._first.items():
            low, high, dtype = _BOUNDS[name.rsplit("/", 1)[1]]
            found[name] = spaces.Box(low, high, values.shape, dtype=dtype)
        return found

    def take(self) -> dict[str, np.ndarray]:
        """Return "link/modality" to the (n, ...) pictures of the present states."""
        rows = [self._of_row(row) for row in range(self._runner.count)]
        return {name: np.stack([one[name] for one in rows]) for name in rows[0]}

    def _of_row(self, row: int) -> dict[str, np.ndarray]:
        world = self._runner.show(row)
        found: dict[str, np.ndarray] = {}
        for name, sensor in self._wanted:
            if sensor is None:
                eye, target = self._runner.task.view
                image = world.render(
                    Camera.look_at(eye, target, width=VIEW_SIZE[0], height=VIEW_SIZE[1]), shadow=False
                )
                observed = {"rgb": image.rgb, "depth": image.depth, "seg": image.segmentation}
            else:
                observed = sensor.observe()
            for modality in self._modalities:
                if modality in observed:
                    dtype = _BOUNDS[modality][2]
                    found[f"{name}/{modality}"] = np.ascontiguousarray(observed[modality], dtype=dtype)
        return found
