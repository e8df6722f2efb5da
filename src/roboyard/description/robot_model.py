"""A robot with everything that an import computes and the writers translate.

Import steps are functions `(RobotModel, context) -> RobotModel`; the data is never changed in place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from roboyard.description.model import Collision, Pose, Quaternion, RobotDescription
from roboyard.description.semantic import SemanticDescription

ORIGIN = Pose()
SensorKind = Literal["camera", "lidar", "visual_sphere"]
DriveKind = Literal["none", "effort", "velocity", "position"]
Approximation = Literal["convexHull", "boundingSphere", "boundingCube", "convexDecomposition", "none"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Sensor:
    """A camera, lidar or marker fixed to a link."""

    kind: SensorKind
    link: str
    offset: Pose = ORIGIN
    """Pose of the sensor in the link's frame; cameras look along -z with +y up."""
    name: str = ""
    """Prim name (Camera, Lidar, VisualSphere)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CollisionSphere:
    """One sphere of the planner's robot, in its link's frame."""

    center: tuple[float, float, float]
    """m"""
    radius: float
    """m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class PlanningData:
    """Data for a motion planner beside the description. Joint values always come with their names."""

    spheres: Mapping[str, tuple[CollisionSphere, ...]]
    """Link name to its spheres, in file order of the config (or of the links)."""
    ignore: Mapping[str, tuple[str, ...]]
    """Link name to links it may touch; one direction suffices."""
    self_collision_buffer: Mapping[str, float] = field(default_factory=dict)
    """Link name to extra padding (m)."""
    lock_joints: Mapping[str, float] = field(default_factory=dict)
    """Joint name to the position it is locked at (rad or m)."""
    flip_joint_limits: tuple[str, ...] = ()
    """Joints whose limits cuRobo has to swap."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Metadata:
    """Size of the robot with all joints at zero, in the base link's frame."""

    bbox_size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Extents of the axis-aligned box around all visual shapes (m)."""
    base_link_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of that box (m)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotModel:
    """A robot's description, its semantics and its planning data."""

    name: str
    """USD identifier, lower case."""
    description: RobotDescription
    semantic: SemanticDescription
    category: str = "robot"
    sensors: tuple[Sensor, ...] = ()
    drives: Mapping[str, DriveKind] = field(default_factory=dict)
    """Joint name to its kind of drive; joints not listed are not driven."""
    approximations: Mapping[str, Approximation] = field(default_factory=dict)
    """Link name to the USD approximation of its collision meshes; convexHull where not listed."""
    planning: PlanningData | None = None
    metadata: Metadata = Metadata()
    solids: Mapping[str, tuple[Collision, ...]] = field(default_factory=dict)
    """Link name to the shapes nearest to its real form (the vendor's collision shapes, else the visual ones),
    before hulls were made of them; spheres are fitted to these.
    """
    root_turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """Rotation (x, y, z, w) from the root link's frame of the file to that of `description`, where an import
    turned it upright.
    """
    original_names: Mapping[str, str] = field(default_factory=dict)
    """New name to the vendor's name, where they differ."""
