"""Pictures and scans of n environments, from the cameras and lidars of the robot.

Pictures are drawn by the software renderer on threads: its compiled loops run on all cores at once. Each
environment's picture is the same at any number of threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium import spaces

from roboyard.envs.pictures.appearance import VIEW
from roboyard.envs.runner import Runner
from roboyard.errors import ConfigError
from roboyard.rendering import Camera, Image, render
from roboyard.robots.robot import Robot
from roboyard.sensors import CameraSensor, Lidar
from roboyard.transforms import Array

VIEW_SIZE = (128, 96)
"""Width and height of the task's own view (pixels)."""
_BOUNDS: dict[str, tuple[float, float, Any]] = {
    "rgb": (0, 255, np.uint8),
    "depth": (0.0, np.inf, np.float32),
    "seg": (-1, np.iinfo(np.int32).max, np.int32),
    "scan": (0.0, np.inf, np.float32),
}


class PictureArrays:
    """Takes the pictures and scans of all environments."""

    def __init__(self, runner: Runner, modalities: Sequence[str], *, threads: int = 0) -> None:
        """Find the robot's cameras and lidars that have these modalities.

        Args:
            runner: of the environments.
            modalities: "rgb", "depth", "seg", "scan".
            threads: of the processor; 0 for all that this process may use.

        Raises:
            ConfigError: the robot has no lidar, and "scan" is asked for.
        """
        self._runner, self._looks = runner, runner.env.appearance
        robot = next(body for body in runner.bodies.values() if isinstance(body, Robot))
        sensors = [robot.sensors[name] for name in robot.sensors.names]
        self._lidars = [s for s in sensors if isinstance(s, Lidar)] if "scan" in modalities else []
        if "scan" in modalities and not self._lidars:
            raise ConfigError(f"obs_modalities: robot {robot.name!r} has no lidar for 'scan'")
        seen = tuple(name for name in modalities if name != "scan")
        self._cameras: list[_RobotCamera | _View] = []
        if seen:
            cameras = [s for s in sensors if isinstance(s, CameraSensor)]
            self._cameras = [_RobotCamera(runner, s, seen) for s in cameras] or [_View(runner, seen)]
        self._threads = min(threads or usable_cores(), runner.count)
        self._position, self._rotation = runner.physics.field("xpos"), runner.physics.field("xmat")
        self._scene = runner.world.render_scene()
        self._first = {**self._pictures_of(0), **self._scans_of(0)}

    def spaces(self) -> dict[str, spaces.Box]:
        """Return "link/modality" to its space for one environment."""
        found = {}
        for name, values in self._first.items():
            low, high, dtype = _BOUNDS[name.rsplit("/", 1)[1]]
            found[name] = spaces.Box(low, high, values.shape, dtype=dtype)
        return found

    def take(self) -> dict[str, np.ndarray]:
        """Return "link/modality" to the (n, ...) pictures and scans of the present states."""
        found = {
            name: np.empty((self._runner.count, *one.shape), dtype=one.dtype)
            for name, one in self._first.items()
        }
        if self._cameras:
            parts = [range(k, self._runner.count, self._threads) for k in range(self._threads)]
            if self._threads == 1:
                self._draw(parts[0], found)
            else:
                for done in [self._pool.submit(self._draw, part, found) for part in parts]:
                    done.result()
        if self._lidars:
            for row in range(self._runner.count):
                for name, values in self._scans_of(row).items():
                    found[name][row] = values
        return found

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self._threads, thread_name_prefix="pictures")

    def close(self) -> None:
        """Stop the threads."""
        if "_pool" in self.__dict__:
            self._pool.shutdown()
            del self._pool

    def _draw(self, rows: Sequence[int], found: dict[str, np.ndarray]) -> None:
        for row in rows:
            for name, values in self._pictures_of(row).items():
                found[name][row] = values

    def _pictures_of(self, row: int) -> dict[str, np.ndarray]:
        looks, found = self._looks, {}
        position, rotation = self._position[row], self._rotation[row].reshape(-1, 3, 3)
        for source in self._cameras:
            image = render(
                self._scene,
                position,
                rotation,
                source.camera(row, position, rotation),
                shadow=source.shadow,
                light=looks.light_of(row),
                colors=looks.colors_of(row),
                backend="software",
            )
            for modality, values in source.measured(image).items():
                found[f"{source.name}/{modality}"] = np.ascontiguousarray(values, dtype=_BOUNDS[modality][2])
        return found

    def _scans_of(self, row: int) -> dict[str, np.ndarray]:
        if not self._lidars:
            return {}
        self._runner.show(row)
        return {
            f"{lidar.link.name}/scan": np.ascontiguousarray(lidar.observe()["scan"], dtype=np.float32)
            for lidar in self._lidars
        }


class _RobotCamera:
    """A camera of the robot."""

    def __init__(self, runner: Runner, sensor: CameraSensor, modalities: tuple[str, ...]) -> None:
        sensor.outputs = modalities
        self.name, self.shadow = sensor.link.name, sensor.shadow
        self._sensor, self._looks = sensor, runner.env.appearance
        self._row = int(sensor.link.body.mujoco_ids[sensor.link.index])

    def camera(self, row: int, position: Array, rotation: Array) -> Camera:
        """Return the camera of one environment; positions and rotations are those of MuJoCo's bodies."""
        turn, mount = rotation[self._row], self._sensor.mount
        placed = position[self._row] + turn @ mount.position, turn @ mount.rotation
        return self._sensor.camera_at(*self._looks.placed(self.name, row, *placed))

    def measured(self, image: Image) -> dict[str, np.ndarray]:
        """Return the modalities of a picture."""
        return self._sensor.measured(image)


class _View:
    """The task's own view."""

    name, shadow = VIEW, False

    def __init__(self, runner: Runner, modalities: tuple[str, ...]) -> None:
        self._looks, self._modalities = runner.env.appearance, modalities
        eye, target = runner.task.view
        self._own = Camera.look_at(eye, target, width=VIEW_SIZE[0], height=VIEW_SIZE[1])

    def camera(self, row: int, position: Array, rotation: Array) -> Camera:
        """Return the camera of one environment."""
        view = self._own.view
        turn = view[:3, :3].T
        placed, turned = self._looks.placed(VIEW, row, -turn @ view[:3, 3], turn)
        if turned is turn:
            return self._own
        moved = np.eye(4)
        moved[:3, :3], moved[:3, 3] = turned.T, -turned.T @ placed
        return Camera(*VIEW_SIZE, moved, self._own.projection)

    def measured(self, image: Image) -> dict[str, np.ndarray]:
        """Return the modalities of a picture."""
        made = {"rgb": image.rgb, "depth": image.depth, "seg": image.segmentation}
        return {name: made[name] for name in self._modalities}


def usable_cores() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
