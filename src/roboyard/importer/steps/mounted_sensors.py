"""Mount the cameras and lidars that the description implies, where the configuration states none there."""

from __future__ import annotations

from dataclasses import replace

from roboyard.description.model import Pose
from roboyard.description.robot_model import RobotModel, Sensor
from roboyard.description.semantic import MountedSensor
from roboyard.importer.context import ImportContext
from roboyard.importer.steps.sensors import PRIM_NAMES
from roboyard.morphology.sensors.views import camera_view


def mount_sensors(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with a sensor for each camera and lidar that was found; IMUs need none."""
    links = robot.description.link_by_name
    taken = {(sensor.kind, sensor.link) for sensor in robot.sensors}
    added = []
    for sensor in robot.semantic.sensors:
        if sensor.kind == "imu":
            continue
        on = sensor.optical_link if sensor.optical_link in links else sensor.link
        known = {(sensor.kind, link) for link in (sensor.link, sensor.optical_link, on)}
        if on is None or on not in links or known & taken:
            continue
        added.append(
            Sensor(
                kind=sensor.kind,
                link=on,
                offset=_offset(sensor, robot),
                name=PRIM_NAMES[sensor.kind],
            )
        )
        taken.add((sensor.kind, on))
    if added:
        text = ", ".join(f"{sensor.kind} on {sensor.link!r}" for sensor in added)
        context.log.note(f"sensors mounted: {text}; camera_links and lidar_links state others")
    return replace(robot, sensors=(*robot.sensors, *added))


def _offset(sensor: MountedSensor, robot: RobotModel) -> Pose:
    """Return the pose of a sensor in the frame of the link that carries it."""
    turned = {name for arm in robot.semantic.arms for name in arm.joints}
    view = camera_view(sensor, robot.description, turned) if sensor.kind == "camera" else sensor.frame
    return view or Pose()
