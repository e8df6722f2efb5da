"""The cameras and lidars of an imported robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from roboyard.errors import ConfigError, unknown_name
from roboyard.robots.sensor_frames import SensorFrame, camera_frames, lidar_frames

if TYPE_CHECKING:
    from roboyard.robots.robot_body import RobotBody
    from roboyard.sensors import Sensor, Sensors

CAMERA_RATE, LIDAR_RATE = 30.0, 10.0
"""Default rates (Hz)."""
KINDS = ("Camera", "Lidar")
"""Kinds of sensors that options may name."""
SensorOptions = Mapping[str, Mapping[str, Any]]
"""Kind ("Camera", "Lidar") or link to keywords of `roboyard.sensors.CameraSensor` or `Lidar`."""


ObsModalities = Literal["all"] | Sequence[str]
"""Modalities of an observation, or "all"."""
_OTHER_NAMES = {
    "depth_linear": "depth",
    "seg_instance": "seg",
    "seg_instance_id": "seg",
    "scan_rear": "scan",
}
"""OmniGibson's names for modalities that are one here."""


def checked_modalities(given: ObsModalities) -> Literal["all"] | frozenset[str]:
    """Return modalities by their names here.

    Raises:
        ConfigError: one of them is unknown.
    """
    from roboyard.sensors import CameraSensor, Lidar

    if given == "all":
        return "all"
    names = [given] if isinstance(given, str) else list(given)
    known = dict.fromkeys((*CameraSensor.modalities, *Lidar.modalities, "proprio"))
    plain = [_OTHER_NAMES.get(name, name) for name in names]
    for name in plain:
        if name not in known:
            raise ConfigError(f"obs_modalities: {unknown_name('modality', str(name), known)}")
    return frozenset(plain)


def make_sensors(
    robot: RobotBody,
    file: Path | None,
    options: SensorOptions,
    modalities: Literal["all"] | frozenset[str] = "all",
) -> Sensors:
    """Create the cameras and lidars of an imported robot, on its links.

    Names are "<robot>:<link>:<kind>:<count>". Cameras observe "rgb", "depth", "seg" and "points" 30 times a
    second, lidars "scan", "seg" and "points" 10 times a second. Keywords for a link override those for its
    kind.

    Args:
        robot: whose links have the sensors.
        file: MJCF of the import; None for a robot without.
        options: keywords by kind or link.
        modalities: outputs of cameras and lidars; sensors without any of them are omitted.

    Raises:
        ConfigError: an option names no kind and no link with a sensor, or an unknown keyword.
    """
    from roboyard.sensors import CameraSensor, Lidar, Sensors

    frames: list[tuple[str, type[Sensor], SensorFrame, dict[str, Any]]] = []
    if file is not None:
        seen = [name for name in CameraSensor.modalities if modalities == "all" or name in modalities]
        camera = {"rate": CAMERA_RATE, "outputs": tuple(seen)}
        frames += [("Camera", CameraSensor, frame, camera) for frame in camera_frames(file) if seen]
        swept = modalities == "all" or not modalities.isdisjoint(Lidar.modalities)
        frames += [("Lidar", Lidar, frame, {"rate": LIDAR_RATE}) for frame in lidar_frames(file) if swept]
    known = {link.name for link in robot.links}
    frames = [entry for entry in frames if entry[2].link in known]
    named = [*KINDS, *dict.fromkeys(frame.link for _, _, frame, _ in frames)]
    for key in options:
        if key not in named:
            raise ConfigError(f"sensor_options: {unknown_name('kind or link of a sensor', str(key), named)}")
    sensors = Sensors(robot.world)
    for kind, make, frame, defaults in frames:
        keywords = {**defaults, **options.get(kind, {}), **options.get(frame.link, {})}
        pose = {"position": robot.body.scale * frame.position, "orientation": frame.quaternion}
        try:
            sensors.add(make(robot.link(frame.link), **{**pose, **keywords}))
        except TypeError as error:
            raise ConfigError(
                f"sensor_options: {kind} on {frame.link!r}: {str(error).split('() ')[-1]}"
            ) from None
    return sensors


class SensorSet:
    """The sensors of a robot, a part of `Robot`."""

    _sensor_file: Path | None = None
    _sensors: Sensors | None = None
    obs_modalities: Literal["all"] | frozenset[str] = "all"
    """Modalities that `observe` returns."""

    def mount_sensors(
        self: Any, file: Path | None, options: SensorOptions, modalities: ObsModalities = "all"
    ) -> None:
        """Set the file that names the sensors. They are created at their first use, or now with options.

        Raises:
            ConfigError: an option names no kind and no link with a sensor, or an unknown keyword; a modality
                is unknown.
        """
        self._sensor_file = file
        self.obs_modalities = checked_modalities(modalities)
        if options:
            self._sensors = make_sensors(self, file, options, self.obs_modalities)

    @property
    def sensors(self: Any) -> Sensors:
        """Cameras and lidars of the import by name ("r1:eyes:Camera:0"), and sensors that are added here."""
        if self._sensors is None:
            self._sensors = make_sensors(self, self._sensor_file, {}, self.obs_modalities)
        return self._sensors
