"""Episodes of a robot in a full world, driven by keys, plans or skills, as a dataset."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from roboyard.envs.datasets.writer import DatasetWriter
from roboyard.errors import ConfigError
from roboyard.rendering import Camera
from roboyard.robots.robot import Robot
from roboyard.sensors import CameraSensor

ROOT = ("root.x", "root.y", "root.z", "root.qx", "root.qy", "root.qz", "root.qw")
"""Names of a free root link's pose."""


class RobotRecorder:
    """Records a robot at work; call it after each control step, as `Skills(robot, watch=recorder)` does.

    `observation.state` has the positions of all joints before the step (rad or m), and where the root link
    moves freely its position (m) and quaternion x, y, z, w in the world frame; `action` has the commands of
    the drives in it: a position, velocity or effort, as their controllers have it. A context manager.
    """

    def __init__(
        self,
        folder: Path | str,
        robot: Robot,
        *,
        text: str,
        cameras: Mapping[str, Camera] | None = None,
        every: int = 1,
        source: Mapping[str, Any] | None = None,
    ) -> None:
        """Begin a dataset, and its first episode.

        Args:
            folder: to write; it must not exist.
            robot: in a world.
            text: what the episodes show, in words.
            cameras: fixed cameras by name; those of the robot, by their links, where not given. {} for none.
            every: control steps for each row.
            source: kept in `meta/roboyard.json`, such as the set-up of the scene.

        Raises:
            ConfigError: the folder exists, or the rate of rows is no whole number.
        """
        if every < 1:
            raise ConfigError(f"every must be at least 1 control step, got {every}")
        self._robot, self._text, self._every = robot, text, every
        self._cameras = cameras
        self._sensors: list[CameraSensor] = []
        if cameras is None:
            found = [robot.sensors[name] for name in robot.sensors.names]
            self._sensors = [sensor for sensor in found if isinstance(sensor, CameraSensor)]
        names = list(robot.joint_names)
        self.writer = DatasetWriter(
            folder,
            fps=robot.control_freq / every,
            robot=robot.model,
            source=source,
            names={"observation.state": names if robot.body.is_fixed else [*names, *ROOT], "action": names},
        )
        """Writes the files."""
        self._steps = 0
        self._begin()

    def _begin(self) -> None:
        """Keep what is seen before the next step."""
        self._time = self._robot.world.time
        robot, world = self._robot, self._robot.world
        parts = [robot.joint_positions, *(() if robot.body.is_fixed else robot.links[0].pose)]
        self._state = np.concatenate(parts)
        self._pictures = {name: world.render(camera).rgb for name, camera in (self._cameras or {}).items()}
        self._pictures |= {sensor.link.name: sensor.image().rgb for sensor in self._sensors}
        self._waiting = 0

    def __call__(self) -> None:
        """Add the control step that has just been made; an episode ends where time went back."""
        if self._robot.world.time < self._time:  # an earlier state was restored
            self.end_episode()
            return
        self._waiting += 1
        if self._waiting < self._every:
            return
        self.writer.add(self._state, self._robot.loop.commands, 0.0, pictures=self._pictures)
        self._steps += 1
        self._begin()

    def end_episode(self, *, success: bool = False, text: str | None = None) -> None:
        """End the present episode, and begin another; nothing happens where it has no step.

        Args:
            success: whether its goal was reached.
            text: what it shows; as given at the start by default.
        """
        if self._steps:
            self.writer.finish_last(success=success)
            self.writer.end_episode(self._text if text is None else text)
        self._steps = 0
        self._begin()

    def close(self) -> None:
        """End the present episode and write the dataset."""
        self.end_episode()
        self.writer.close()

    def __enter__(self) -> RobotRecorder:
        """Return the recorder."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish the dataset; after an error nothing is left of it."""
        if kind is None:
            self.close()
        else:
            self.writer.__exit__(kind, error, trace)
