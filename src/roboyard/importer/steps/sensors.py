"""Add visual spheres, cameras and lidars, in that order, to links that exist or to new ones.

With `parent_link` the link is new: a fixed joint at the offset connects it to the parent, and the sensor is
at its origin. Without, the link exists already (possibly made for an earlier sensor), and the offset is that
of the sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from roboyard.description.model import Joint, Link, Pose
from roboyard.description.robot_model import RobotModel, Sensor, SensorKind
from roboyard.errors import ConfigError
from roboyard.importer.config.schema import Offset, SensorLink
from roboyard.importer.context import ImportContext

PRIM_NAMES: dict[SensorKind, str] = {"visual_sphere": "VisualSphere", "camera": "Camera", "lidar": "Lidar"}


def add_sensors(robot: RobotModel, context: ImportContext) -> RobotModel:
    """Return the robot with the configured sensors."""
    config = context.config
    groups: tuple[tuple[SensorKind, Sequence[SensorLink]], ...] = (
        ("visual_sphere", config.eef_vis_links),
        ("camera", config.camera_links),
        ("lidar", config.lidar_links),
    )
    for kind, entries in groups:
        for entry in entries:
            robot = with_sensor(robot, kind, entry, context)
    return robot


def with_sensor(robot: RobotModel, kind: SensorKind, entry: SensorLink, context: ImportContext) -> RobotModel:
    """Return the robot with one more sensor.

    Raises:
        ConfigError: the link exists and should not, or does not and should.
    """
    description = robot.description
    offset = pose_of_offset(entry.offset)
    if entry.parent_link is None:
        if entry.link not in description.link_by_name:
            raise ConfigError(f"{kind} on {entry.link!r}: there is no such link; add parent_link")
        sensor = Sensor(kind=kind, link=entry.link, offset=offset, name=PRIM_NAMES[kind])
        context.log.note(f"{kind} added", f'link "{entry.link}"')
        return replace(robot, sensors=(*robot.sensors, sensor))
    if entry.link in description.link_by_name or entry.parent_link not in description.link_by_name:
        raise ConfigError(
            f"{kind} on {entry.link!r} below {entry.parent_link!r}: the parent must exist, the link must not"
        )
    joint = Joint(
        name=f"{entry.parent_link}_{entry.link}_joint",
        type="fixed",
        parent=entry.parent_link,
        child=entry.link,
        origin=offset,
    )
    context.log.note(f'{kind} added on a new link below "{entry.parent_link}"', f'link "{entry.link}"')
    return replace(
        robot,
        description=replace(
            description,
            links=(*description.links, Link(name=entry.link)),
            joints=(*description.joints, joint),
        ),
        solids={**robot.solids, entry.link: ()},
        sensors=(*robot.sensors, Sensor(kind=kind, link=entry.link, name=PRIM_NAMES[kind])),
    )


def pose_of_offset(offset: Offset) -> Pose:
    """Return the pose of a configuration's offset."""
    return Pose(position=offset.position, quaternion=offset.orientation)
