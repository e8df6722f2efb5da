"""What a definition asks of the robot's description before it goes into a world."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from roboyard.poses import Array
from roboyard.robots.definition import RobotDefinition
from roboyard.shapes.load import load_mesh
from roboyard.urdf.model import (
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
)


def edited(definition: RobotDefinition, description: RobotDescription) -> RobotDescription:
    """The description with collisions removed, wheels as spheres and markers hidden, as the definition
    says.
    """
    silent = set(definition.disabled_collision_link_names or ())
    hidden: set[str] = set()
    if definition.visual_only_eef_links and definition.manipulation is not None:
        hidden = set(definition.manipulation.eef_link_names.values())
    wheels: Collection[str] = ()
    block = definition.holonomic_base
    if block is not None and block.force_sphere_wheel_approximation and definition.locomotion is not None:
        wheels = definition.locomotion.floor_touching_base_link_names
    links = tuple(_edited(link, silent, hidden, wheels) for link in description.links)
    rolling = driven_wheels(definition, description)
    if rolling:
        radius = definition.two_wheel.wheel_radius if definition.two_wheel is not None else 0.0
        links = tuple(
            rolling_ball(link, rolling[link.name], radius) if link.name in rolling else link for link in links
        )
    return replace(description, links=links)


def driven_wheels(definition: RobotDefinition, description: RobotDescription) -> dict[str, Joint]:
    """Link to joint of the two driven wheels."""
    if definition.two_wheel is None or definition.locomotion is None:
        return {}
    joints = [description.joint_by_name[name] for name in definition.locomotion.base_joint_names]
    return {joint.child: joint for joint in joints}


def rolling_ball(link: Link, axle: Joint, radius: float) -> Link:
    """A driven wheel as one ball of the definition's radius in its middle, z along the axle.

    `Link.flatten_balls` then makes it as narrow as the wheel.
    """
    if not link.collisions:
        return link
    low, high = extent_along(link, axle.axis)
    middle = np.asarray(axle.axis) * (low + high) / 2
    position = (float(middle[0]), float(middle[1]), float(middle[2]))
    x, y, z = axle.axis
    half = np.array([-y, x, 0.0, 1.0 + z]) if z > -1 + 1e-9 else np.array([1.0, 0.0, 0.0, 0.0])
    quaternion = half / np.linalg.norm(half)
    origin = Pose(position=position, quaternion=tuple(float(v) for v in quaternion))  # type: ignore[arg-type]
    first = link.collisions[0]
    return replace(link, collisions=(replace(first, geometry=Sphere(radius=radius), origin=origin),))


def extent_along(link: Link, axis: Vector3) -> tuple[float, float]:
    """Where the collision shapes of a link begin and end along a unit axis of its frame; m."""
    sides = [_extent(shape, np.asarray(axis)) for shape in link.collisions]
    return min(low for low, _ in sides), max(high for _, high in sides)


def _extent(shape: Collision, axis: Array) -> tuple[float, float]:
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
            points = mesh_points(geometry)
            along = points @ local
            return centre + float(along.min()), centre + float(along.max())
        case _:
            reach = 0.0
    return centre - reach, centre + reach


def mesh_points(geometry: Mesh) -> Array:
    """(n, 3) scaled vertices of a mesh, in the shape's frame; m. One point at the origin where there is no
    file.
    """
    mesh = geometry.data
    if mesh is None:
        if geometry.path is None:
            return np.zeros((1, 3))
        mesh = load_mesh(geometry.path)
    return np.asarray(mesh.vertices, dtype=float) * np.asarray(geometry.scale)


def _edited(link: Link, silent: Collection[str], hidden: Collection[str], wheels: Collection[str]) -> Link:
    if link.name in hidden:
        return replace(link, visuals=(), collisions=())
    if link.name in silent:
        return replace(link, collisions=())
    if link.name in wheels:
        return replace(link, collisions=tuple(bounding_sphere(shape) for shape in link.collisions))
    return link


def bounding_sphere(collision: Collision) -> Collision:
    """A mesh as the ball around the middle of its box; other shapes as they are."""
    geometry = collision.geometry
    if not isinstance(geometry, Mesh):
        return collision
    points = mesh_points(geometry)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    at = collision.origin.matrix() @ np.append(centre, 1.0)
    position = (float(at[0]), float(at[1]), float(at[2]))
    return replace(collision, geometry=Sphere(radius=radius), origin=Pose(position=position))
