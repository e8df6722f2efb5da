"""Links without joints of their own on which a base stands: casters, and wheels drawn on fixed joints."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from roboyard.description.geometry import shape_meshes
from roboyard.description.model import RobotDescription
from roboyard.description.semantic import SemanticDescription
from roboyard.errors import MeshError
from roboyard.kinematics.description_poses import forward_kinematics
from roboyard.transforms import Array

CASTER_NEAR, CASTER_SIZE = 0.01, 3.0
"""Height above the wheels' bottoms (m) and size, in radii of the wheels, of a fixed link that is a caster."""
SLIDING_NEAR = 0.02
"""Height above the lowest point of a base up to which its links are on the floor (m)."""


def fixed_casters(description: RobotDescription, semantic: SemanticDescription, radius: float) -> list[str]:
    """Return the small links fixed to the root that reach the floor: casters drawn without joints.

    Args:
        description: of the robot.
        semantic: of the robot.
        radius: of its driven wheels (m).
    """
    poses = forward_kinematics(description)
    wheels = [poses[w.link][2, 3] - radius for w in semantic.driven_wheels if w.link in poses]
    if not wheels:
        return []
    return [
        name
        for name, points in _rigid_points(description, ())
        if name != description.root.name
        and points[:, 2].min() < min(wheels) + CASTER_NEAR
        and np.ptp(points[:, :2], axis=0).max() < CASTER_SIZE * radius
    ]


def lowest_links(description: RobotDescription, semantic: SemanticDescription) -> list[str]:
    """Return the links of a base on virtual joints that reach the floor: they slide where the file draws no
    wheel with a joint.
    """
    points_of = _rigid_points(description, semantic.virtual_joints)
    lows = {name: float(points[:, 2].min()) for name, points in points_of}
    return [name for name, low in lows.items() if low < min(lows.values()) + SLIDING_NEAR]


def _rigid_points(description: RobotDescription, moved_by: tuple[str, ...]) -> Iterator[tuple[str, Array]]:
    """Yield the links of the base, and the (k, 3) vertices of their collision shapes in the root's frame (m).

    Args:
        description: the robot.
        moved_by: joints that move the base.
    """
    poses = forward_kinematics(description)
    names = [description.root.name]
    for name in names:
        below = description.child_joints[name]
        names += [joint.child for joint in below if joint.type == "fixed" or joint.name in moved_by]
    for name in names:
        try:
            meshes = shape_meshes(description.link_by_name[name].collisions)
        except MeshError:
            continue
        if meshes:
            points = np.concatenate([mesh.vertices for mesh in meshes])
            yield name, points @ poses[name][:3, :3].T + poses[name][:3, 3]
