"""What an import works on and every writer translates: one description and the notes beside it.

Steps are functions `(RobotModel, context) -> RobotModel`; nothing here is ever edited in place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from roboyard.description.model import Collision, Pose, RobotDescription

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
    """Of the sensor in the link's frame; cameras look along -z with +y up."""
    name: str = ""
    """Prim name (Camera, Lidar, VisualSphere)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CollisionSphere:
    """One ball of the planner's robot, in its link's frame."""

    center: tuple[float, float, float]
    """m"""
    radius: float
    """m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class EndEffector:
    """An end-effector link and the gripper that belongs to it."""

    link: str
    gripper_links: tuple[str, ...] = ()
    gripper_joints: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True)
class PlanningData:
    """What a motion planner needs beside the description. Joint values always travel with their names."""

    spheres: Mapping[str, tuple[CollisionSphere, ...]]
    """Link name to its spheres, in file order of the config (or of the links)."""
    end_effectors: tuple[EndEffector, ...]
    """In the config's order."""
    ignore: Mapping[str, tuple[str, ...]]
    """Link name to links it may touch; one direction suffices."""
    self_collision_buffer: Mapping[str, float] = field(default_factory=dict)
    """Link name to extra padding; m"""
    lock_joints: Mapping[str, float] = field(default_factory=dict)
    """Joint name to the position it is kept at; rad or m"""
    retract: Mapping[str, float] = field(default_factory=dict)
    """Joint name to its position in the rest posture; rad or m"""
    torso_joints: tuple[str, ...] = ()
    flip_joint_limits: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True, slots=True)
class Metadata:
    """Size of the robot with all joints at zero, in the base link's frame."""

    bbox_size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Extents of the axis-aligned box around all visual shapes; m"""
    base_link_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Centre of that box; m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotModel:
    """A robot on its way from a vendor's files to a package."""

    name: str
    """USD identifier, lower case."""
    description: RobotDescription
    base_link: str
    """The vendor's root link (below the virtual joints of a holonomic base)."""
    category: str = "robot"
    sensors: tuple[Sensor, ...] = ()
    drives: Mapping[str, DriveKind] = field(default_factory=dict)
    """Joint name to how it is driven; joints not listed are not driven."""
    approximations: Mapping[str, Approximation] = field(default_factory=dict)
    """Link name to how its collision meshes are meant; convexHull where not listed."""
    wheel_links: tuple[str, ...] = ()
    holonomic: bool = False
    planning: PlanningData | None = None
    metadata: Metadata = Metadata()
    solids: Mapping[str, tuple[Collision, ...]] = field(default_factory=dict)
    """Link name to the shapes that stand for its real form (the vendor's collision shapes, else the visual
    ones), before hulls were made of them; what spheres are fitted to.
    """
    filtered_pairs: tuple[tuple[str, str], ...] = ()
    """Links whose collision shapes overlap at rest though no joint joins them; physics must not let them
    push.
    """
    original_names: Mapping[str, str] = field(default_factory=dict)
    """Name now to the vendor's name, where they differ."""
