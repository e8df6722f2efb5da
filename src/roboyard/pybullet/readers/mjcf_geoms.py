"""Shapes, defaults and numbers of MJCF files, for the subset that Bullet reads."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import field, replace
from math import pi, sqrt
from pathlib import Path

import numpy as np

from roboyard._records import dataclass
from roboyard.description.files.resolver import Resolver
from roboyard.description.model import (
    RGBA,
    Attributes,
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Mesh,
    Plane,
    Pose,
    Quaternion,
    Source,
    Sphere,
    Vector3,
)
from roboyard.description.urdf.xml import line_of
from roboyard.errors import DescriptionError
from roboyard.pybullet.bullet_rules.shape_bounds import BETWEEN_ENDS
from roboyard.transforms import Array, pose_matrix, quaternion_from_matrix

_WHITE: RGBA = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class GeomDefaults:
    """Contact settings and colour of a shape, or the defaults for them."""

    group: int = 1
    """contype."""
    mask: int = 1
    """conaffinity."""
    condim: int = 3
    """Contact dimension."""
    friction: float = 0.5
    """Lateral friction coefficient."""
    spinning: float = 0.0
    """Spinning friction coefficient."""
    rolling: float = 0.0
    """Rolling friction coefficient."""
    rgba: RGBA = _WHITE
    """Colour (0 to 1)."""
    limited: str = ""
    """`limited` of joints."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Geom:
    """One shape of a body."""

    geometry: Geometry
    """Type and dimensions (m)."""
    origin: Pose
    """Pose in the body frame."""
    settings: GeomDefaults
    """Contact settings and colour."""
    volume: float
    """Volume (m³); 0 for meshes and planes, as in Bullet."""
    shift: Vector3
    """Middle of a shape given by two end points, where Bullet puts the centre of mass, else zero (m)."""
    is_between_ends: bool
    """Whether the shape is given by two end points."""

    @property
    def attributes(self) -> Attributes:
        """The mark of shapes that are given by two end points."""
        return ((BETWEEN_ENDS, "true"),) if self.is_between_ends else ()

    def collision(self) -> Collision:
        """Return the collision shape."""
        return Collision(geometry=self.geometry, origin=self.origin, attributes=self.attributes)


@dataclass(kw_only=True, slots=True)
class Reader:
    """Settings and assets of one file."""

    path: Path
    """The file."""
    search_paths: Sequence[Path]
    """Folders where meshes are searched."""
    colors: bool
    """Whether colours are read."""
    in_degrees: bool = False
    """Whether angles are in degrees: in Bullet only with a `<compiler>` element, there by default."""
    inertia_from_geoms: bool = True
    """Whether `diaginertia` is ignored."""
    mesh_folder: str = ""
    """`meshdir`, put in front of mesh files."""
    meshes: dict[str, str] = field(default_factory=dict)
    """Mesh name to file."""
    defaults: GeomDefaults = GeomDefaults()
    """Defaults outside all classes."""
    classes: dict[str, GeomDefaults] = field(default_factory=dict)
    """Defaults by class."""

    def source(self, element: ET.Element) -> Source:
        """Return the file and line of an element."""
        return Source(file=self.path, line=line_of(element))

    def read_compiler(self, element: ET.Element) -> None:
        """Read `<compiler>`."""
        self.mesh_folder = element.get("meshdir", self.mesh_folder)
        self.in_degrees = element.get("angle", "degree") == "degree"
        self.inertia_from_geoms = not element.get("inertiafromgeom", "true").startswith("f")

    def read_assets(self, element: ET.Element) -> None:
        """Read the meshes of `<asset>`."""
        for mesh in element.findall("mesh"):
            file = mesh.get("file")
            if file is not None:
                self.meshes[mesh.get("name", Path(file).stem)] = self.mesh_folder + file

    def read_default(self, element: ET.Element, settings: GeomDefaults) -> GeomDefaults:
        """Return the defaults of an element, based on `settings`; its classes are stored by name."""
        for child in element:
            if child.tag == "default":
                name = child.get("class", "")
                self.classes[name] = self.read_default(child, self.classes.get(name, GeomDefaults()))
            elif child.tag == "joint":
                settings = replace(settings, limited=child.get("limited", settings.limited))
            elif child.tag == "geom":
                settings = _geom_defaults(child, self, settings, is_default=True)
            elif child.tag == "asset":
                self.read_assets(child)
        return settings


def read_geom(element: ET.Element, reader: Reader, defaults: GeomDefaults) -> Geom | None:
    """Return a shape, or None for a type that Bullet does not support or a missing mesh.

    Raises:
        DescriptionError: a number is not valid.
    """
    settings = _geom_defaults(element, reader, defaults, is_default=False)
    pose = pose_of(element, reader)
    turn = numbers(element, "axisangle", 4, reader)
    if turn is not None:
        axis = np.array(turn[:3]) / (np.linalg.norm(turn[:3]) or 1.0)
        x, y, z = (float(v) for v in axis * np.sin(turn[3] / 2))
        pose = pose_matrix(pose[:3, 3], (x, y, z, float(np.cos(turn[3] / 2))))
    position, quaternion = pose[:3, 3], quaternion_from_matrix(pose[:3, :3])
    shift = np.zeros(3)
    size = _sizes(element, reader)
    kind = element.get("type", "")
    geometry: Geometry | None = None
    volume = 0.0
    if kind == "plane":
        geometry = Plane()
    elif kind == "box":
        x, y, z = size if len(size) == 3 else (1.0, 1.0, 1.0)
        geometry, volume = Box(size=(2 * x, 2 * y, 2 * z)), 8 * x * y * z
    elif kind == "sphere" and size:
        geometry, volume = Sphere(radius=size[0]), 4.0 / 3.0 * pi * size[0] ** 3
    elif kind in ("capsule", "cylinder"):
        ends = numbers(element, "fromto", 6, reader)
        radius = size[0] if size else 2.0
        length = 2 * size[1] if len(size) > 1 else 2.0
        if ends is not None:
            a, b = np.array(ends[:3]), np.array(ends[3:])
            length, shift = float(np.linalg.norm(b - a)), (a + b) / 2
            pose = pose @ pose_matrix(shift, _turn_of_z(b - a))
            position, quaternion = pose[:3, 3], quaternion_from_matrix(pose[:3, :3])
        volume = pi * radius**2 * length
        if kind == "capsule":
            geometry = Capsule(radius=radius, length=length)
            volume += 4.0 / 3.0 * pi * radius**3
        else:
            geometry = Cylinder(radius=radius, length=length)
    elif kind == "mesh":
        geometry = _mesh(element, reader)
    if geometry is None:
        return None
    qx, qy, qz, qw = (float(v) for v in quaternion)
    origin = Pose(position=_triple(position), quaternion=(qx, qy, qz, qw))
    return Geom(
        geometry=geometry,
        origin=origin,
        settings=settings,
        volume=volume,
        shift=_triple(shift),
        is_between_ends=element.get("fromto") is not None,
    )


def pose_of(element: ET.Element, reader: Reader) -> Array:
    """Return the (4, 4) pose of an element's `pos` (m) and `quat` (w first).

    Raises:
        DescriptionError: a number is not valid, or the quaternion is zero.
    """
    position = numbers(element, "pos", 3, reader) or (0.0, 0.0, 0.0)
    w, x, y, z = numbers(element, "quat", 4, reader) or (1.0, 0.0, 0.0, 0.0)
    length = sqrt(w * w + x * x + y * y + z * z)
    if length == 0.0:
        raise DescriptionError(
            f'quat="{element.get("quat")}" is not a rotation; give a unit quaternion',
            file=reader.path,
            line=line_of(element),
        )
    return pose_matrix(position, (x / length, y / length, z / length, w / length))


def numbers(element: ET.Element, key: str, count: int, reader: Reader) -> tuple[float, ...] | None:
    """Return the first `count` numbers of an attribute, or None if it is absent or too short.

    Several are rounded to single precision, in which Bullet reads them, a single one is not.

    Raises:
        DescriptionError: the attribute has something else than finite numbers.
    """
    found = _all_numbers(element, key, reader, float if count == 1 else np.float32)
    return found[:count] if len(found) >= count else None


def _all_numbers(
    element: ET.Element, key: str, reader: Reader, kind: type[float | np.float32] = np.float32
) -> tuple[float, ...]:
    given = element.get(key)
    if given is None:
        return ()
    try:
        found = tuple(float(kind(token)) for token in given.split())
    except ValueError:
        found = (float("nan"),)
    if not np.isfinite(found).all():
        raise DescriptionError(
            f'<{element.tag} {key}="{given}"> must have finite numbers only',
            file=reader.path,
            line=line_of(element),
        )
    return found


def _sizes(element: ET.Element, reader: Reader) -> tuple[float, ...]:
    sizes = _all_numbers(element, "size", reader, float if element.get("type") == "sphere" else np.float32)
    if any(value < 0 for value in sizes):
        raise DescriptionError(
            f'<geom size="{element.get("size")}">: sizes must not be negative',
            file=reader.path,
            line=line_of(element),
        )
    return sizes


def _geom_defaults(
    element: ET.Element, reader: Reader, base: GeomDefaults, *, is_default: bool
) -> GeomDefaults:
    settings = base
    for key, name in (("contype", "group"), ("conaffinity", "mask"), ("condim", "condim")):
        value = numbers(element, key, 1, reader)
        if value is not None:
            settings = replace(settings, **{name: int(value[0])})
    friction = _all_numbers(element, "friction", reader)
    if friction:
        settings = replace(settings, friction=friction[0])
    if is_default:
        settings = replace(
            settings,
            spinning=friction[1] if len(friction) > 1 else settings.spinning,
            rolling=friction[2] if len(friction) > 2 else settings.rolling,
        )
    else:
        settings = replace(
            settings,
            spinning=base.spinning if settings.condim > 3 else 0.0,
            rolling=base.rolling if settings.condim > 4 else 0.0,
        )
    colour = numbers(element, "rgba", 4, reader) if reader.colors else None
    if colour is not None:
        r, g, b, a = colour
        settings = replace(settings, rgba=(r, g, b, a))
    return settings


def _mesh(element: ET.Element, reader: Reader) -> Mesh | None:
    file = reader.meshes.get(element.get("mesh", ""))
    if file is None:
        return None
    found = Resolver(base=reader.path.parent, search_paths=reader.search_paths).resolve(file)
    return None if found.path is None else Mesh(uri=file, path=found.path)


def _turn_of_z(direction: Array) -> Quaternion:
    """Return the smallest rotation (x, y, z, w) from z to a direction."""
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        return 0.0, 0.0, 0.0, 1.0
    x, y, z = (float(v) for v in direction / length)
    if z < -1.0 + 1e-12:
        return 1.0, 0.0, 0.0, 0.0
    s = sqrt((1.0 + z) * 2.0)
    return -y / s, x / s, 0.0, s / 2.0


def _triple(values: Array) -> Vector3:
    x, y, z = (float(v) for v in values)
    return x, y, z
