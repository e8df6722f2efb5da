"""Build furniture from simple solids: parts make a link, links and joints a description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.description.model import (
    RGBA,
    Box,
    Capsule,
    Collision,
    Contact,
    Cylinder,
    Geometry,
    Inertial,
    Joint,
    Limit,
    Link,
    Material,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
    Vector3,
    Visual,
)
from roboyard.shapes import inertia
from roboyard.shapes.mesh import TriangleMesh
from roboyard.transforms import matrix_from_quaternion, quaternion_from_rpy

HERE = Pose()


@dataclass(frozen=True, kw_only=True, slots=True)
class Part:
    """One solid of a link."""

    geometry: Geometry
    """Shape."""
    pose: Pose = HERE
    """Pose in the link's frame (m)."""
    rgba: RGBA = (0.8, 0.8, 0.8, 1.0)
    """Colour."""
    is_solid: bool = True
    """Whether it collides."""
    is_visible: bool = True
    """Whether it is rendered."""


def box(
    size: Vector3, at: Vector3, rgba: RGBA, *, rpy: Vector3 = (0.0, 0.0, 0.0), solid: bool = True
) -> Part:
    """Return a box of full extents `size` centred `at` (m)."""
    return Part(geometry=Box(size=size), pose=_pose(at, rpy), rgba=rgba, is_solid=solid)


def between(low: Vector3, high: Vector3, rgba: RGBA, *, solid: bool = True) -> Part:
    """Return the box between two opposite corners (m)."""
    size = tuple(abs(b - a) for a, b in zip(low, high, strict=True))
    middle = tuple((a + b) / 2 for a, b in zip(low, high, strict=True))
    return box((size[0], size[1], size[2]), (middle[0], middle[1], middle[2]), rgba, solid=solid)


def cylinder(
    radius: float,
    length: float,
    at: Vector3,
    rgba: RGBA,
    *,
    rpy: Vector3 = (0.0, 0.0, 0.0),
    solid: bool = True,
) -> Part:
    """Return a cylinder along z (before `rpy`, rad), centred `at` (m)."""
    geometry = Cylinder(radius=radius, length=length)
    return Part(geometry=geometry, pose=_pose(at, rpy), rgba=rgba, is_solid=solid)


def capsule(radius: float, length: float, at: Vector3, rgba: RGBA, *, rpy: Vector3 = (0.0, 0.0, 0.0)) -> Part:
    """Return a capsule along z (before `rpy`, rad), `length` without its caps, centred `at` (m)."""
    return Part(geometry=Capsule(radius=radius, length=length), pose=_pose(at, rpy), rgba=rgba)


def sphere(radius: float, at: Vector3, rgba: RGBA) -> Part:
    """Return a sphere centred `at` (m)."""
    return Part(geometry=Sphere(radius=radius), pose=_pose(at, (0.0, 0.0, 0.0)), rgba=rgba)


def skin(mesh: TriangleMesh, rgba: RGBA, at: Vector3 = (0.0, 0.0, 0.0)) -> Part:
    """Return a mesh that is visible only, shifted by `at` (m)."""
    geometry = Mesh(uri="", path=None, data=mesh)
    return Part(geometry=geometry, pose=Pose(position=at), rgba=rgba, is_solid=False)


def collision_only(part: Part) -> Part:
    """Return the part as an invisible collision shape."""
    return Part(geometry=part.geometry, pose=part.pose, rgba=part.rgba, is_visible=False)


def handle(
    at: Vector3, length: float, rgba: RGBA, *, vertical: bool = False, distance: float = 0.035
) -> list[Part]:
    """Return a bar handle with two feet on a front that faces -y (m)."""
    x, y, z = at
    turn = (0.0, 0.0, 0.0) if vertical else (0.0, np.pi / 2, 0.0)
    foot = length / 2 - 0.01
    offsets = [(0.0, foot), (0.0, -foot)] if vertical else [(foot, 0.0), (-foot, 0.0)]
    feet = [box((0.01, distance, 0.01), (x + dx, y - distance / 2, z + dz), rgba) for dx, dz in offsets]
    return [capsule(0.006, length, (x, y - distance, z), rgba, rpy=turn), *feet]


def link(name: str, parts: Sequence[Part], mass: float = 0.0, friction: float | None = None) -> Link:
    """Return a link of these parts, its mass (kg; 0: none) distributed over the solid ones by volume."""
    return Link(
        name=name,
        inertial=_inertial(parts, mass) if mass > 0 else None,
        visuals=tuple(
            Visual(geometry=p.geometry, origin=p.pose, material=Material(rgba=p.rgba))
            for p in parts
            if p.is_visible
        ),
        collisions=tuple(Collision(geometry=p.geometry, origin=p.pose) for p in parts if p.is_solid),
        contact=None if friction is None else Contact(lateral_friction=friction),
    )


def hinge(
    name: str,
    parent: str,
    child: str,
    at: Vector3,
    *,
    lower: float = 0.0,
    upper: float = 1.75,
    axis: Vector3 = (0.0, 0.0, 1.0),
    damping: float = 0.4,
    friction: float = 0.3,
) -> Joint:
    """Return a hinge `at` a position in its parent (m).

    Limits in rad, damping in N m s/rad, friction in N m.
    """
    return Joint(
        name=name, type="revolute", parent=parent, child=child, origin=Pose(position=at), axis=axis,
        limit=Limit(lower=lower, upper=upper), damping=damping, friction=friction,
    )  # fmt: skip


def slider(
    name: str,
    parent: str,
    child: str,
    at: Vector3,
    *,
    length: float,
    axis: Vector3 = (0.0, -1.0, 0.0),
    damping: float = 4.0,
    friction: float = 2.0,
) -> Joint:
    """Return a drawer's slider with a range of `length` (m); damping in N s/m, friction in N."""
    return Joint(
        name=name, type="prismatic", parent=parent, child=child, origin=Pose(position=at), axis=axis,
        limit=Limit(lower=0.0, upper=length), damping=damping, friction=friction,
    )  # fmt: skip


def object_of(
    name: str, parts: Sequence[Part], mass: float = 0.0, friction: float | None = None
) -> RobotDescription:
    """Return a description of one link."""
    return RobotDescription(name=name, links=(link("base", parts, mass, friction),))


def _pose(at: Vector3, rpy: Vector3) -> Pose:
    x, y, z, w = (float(v) for v in quaternion_from_rpy(rpy))
    return Pose(position=at, quaternion=(x, y, z, w))


def _inertial(parts: Sequence[Part], mass: float) -> Inertial:
    solids = []
    for part in parts:
        if not part.is_solid:
            continue
        match part.geometry:
            case Box(size=size):
                solid = inertia.box(size)
            case Sphere(radius=radius):
                solid = inertia.sphere(radius)
            case Cylinder(radius=radius, length=length):
                solid = inertia.cylinder(radius, length)
            case Capsule(radius=radius, length=length):
                solid = inertia.capsule(radius, length)
            case _:
                continue
        solids.append(solid.moved(part.pose.position, matrix_from_quaternion(part.pose.quaternion)))
    whole = inertia.combined(solids).scaled_to(mass)
    x, y, z = (float(v) for v in whole.center)
    i = whole.inertia
    six = tuple(float(v) for v in (i[0, 0], i[0, 1], i[0, 2], i[1, 1], i[1, 2], i[2, 2]))
    return Inertial(
        mass=mass,
        origin=Pose(position=(x, y, z)),
        inertia=(six[0], six[1], six[2], six[3], six[4], six[5]),
    )
