"""A robot description as plain, immutable data, in file order.

The simulator, the importer, the writers and the planner use these types. Lengths are metres, angles
radians, masses kilograms; rotations are quaternions (x, y, z, w). Each element remembers the line it came
from, so that later errors can point at it, and carries the XML that Roboyard does not read: whole child
elements in `extra`, or the unread part of one (`<limit current="3"/>`), which the writer merges back in.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from roboyard._records import dataclass
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import Array, pose_matrix

JointType = Literal["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"]
TYPES_WITH_AXIS: tuple[JointType, ...] = ("revolute", "continuous", "prismatic", "planar")
Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
RGBA = tuple[float, float, float, float]
Attributes = tuple[tuple[str, str], ...]
"""XML attributes of an element that Roboyard does not read, kept for writing."""


INERTIA_KEYS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""Order of `Inertial.inertia`."""
CONTACT_TAGS = (
    "lateral_friction",
    "rolling_friction",
    "spinning_friction",
    "restitution",
    "stiffness",
    "damping",
    "inertia_scaling",
)
"""Fields of `Contact`."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Source:
    """Where an element was written."""

    file: Path | None = None
    """The file, or None for a description made in memory."""
    line: int | None = None
    """1-based line of the element's start tag."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Pose:
    """Pose of a frame in its parent's frame."""

    position: Vector3 = (0.0, 0.0, 0.0)
    """m"""
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """Unit, (x, y, z, w)."""
    rpy: Vector3 | None = None
    """Roll, pitch, yaw (rad) as written in the file, where there is one; kept for lossless writing."""

    @property
    def is_identity(self) -> bool:
        """Whether the frame is its parent's."""
        return tuple(self.position) == (0.0, 0.0, 0.0) and tuple(self.quaternion) == (0.0, 0.0, 0.0, 1.0)

    def matrix(self) -> Array:
        """(4, 4) homogeneous matrix."""
        return pose_matrix(self.position, self.quaternion)


# ---------------------------------------------------------------------------------------------- geometry


@dataclass(frozen=True, kw_only=True, slots=True)
class Box:
    """Box, centred."""

    size: Vector3
    """Full extents along x, y, z; m."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Sphere:
    """Sphere, centred."""

    radius: float
    """m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Cylinder:
    """Axis along z, centred."""

    radius: float
    """m"""
    length: float
    """m"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Capsule:
    """Axis along z, centred."""

    radius: float
    """m"""
    length: float
    """Of the cylindrical part, without the caps; m."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Plane:
    """An infinite half space (PyBullet's extension of URDF)."""

    normal: Vector3 = (0.0, 0.0, 1.0)


FLAT = 1e-9
"""Factor of a mesh that Bullet scales by 0."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Mesh:
    """Mesh of a file, or made in memory."""

    uri: str
    """As written in the file."""
    path: Path | None
    """The file it was resolved to; None where it was not found."""
    scale: Vector3 = (1.0, 1.0, 1.0)
    """Negative components mirror."""
    data: TriangleMesh | None = None
    """Triangles made in memory, used instead of a file."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Heightfield:
    """Terrain made in memory (URDF has none), centred in x and y."""

    heights: Array
    """(nx, ny) height above the shape's origin at each grid point, first index along x; m"""
    cell: tuple[float, float]
    """Spacing of the grid points along x and y; m"""


Geometry = Box | Sphere | Cylinder | Capsule | Plane | Mesh | Heightfield


@dataclass(frozen=True, kw_only=True, slots=True)
class Material:
    """Colour and texture of a visual."""

    name: str | None = None
    rgba: RGBA | None = None
    texture: Path | None = None
    """Resolved image file."""
    texture_uri: str | None = None
    """As written in the file."""
    extra: tuple[ET.Element, ...] = ()
    """Child elements that Roboyard does not read (specular, ...)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Visual:
    """Shape that is rendered."""

    geometry: Geometry
    origin: Pose = Pose()
    """Of the shape in the link frame."""
    material: Material | None = None
    name: str | None = None
    extra: tuple[ET.Element, ...] = ()
    attributes: Attributes = ()
    source: Source = Source()


@dataclass(frozen=True, kw_only=True, slots=True)
class Collision:
    """Shape that collides."""

    geometry: Geometry
    origin: Pose = Pose()
    """Of the shape in the link frame."""
    name: str | None = None
    concave: bool = False
    """True where the file asks for the triangles themselves (PyBullet's concave="yes")."""
    extra: tuple[ET.Element, ...] = ()
    attributes: Attributes = ()
    source: Source = Source()


@dataclass(frozen=True, kw_only=True, slots=True)
class Inertial:
    """Mass, centre of mass and inertia of a link."""

    mass: float
    """kg"""
    origin: Pose = Pose()
    """Of the inertial (centre of mass) frame in the link frame."""
    inertia: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """ixx, ixy, ixz, iyy, iyz, izz about the centre of mass, in the inertial frame; kg m²."""
    source: Source = Source()

    def matrix(self) -> Array:
        """(3, 3) inertia tensor in the inertial frame."""
        xx, xy, xz, yy, yz, zz = self.inertia
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


@dataclass(frozen=True, kw_only=True, slots=True)
class Contact:
    """PyBullet's `<contact>` extension; None means not given."""

    lateral_friction: float | None = None
    rolling_friction: float | None = None
    spinning_friction: float | None = None
    restitution: float | None = None
    stiffness: float | None = None
    damping: float | None = None
    inertia_scaling: float | None = None
    """Factor of the moments of inertia."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Link:
    """Rigid body of the robot."""

    name: str
    inertial: Inertial | None = None
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Collision, ...] = ()
    contact: Contact | None = None
    extra: tuple[ET.Element, ...] = ()
    """Child elements that Roboyard does not read; written back as they were."""
    attributes: Attributes = ()
    source: Source = Source()


@dataclass(frozen=True, kw_only=True, slots=True)
class Limit:
    """None means not given (never the same as zero)."""

    lower: float | None = None
    """rad or m"""
    upper: float | None = None
    """rad or m"""
    effort: float | None = None
    """N m or N"""
    velocity: float | None = None
    """rad/s or m/s"""


@dataclass(frozen=True, kw_only=True, slots=True)
class Mimic:
    """position = multiplier · position of `joint` + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Joint:
    """Joint between a parent and a child link."""

    name: str
    type: JointType
    parent: str
    child: str
    origin: Pose = Pose()
    """Of the child link's frame in the parent link's frame, at joint position zero."""
    axis: Vector3 = (1.0, 0.0, 0.0)
    """Unit, in the child link's frame (the joint frame)."""
    axis_length: float = 1.0
    """Length of the axis as the file gives it."""
    limit: Limit | None = None
    damping: float = 0.0
    """N m s/rad or N s/m"""
    friction: float = 0.0
    """N m or N"""
    mimic: Mimic | None = None
    extra: tuple[ET.Element, ...] = ()
    """Child elements kept but unused: safety_controller, calibration, ..."""
    attributes: Attributes = ()
    source: Source = Source()

    @property
    def is_moving(self) -> bool:
        """True for every type but fixed."""
        return self.type != "fixed"

    def position_limits(self) -> tuple[float, float] | None:
        """(lower, upper) of a revolute or prismatic joint whose file gives a range; None for no limits."""
        limit = self.limit
        if self.type not in ("revolute", "prismatic") or limit is None:
            return None
        if limit.lower is None and limit.upper is None:
            return None
        lower, upper = limit.lower or 0.0, limit.upper or 0.0
        return None if lower > upper else (lower, upper)


@dataclass(frozen=True, kw_only=True, slots=True)
class LoopJoint:
    """Joint that closes a loop of links, beside the tree: its frames in both links stay together."""

    name: str
    type: Literal["revolute", "spherical", "fixed"]
    """A revolute one also keeps the axes of both frames parallel, a fixed one all of them."""
    first: str
    """Link."""
    second: str
    """Link."""
    first_origin: Pose = Pose()
    """Of the joint's frame in the first link's frame."""
    second_origin: Pose = Pose()
    """Of the joint's frame in the second link's frame."""
    axis: Vector3 = (0.0, 0.0, 1.0)
    """Unit, in the joint's frame; of a revolute joint."""
    source: Source = Source()


# --------------------------------------------------------------------------------------------- the robot


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """A tree of links and joints, in file order, and the joints that close loops in it.

    `load_description` returns one; `dataclasses.replace` makes an edited copy.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...] = ()
    loops: tuple[LoopJoint, ...] = ()
    """Joints beside the tree, which close loops."""
    materials: tuple[Material, ...] = ()
    """The robot's global materials; visuals already hold theirs resolved."""
    extra: tuple[ET.Element, ...] = ()
    """Robot-level elements kept but unused: transmission, gazebo, ..."""
    attributes: Attributes = ()
    source: Source = Source()
    notes: tuple[str, ...] = field(default=())
    """Corrections made by the reader (sloppy numbers, non-unit axes, ...)."""

    @cached_property
    def link_by_name(self) -> Mapping[str, Link]:
        """Name to link."""
        return {link.name: link for link in self.links}

    @cached_property
    def joint_by_name(self) -> Mapping[str, Joint]:
        """Name to joint."""
        return {joint.name: joint for joint in self.joints}

    @cached_property
    def root(self) -> Link:
        """The link that is no joint's child."""
        children = {joint.child for joint in self.joints}
        return next(link for link in self.links if link.name not in children)

    @cached_property
    def child_joints(self) -> Mapping[str, tuple[Joint, ...]]:
        """Link name to the joints that hang from it, in file order."""
        found: dict[str, list[Joint]] = {link.name: [] for link in self.links}
        for joint in self.joints:
            found[joint.parent].append(joint)
        return {name: tuple(joints) for name, joints in found.items()}

    @cached_property
    def parent_joint(self) -> Mapping[str, Joint]:
        """Link name to the joint it hangs from; the root has none."""
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def depth_first_joints(self) -> tuple[Joint, ...]:
        """Joints depth first, children in file order: the one documented order of joint vectors."""
        ordered: list[Joint] = []
        stack = list(reversed(self.child_joints[self.root.name]))
        while stack:
            joint = stack.pop()
            ordered.append(joint)
            stack.extend(reversed(self.child_joints[joint.child]))
        return tuple(ordered)
