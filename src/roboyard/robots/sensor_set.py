"""The sensors that a robot was imported with, and what they observe."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.sensor_frames import SensorFrame, camera_frames, lidar_frames

if TYPE_CHECKING:
    from roboyard.robots.robot import Robot
    from roboyard.sensors import Sensor, Sensors

CAMERA_RATE, LIDAR_RATE = 30.0, 10.0
"""Hz, where nobody says another."""
KINDS = ("Camera", "Lidar")
SensorOptions = Mapping[str, Mapping[str, Any]]
"""Kind ("Camera", "Lidar") or link to keywords of `roboyard.sensors.CameraSensor` or `Lidar`."""


def mount_sensors(robot: Robot, file: Path | None, options: SensorOptions) -> Sensors:
    """Cameras and lidars of an import's MJCF, on the robot's links.

    Names are "<robot>:<link>:<kind>:<count>". Cameras give "rgb", "depth", "seg" and "points" 30 times a
    second, lidars "scan", "seg" and "points" 10 times a second. Keywords for a link go before those for its
    kind.

    Raises:
        ConfigError: options name no kind and no link with a sensor, or keywords that the sensor has not.
    """
    from roboyard.sensors import CameraSensor, Lidar, Sensors

    frames: list[tuple[str, type[Sensor], SensorFrame, dict[str, Any]]] = []
    if file is not None:
        camera = {"rate": CAMERA_RATE, "wants": CameraSensor.modalities}
        frames += [("Camera", CameraSensor, frame, camera) for frame in camera_frames(file)]
        frames += [("Lidar", Lidar, frame, {"rate": LIDAR_RATE}) for frame in lidar_frames(file)]
    known = {link.name for link in robot.body.links}
    frames = [entry for entry in frames if entry[2].link in known]
    named = [*KINDS, *dict.fromkeys(frame.link for _, _, frame, _ in frames)]
    for key in options:
        if key not in named:
            raise ConfigError(f"sensor_options: {unknown_name('kind or link of a sensor', str(key), named)}")
    sensors = Sensors(robot.world)
    for kind, make, frame, defaults in frames:
        keywords = {**defaults, **options.get(kind, {}), **options.get(frame.link, {})}
        place = {"position": robot.body.scale * frame.position, "orientation": frame.quaternion}
        try:
            sensors.add(make(robot.body.link(frame.link), **{**place, **keywords}))
        except TypeError as error:
            raise ConfigError(
                f"sensor_options: {kind} on {frame.link!r}: {str(error).split('() ')[-1]}"
            ) from None
    return sensors


class SensorSet:
    """What a robot senses, a part of `Robot`."""

    _sensor_file: Path | None = None
    _sensors: Sensors | None = None

    def have_senses(self: Any, file: Path | None, options: SensorOptions) -> None:
        """Say where the sensors are written down; they are mounted when first asked for, or, with options,
        at once. Raises as `mount_sensors`.
        """
        self._sensor_file = file
        if options:
            self._sensors = mount_sensors(self, file, options)

    @property
    def sensors(self: Any) -> Sensors:
        """Cameras and lidars that the robot was imported with, by name ("r1:eyes:Camera:0"), and any that
        are added here.
        """
        if self._sensors is None:
            self._sensors = mount_sensors(self, self._sensor_file, {})
        return self._sensors

    def get_obs(self: Any, *, fresh: bool = False) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """What the robot senses: observations by sensor and modality, and who is who in them.

        Sensors look at their own rates: those that are due look again, the others repeat their last.

        Args:
            fresh: all look again.

        Returns:
            sensor name to modality to array, and "proprio" (as `get_proprioception`); sensor name to "seg"
            to (body id, link index) to "body/link".
        """
        from roboyard.sensors import link_names

        latest = self.sensors.observe(fresh=fresh)
        observations: dict[str, Any] = {name: dict(seen) for name, seen in latest.items()}
        observations["proprio"] = self.get_proprioception()[0]
        info = {
            name: {"seg": link_names(self.world, seen["seg"])}
            for name, seen in latest.items()
            if "seg" in seen
        }
        return observations, info
