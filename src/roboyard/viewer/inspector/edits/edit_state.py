"""Edits of the page: poses of sensors and end effectors, planning spheres, disabled collision pairs."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from roboyard.errors import ConfigError
from roboyard.transforms import Array, pose_matrix

if TYPE_CHECKING:
    from roboyard.viewer.inspector.robot_source import RobotSource

SensorKind = Literal["camera_links", "lidar_links", "eef_vis_links"]
KINDS: Mapping[SensorKind, str] = {
    "camera_links": "camera",
    "lidar_links": "lidar",
    "eef_vis_links": "end effector",
}
"""Key of the import configuration to its name on the page."""
Pair = tuple[str, str]
"""Two links in alphabetical order."""


@dataclass(kw_only=True, slots=True)
class SensorPose:
    """A camera, a lidar or the frame of an end effector."""

    kind: SensorKind
    link: str
    parent: str | None = None
    """Link to which the import adds `link` at the offset; None: the offset is in the frame of `link`."""
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Position (m)."""
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """Orientation x, y, z, w; the viewing direction of cameras is -z, +y is up."""

    @property
    def pose(self) -> Array:
        """(4, 4) offset (m)."""
        return pose_matrix(self.position, self.quaternion)


@dataclass(kw_only=True, slots=True)
class EditedSphere:
    """A planning sphere in its link frame (m)."""

    center: tuple[float, float, float]
    radius: float


@dataclass(kw_only=True, slots=True)
class EditState:
    """The current state of all edits."""

    sensors: list[SensorPose] = field(default_factory=list)
    spheres: dict[str, list[EditedSphere]] = field(default_factory=dict)
    """Link name to its planning spheres."""
    planner_pairs: set[Pair] = field(default_factory=set)
    """Pairs that the planner does not check (`self_collision_ignore`)."""
    physics_pairs: set[Pair] = field(default_factory=set)
    """Pairs that do not collide in the simulation (`disabled_collision_pairs`)."""
    bare_links: tuple[str, ...] = ()
    """Links without collision shapes; read, not edited."""

    def copy(self) -> EditState:
        """Return an independent copy."""
        return copy.deepcopy(self)

    def place_of(self, sensor: SensorPose) -> tuple[str, Array]:
        """Return a link of the robot and the (4, 4) pose of a sensor in its frame (m)."""
        name, pose = (sensor.link if sensor.parent is None else sensor.parent), sensor.pose
        makers = {one.link: one for one in self.sensors if one.parent is not None}
        for _ in range(len(makers)):
            maker = makers.get(name)
            if maker is None or maker is sensor:
                break
            assert maker.parent is not None
            name, pose = maker.parent, maker.pose @ pose
        return name, pose


def pair(a: str, b: str) -> Pair:
    """Return two links as a pair in alphabetical order."""
    return (a, b) if a <= b else (b, a)


def read_edit_state(source: RobotSource) -> EditState:
    """Read the edits from a robot's package, or else from its import configuration.

    Raises:
        ConfigError: a file is invalid.
    """
    edits = EditState()
    config = _checked(source.config) if source.config is not None else None
    if config is not None:
        edits.sensors = [
            SensorPose(
                kind=kind,
                link=entry.link,
                parent=entry.parent_link,
                position=entry.offset.position,
                quaternion=entry.offset.orientation,
            )
            for kind in KINDS
            for entry in getattr(config, kind)
        ]
        edits.spheres = {
            link: [EditedSphere(center=sphere.center, radius=sphere.radius) for sphere in spheres]
            for link, spheres in config.curobo.collision_spheres.items()
        }
        edits.bare_links = tuple(config.collision.no_collision_links)
        ignored = config.curobo.self_collision_ignore
        edits.planner_pairs = {pair(a, b) for a, others in ignored.items() for b in others}
    elif source.cameras is not None:
        edits.sensors = _cameras(source.cameras)
    if source.planner_file is not None:
        _read_planner(source.planner_file, edits)
    if source.definition is not None:
        from roboyard.robots.definition.load import load_definition

        pairs = load_definition(source.definition).disabled_collision_pairs or ()
        edits.physics_pairs = {pair(a, b) for a, b in pairs}
    return edits


def _checked(file: Path) -> Any:
    from roboyard.importer.config.load import load_config

    return load_config(file).config


def _cameras(mjcf: Path) -> list[SensorPose]:
    from roboyard.robots.sensor_frames import camera_frames

    return [
        SensorPose(
            kind="camera_links",
            link=camera.link,
            position=_three(camera.position),
            quaternion=(*(float(v) for v in camera.quaternion),),  # type: ignore[arg-type]
        )
        for camera in camera_frames(mjcf)
    ]


def _read_planner(file: Path, edits: EditState) -> None:
    from roboyard.config.yaml_lines import read_yaml
    from roboyard.viewer.inspector.edits.planner_spheres import read_spheres

    edits.spheres = {
        link: [
            EditedSphere(center=_three(c), radius=float(r))
            for c, r in zip(some.centers, some.radii, strict=True)
        ]
        for link, some in read_spheres(file).items()
    }
    for table in ignore_tables(read_yaml(file).data):
        try:
            edits.planner_pairs = {pair(str(a), str(b)) for a, others in table.items() for b in others or ()}
        except TypeError as error:
            raise ConfigError(f"{file.name}: self_collision_ignore: each link has a list of links") from error


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in np.asarray(values, dtype=float))
    return x, y, z


def _planner_blocks(data: Any) -> list[dict[str, Any]]:
    """Return the mappings of a planner file that describe the links."""
    robot = data.get("robot_cfg") if isinstance(data, dict) else None
    blocks = [robot, robot.get("kinematics")] if isinstance(robot, dict) else []
    return [block for block in blocks if isinstance(block, dict)]


def sphere_tables(data: Any) -> list[dict[str, Any]]:
    """Return each mapping of link name to spheres in a planner file (cuRobo's layouts, XRDF), editable."""
    found = [block.get("collision_spheres") for block in _planner_blocks(data)]
    geometry = data.get("geometry") if isinstance(data, dict) else None
    if isinstance(geometry, dict):
        found += [shape.get("spheres") for shape in geometry.values() if isinstance(shape, dict)]
    return [table for table in found if isinstance(table, dict)]


def ignore_tables(data: Any) -> list[dict[str, Any]]:
    """Return each mapping of link name to links not checked against it, editable."""
    found = [block.get("self_collision_ignore") for block in _planner_blocks(data)]
    own = data.get("self_collision") if isinstance(data, dict) else None
    found += [own.get("ignore")] if isinstance(own, dict) else []
    return [table for table in found if isinstance(table, dict)]
