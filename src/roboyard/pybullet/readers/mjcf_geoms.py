"""Shapes, defaults and numbers of MJCF files, as far as Bullet reads them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt
from pathlib import Path

import numpy as np

from roboyard.description.files.resolver import Resolver
from roboyard.description.model import (
    RGBA,
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
from roboyard.transforms import Array, pose_matrix, quaternion_from_matrix

BETWEEN_ENDS = "fromto"
"""Attribute of collision shapes given by two end points."""
_WHITE: RGBA = (1.0, 1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Look:
    """What defaults and shapes say about contact and colour."""

    group: int = 1
    mask: int = 1
    condim: int = 3
    friction: float = 0.5
    spinning: float = 0.0
    rolling: float = 0.0
    rgba: RGBA = _WHITE
    limited: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class Geom:
    geometry: Geometry
    origin: Pose
    """In the body's frame."""
    look: Look
    volume: float
    """m³; 0 for meshes and planes, which Bullet does not measure."""
    shift: Vector3
    """Middle of a shape given by two end points, else zero: where Bullet puts the centre of mass; m"""
    is_between_ends: bool
    """Whether it is given by two end points."""

    def collision(self) -> Collision:
        """The shape to collide with; remembers how it was given."""
        attributes = ((BETWEEN_ENDS, "true"),) if self.is_between_ends else ()
        return Collision(geometry=self.geometry, origin=self.origin, attributes=attributes)


@dataclass(kw_only=True, slots=True)
class Reader:
    """What the parts of one file share."""

    path: Path
    search_paths: Sequence[Path]
    colors: bool
    in_degrees: bool = True
    inertia_from_geoms: bool = True
    mesh_folder: str = ""
    meshes: dict[str, str] = field(default_factory=dict)
    defaults: Look = Look()
    classes: dict[str, Look] = field(default_factory=dict)

    def source(self, element: ET.Element) -> Source:
        return Source(file=self.path, line=line_of(element))

    def read_compiler(self, element: ET.Element) -> None:
        self.mesh_folder = element.get("meshdir", self.mesh_folder)
        self.in_degrees = element.get("angle", "degree") == "degree"
        self.inertia_from_geoms = not element.get("inertiafromgeom", "true").startswith("f")

    def read_assets(self, element: ET.Element) -> None:
        for mesh in element.findall("mesh"):
            file = mesh.get("file")
            if file is not None:
                self.meshes[mesh.get("name", Path(file).stem)] = self.mesh_folder + file

    def read_default(self, element: ET.Element, look: Look) -> Look:
        """Defaults that an element adds to those around it; classes in it are kept by name."""
        for child in element:
            if child.tag == "default":
                name = child.get("class", "")
                self.classes[name] = self.read_default(child, self.classes.get(name, Look()))
            elif child.tag == "joint":
                look = replace(look, limited=child.get("limited", look.limited))
            elif child.tag == "geom":
                look = _look(child, self, look, is_default=True)
            elif child.tag == "asset":
                self.read_assets(child)
        return look


def read_geom(element: ET.Element, reader: Reader, defaults: Look) -> Geom | None:
    """One shape; None for a kind that Bullet does not know, or a mesh that is not there."""
    look = _look(element, reader, defaults, is_default=False)
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
        look=look,
        volume=volume,
        shift=_triple(shift),
        is_between_ends=element.get("fromto") is not None,
    )


def pose_of(element: ET.Element, reader: Reader) -> Array:
    """(4, 4) of `pos` and `quat` (w first)."""
    position = numbers(element, "pos", 3, reader) or (0.0, 0.0, 0.0)
    w, x, y, z = numbers(element, "quat", 4, reader) or (1.0, 0.0, 0.0, 0.0)
    length = sqrt(w * w + x * x + y * y + z * z)
    if length == 0.0:
        raise DescriptionError(
            'quat="0 0 0 0" is no rotation; give a unit quaternion', file=reader.path, line=line_of(element)
        )
    return pose_matrix(position, (x / length, y / length, z / length, w / length))


def numbers(element: ET.Element, key: str, count: int, reader: Reader) -> tuple[float, ...] | None:
    """The first `count` numbers of an attribute; None where it is absent or too short."""
    found = _all_numbers(element, key, reader)
    return found[:count] if len(found) >= count else None


def _all_numbers(element: ET.Element, key: str, reader: Reader) -> tuple[float, ...]:
    given = element.get(key)
    if given is None:
        return ()
    try:
        found = tuple(float(token) for token in given.split())
    except ValueError:
        found = (float("nan"),)
    if not np.isfinite(found).all():
        raise DescriptionError(
            f'<{element.tag} {key}="{given}"> is not made of finite numbers',
            file=reader.path,
            line=line_of(element),
        )
    return found


def _sizes(element: ET.Element, reader: Reader) -> tuple[float, ...]:
    sizes = _all_numbers(element, "size", reader)
    if any(value < 0 for value in sizes):
        raise DescriptionError(
            f'<geom size="{element.get("size")}">: sizes are not negative',
            file=reader.path,
            line=line_of(element),
        )
    return sizes


def _look(element: ET.Element, reader: Reader, base: Look, *, is_default: bool) -> Look:
    look = base
    for key, name in (("contype", "group"), ("conaffinity", "mask"), ("condim", "condim")):
        value = numbers(element, key, 1, reader)
        if value is not None:
            look = replace(look, **{name: int(value[0])})
    friction = _all_numbers(element, "friction", reader)
    if friction:
        look = replace(look, friction=friction[0])
    if is_default:
        look = replace(
            look,
            spinning=friction[1] if len(friction) > 1 else look.spinning,
            rolling=friction[2] if len(friction) > 2 else look.rolling,
        )
    else:
        look = replace(
            look,
            spinning=base.spinning if look.condim > 3 else 0.0,
            rolling=base.rolling if look.condim > 4 else 0.0,
        )
    colour = numbers(element, "rgba", 4, reader) if reader.colors else None
    if colour is not None:
        r, g, b, a = colour
        look = replace(look, rgba=(r, g, b, a))
    return look


def _mesh(element: ET.Element, reader: Reader) -> Mesh | None:
    file = reader.meshes.get(element.get("mesh", ""))
    if file is None:
        return None
    found = Resolver(base=reader.path.parent, search_paths=reader.search_paths).resolve(file)
    return None if found.path is None else Mesh(uri=file, path=found.path)


def _turn_of_z(direction: Array) -> Quaternion:
    """The smallest rotation that turns z into a direction; x, y, z, w."""
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
