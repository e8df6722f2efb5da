"""Trim collision shapes that touch the floor beside the wheels.

Vendors often wrap a base in a box whose margin reaches the floor, so that the box supports the robot instead
of its wheels. A definition lists the links that touch the floor. Where these support the robot (its centre of
mass is above their polygon), collision shapes of other links that are fixed to the root are trimmed at the
bottom of the link's visual shapes, or `CLEARANCE` above the floor where these reach down too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from roboyard._lazy import lazy_module
from roboyard.description.model import (
    Box,
    Capsule,
    Collision,
    Cylinder,
    Geometry,
    Link,
    Mesh,
    RobotDescription,
    Sphere,
    Visual,
)
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.robots.definition.schema import RobotDefinition
from roboyard.robots.stability.wheels import Wheel, mesh_points
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.transforms import Array

# they load numba and SciPy, which robots without a differential drive do not need
_hulls = lazy_module("roboyard.shapes.convex.hulls")
_spatial = lazy_module("scipy.spatial")

MIN_CLEARANCE = 2e-3
"""Shapes with less ground clearance are trimmed (m)."""
CLEARANCE = 5e-3
"""Smallest ground clearance of trimmed shapes (m)."""
MAX_CORNERS = 60
"""Largest number of corners of a hull that is trimmed."""


def links_below_floor(
    definition: RobotDefinition, description: RobotDescription, wheels: Collection[Wheel]
) -> dict[str, float]:
    """Return the links to trim, each with the height of its bottom in the root link's frame (m)."""
    if definition.two_wheel is None or definition.locomotion is None or not wheels:
        return {}
    poses = forward_kinematics(description)
    contacts = [(poses[w.link] @ np.append(np.asarray(w.joint.axis) * w.centre, 1.0))[:3] for w in wheels]
    floor = min(contact[2] for contact in contacts) - definition.two_wheel.wheel_radius
    driven = {wheel.link for wheel in wheels}
    others = [name for name in definition.locomotion.floor_touching_base_link_names if name not in driven]
    for name in others:
        shapes = description.link_by_name[name].collisions
        contacts += [points[points[:, 2].argmin()] for points in placed(shapes, poses[name])]
    if not is_inside(np.array(contacts)[:, :2], centre_of_mass(description, poses)[:2]):
        return {}
    found = {}
    for name in rigid_links(description):
        link = description.link_by_name[name]
        if name in driven or name in others or _lowest(link.collisions, poses[name]) >= floor + MIN_CLEARANCE:
            continue
        bottom = _lowest(link.visuals, poses[name])
        found[name] = bottom if floor + CLEARANCE <= bottom < np.inf else floor + CLEARANCE
    return found


def is_inside(contacts: Array, centre: Array) -> bool:
    """Return whether a (2,) point is inside the convex hull of (n, 2) others (m)."""
    try:
        sides = _spatial().ConvexHull(contacts).equations
    except (_spatial().QhullError, ValueError):
        return False
    return bool((sides @ np.append(centre, 1.0) <= 0.0).all())


def centre_of_mass(description: RobotDescription, poses: Mapping[str, Array]) -> Array:
    """Return the (3,) centre of mass in the root link's frame (m); links without inertial are ignored."""
    total, weighted = 0.0, np.zeros(3)
    for link in description.links:
        if link.inertial is not None:
            here = poses[link.name] @ np.append(link.inertial.origin.position, 1.0)
            total, weighted = total + link.inertial.mass, weighted + link.inertial.mass * here[:3]
    return weighted / total if total > 0 else np.full(3, np.nan)


def trim(link: Link, T_root_link: Array, height: float) -> Link:
    """Return a link whose collision shapes are trimmed below a height (m) in the root link's frame.

    Args:
        link: to trim.
        T_root_link: (4, 4) pose of the link in the root link's frame.
        height: of the new bottom (m).
    """
    kept = []
    for shape in link.collisions:
        pose = T_root_link @ shape.origin.matrix()
        points = _points(shape.geometry)
        if points is None or (points @ pose[2, :3] + pose[2, 3]).min() >= height:
            kept.append(shape)
            continue
        above = _part_above(points, pose[2, :3], height - pose[2, 3])
        if len(above):
            hull = _hulls().convex_hull(above, None).mesh
            mesh = TriangleMesh(vertices=read_only(hull.vertices, np.float64), faces=hull.faces)
            kept.append(replace(shape, geometry=Mesh(uri="", path=None, data=mesh)))
    return replace(link, collisions=tuple(kept))


def _part_above(points: Array, up: Array, level: float) -> Array:
    """Return the (m, 3) corners of the part of the points' hull where `up` · x is at least `level` (m)."""
    corners = _hulls().convex_hull(points, MAX_CORNERS).mesh.vertices
    height = corners @ up - level
    high, low = corners[height > 0], corners[height <= 0]
    if not len(high):
        return high
    fraction = height[height > 0][:, None] / (height[height > 0][:, None] - height[height <= 0][None, :])
    crossings = high[:, None] + fraction[:, :, None] * (low[None, :] - high[:, None])
    return np.concatenate([high, crossings.reshape(-1, 3)])


def rigid_links(description: RobotDescription) -> list[str]:
    """Return the links that are fixed to the root link, itself first."""
    found = [description.root.name]
    for name in found:
        found += [joint.child for joint in description.child_joints[name] if joint.type == "fixed"]
    return found


def _lowest(shapes: Sequence[Collision | Visual], T_root_link: Array) -> float:
    """Return the lowest height of shapes in the root link's frame (m); inf without shapes."""
    return min((float(points[:, 2].min()) for points in placed(shapes, T_root_link)), default=np.inf)


def placed(shapes: Sequence[Collision | Visual], T_root_link: Array) -> list[Array]:
    """Return the (n, 3) points of each shape in the root link's frame (m)."""
    placed = []
    for shape in shapes:
        points, pose = _points(shape.geometry), T_root_link @ shape.origin.matrix()
        if points is not None:
            placed.append(points @ pose[:3, :3].T + pose[:3, 3])
    return placed


def _points(geometry: Geometry) -> Array | None:
    """Return the (n, 3) points that span a shape, in its frame (m); None for an infinite plane."""
    match geometry:
        case Box(size=size):
            return primitives.box(size[0] / 2, size[1] / 2, size[2] / 2).vertices
        case Sphere(radius=radius):
            return primitives.sphere(radius).vertices
        case Cylinder(radius=radius, length=length):
            return primitives.cylinder(radius, length).vertices
        case Capsule(radius=radius, length=length):
            return primitives.capsule(radius, length).vertices
        case Mesh():
            return mesh_points(geometry)
        case _:
            return None
