"""The driven wheels of a robot, left and right: radius and contact by its definition, width by their shapes.

A definition gives wheel radius and axle length; the shapes give them only roughly (a hull with a margin, a
hub that reaches inwards). So each wheel collides as a flat ellipsoid of the definition's radius, whose centre
is at the definition's axle length, but never outside the wheel.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Joint,
    Link,
    Mesh,
    Pose,
    RobotDescription,
    Sphere,
    Vector3,
    Visual,
)
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.shapes.load import load_mesh
from roboyard.transforms import Array

MIN_HALF_WIDTH = 0.1
"""Smallest half width of a wheel, as a fraction of its radius."""
MIN_APART = 1e-6
"""Smallest distance between the left and the right wheels along their axle (m)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Wheel:
    """One driven wheel; positions along its axle are relative to the link's origin (m)."""

    link: str
    joint: Joint
    low: float
    """Lower end of its shapes along the axle (m)."""
    high: float
    """Upper end of its shapes along the axle (m)."""
    centre: float
    """Centre of the rolling ellipsoid along the axle (m)."""
    side: float
    """Position of `centre` along the common axle in the root link's frame, joints at zero (m)."""
    radius: float
    """Largest distance of its shapes from the axle (m)."""

    @property
    def half_width(self) -> float:
        """Half width of the rolling ellipsoid (m)."""
        return max(min(self.high - self.centre, self.centre - self.low), MIN_HALF_WIDTH * self.radius)


def driven_wheels(definition: RobotDefinition, description: RobotDescription) -> dict[str, Wheel]:
    """Return the driven wheels by link, the left ones first; empty where a wheel has no collision shape."""
    if definition.two_wheel is None or definition.locomotion is None:
        return {}
    joints = [description.joint_by_name[name] for name in definition.locomotion.base_joint_names]
    links = [description.link_by_name[joint.child] for joint in joints]
    if not all(link.collisions for link in links):
        return {}
    poses = forward_kinematics(description)
    axes = [poses[j.child][:3, :3] @ np.asarray(j.axis) for j in joints]
    signs = [float(np.sign(axis @ axes[0]) or 1.0) for axis in axes]
    starts = [float(poses[j.child][:3, 3] @ axes[0]) for j in joints]
    spans = [extent_along(link, joint.axis) for link, joint in zip(links, joints, strict=True)]
    centres = [(low + high) / 2 for low, high in spans]
    sides = [start + sign * c for start, sign, c in zip(starts, signs, centres, strict=True)]
    half = len(joints) // 2
    left, right = float(np.mean(sides[:half])), float(np.mean(sides[half:]))
    middle, apart = (left + right) / 2, float(np.sign(left - right))
    if apart:
        reach = apart * definition.two_wheel.wheel_axle_length / 2
        targets = [
            (middle + (reach if k < half else -reach) - start) * sign
            for k, (start, sign) in enumerate(zip(starts, signs, strict=True))
        ]
        centres = [float(np.clip(c, *span)) for c, span in zip(targets, spans, strict=True)]
        sides = [start + sign * c for start, sign, c in zip(starts, signs, centres, strict=True)]
    return {
        joint.child: Wheel(
            link=joint.child,
            joint=joint,
            low=span[0],
            high=span[1],
            centre=centre,
            side=side,
            radius=_radius(link.collisions, joint.axis),
        )
        for joint, link, span, centre, side in zip(joints, links, spans, centres, sides, strict=True)
    }


def to_left(definition: RobotDefinition, description: RobotDescription) -> Array | None:
    """Return the (3,) unit vector along the axle from the right wheels to the left ones, joints at zero, in
    the root link's frame; None where the wheels are in one place.
    """
    if definition.two_wheel is None or definition.locomotion is None:
        return None
    names = definition.locomotion.base_joint_names
    poses = forward_kinematics(description)
    joints = [description.joint_by_name[name] for name in names]
    axle = poses[joints[0].child][:3, :3] @ np.asarray(joints[0].axis)
    axle = axle / np.linalg.norm(axle)
    places = []
    for joint in joints:
        link = description.link_by_name[joint.child]
        own = poses[joint.child][:3, :3] @ np.asarray(joint.axis)
        ends = extent_along(link, joint.axis) if link.collisions or link.visuals else (0.0, 0.0)
        places.append(float(poses[joint.child][:3, 3] @ axle + np.sign(own @ axle) * sum(ends) / 2))
    half = len(places) // 2
    apart = float(np.mean(places[:half]) - np.mean(places[half:]))
    return axle * np.sign(apart) if abs(apart) > MIN_APART else None


def forward_in(
    base_link: str, definition: RobotDefinition, description: RobotDescription
) -> tuple[float, float]:
    """Return the (2,) unit vector, level in a link's frame, along which the wheels drive; +x where unknown.

    The left wheels are on its left.
    """
    left = to_left(definition, description)
    T_root_base = forward_kinematics(description).get(base_link)
    if left is None or T_root_base is None:
        return (1.0, 0.0)
    x, y, _ = np.cross(T_root_base[:3, :3].T @ left, (0.0, 0.0, 1.0))
    length = float(np.hypot(x, y))
    return (float(x) / length, float(y) / length) if length > 0.5 else (1.0, 0.0)


def rolling_signs(definition: RobotDefinition, description: RobotDescription) -> tuple[float, ...]:
    """Return, for each driven wheel, 1 where a positive speed of its joint rolls the robot forwards, else -1.

    Forwards has the left wheels on the left.
    """
    left = to_left(definition, description)
    if left is None or definition.locomotion is None:
        return ()
    poses = forward_kinematics(description)
    joints = [description.joint_by_name[name] for name in definition.locomotion.base_joint_names]
    return tuple(float(np.sign(poses[j.child][:3, :3] @ np.asarray(j.axis) @ left) or 1.0) for j in joints)


def as_sphere(link: Link, wheel: Wheel, radius: float) -> Link:
    """Return a driven wheel's link with one collision sphere of this radius (m), its z axis along the axle.

    `Link.flatten_spheres` then makes the sphere as narrow as the wheel.
    """
    x, y, z = wheel.joint.axis
    middle = np.asarray(wheel.joint.axis) * wheel.centre
    position = (float(middle[0]), float(middle[1]), float(middle[2]))
    half = np.array([-y, x, 0.0, 1.0 + z]) if z > -1 + 1e-9 else np.array([1.0, 0.0, 0.0, 0.0])
    quaternion = half / np.linalg.norm(half)
    origin = Pose(position=position, quaternion=tuple(float(v) for v in quaternion))  # type: ignore[arg-type]
    first = link.collisions[0]
    return replace(link, collisions=(replace(first, geometry=Sphere(radius=radius), origin=origin),))


def extent_along(link: Link, axis: Vector3) -> tuple[float, float]:
    """Return the lower and upper end of a link's shapes along a unit axis of its frame (m)."""
    sides = [_extent(shape, np.asarray(axis)) for shape in (*link.collisions, *link.visuals)]
    return min(low for low, _ in sides), max(high for _, high in sides)


def _extent(shape: Collision | Visual, axis: Array) -> tuple[float, float]:
    """Return the lower and upper end of a shape along a (3,) unit axis of its link's frame (m)."""
    pose, geometry = shape.origin.matrix(), shape.geometry
    local = pose[:3, :3].T @ axis
    centre = float(pose[:3, 3] @ axis)
    match geometry:
        case Box(size=size):
            reach = float(np.abs(local) @ np.asarray(size)) / 2
        case Sphere(radius=radius):
            reach = radius
        case Cylinder(radius=radius, length=length):
            reach = abs(float(local[2])) * length / 2 + radius * float(np.hypot(local[0], local[1]))
        case Capsule(radius=radius, length=length):
            reach = abs(float(local[2])) * length / 2 + radius
        case Mesh():
            along = mesh_points(geometry) @ local
            return centre + float(along.min()), centre + float(along.max())
        case _:
            reach = 0.0
    return centre - reach, centre + reach


def _radius(shapes: Iterable[Collision], axis: Vector3) -> float:
    """Return the largest distance of shapes from an axis through the link's origin (m), on two diameters."""
    x, y, z = axis
    first = np.cross(axis, (1.0, 0.0, 0.0) if abs(x) < 0.9 else (0.0, 1.0, 0.0))
    first = first / np.linalg.norm(first)
    second = np.cross((x, y, z), first)
    return max(abs(end) for shape in shapes for side in (first, second) for end in _extent(shape, side))


def mesh_points(geometry: Mesh) -> Array:
    """Return the (n, 3) scaled vertices of a mesh in the shape's frame (m); without a file the origin."""
    mesh = geometry.data
    if mesh is None:
        if geometry.path is None:
            return np.zeros((1, 3))
        mesh = load_mesh(geometry.path)
    return np.asarray(mesh.vertices, dtype=float) * np.asarray(geometry.scale)
