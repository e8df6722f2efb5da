"""Statements of a robot's files that are no links and joints, as plain data; names may be of other robots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from roboyard.description.model import Pose

SensorKind = Literal["camera", "lidar", "imu", "other"]
PluginKind = Literal["differential", "skid", "holonomic", "ackermann", "suction", "mimic", "other"]


@dataclass(frozen=True, kw_only=True, slots=True)
class StatedSensor:
    """A `<sensor>` element, of a `<gazebo>` block or of the robot itself."""

    kind: SensorKind
    name: str
    link: str
    """Link that carries it."""
    frame_link: str | None = None
    """Link in whose frame its data are, where the file names one."""
    pose: Pose = field(default_factory=Pose)
    """In the frame of the link that carries it."""
    samples: int = 0
    """Rays in one horizontal sweep (lidars); 0 where none are stated."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Plugin:
    """A simulator's plugin, with the joints and links that its text names."""

    kind: PluginKind
    filename: str
    words: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Tag to the texts of its elements: `left_joint` to names of joints, and so on."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Follower:
    """position of `joint` = multiplier · position of `leader` + offset, stated outside `<mimic>`."""

    joint: str
    leader: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True, slots=True)
class SrdfGroup:
    """A group with all its joints, those of chains and of inner groups included."""

    name: str
    joints: tuple[str, ...] = ()
    """In file order; the joints of a chain are resolved by the robot's tree."""
    links: tuple[str, ...] = ()
    """Links that the group names, not those of its joints."""
    tips: tuple[str, ...] = ()
    """Last links of its chains."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SrdfEndEffector:
    """An `<end_effector>`."""

    name: str
    parent_link: str
    group: str
    parent_group: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class Srdf:
    """A semantic description in MoveIt's format."""

    file: Path | None
    robot: str
    """Name of the robot that it is for."""
    groups: tuple[SrdfGroup, ...] = ()
    end_effectors: tuple[SrdfEndEffector, ...] = ()
    passive_joints: tuple[str, ...] = ()
    states: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Name to joint positions (rad or m); where several groups have a state of one name, all its joints."""
    disabled_pairs: tuple[tuple[str, str], ...] = ()
    """Links whose collisions are ignored, each pair sorted, once."""
    virtual_joint_type: str | None = None
    """`fixed`, `planar` or `floating`: how the root moves in the world."""

    def group(self, name: str) -> SrdfGroup | None:
        """Return a group by its name; None where there is none."""
        return next((group for group in self.groups if group.name == name), None)


@dataclass(frozen=True, kw_only=True, slots=True)
class FileEvidence:
    """All statements of a robot's files."""

    sensors: tuple[StatedSensor, ...] = ()
    plugins: tuple[Plugin, ...] = ()
    actuated: tuple[str, ...] = ()
    """Joints with a transmission or a command interface, in file order; empty where the files name none."""
    followers: tuple[Follower, ...] = ()
    srdf: Srdf | None = None
