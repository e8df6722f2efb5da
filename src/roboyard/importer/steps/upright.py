"""Turn a robot whose file is drawn with another axis up, so that it stands on its legs.

The root link's frame turns: z is up and x forwards. Its shapes, centre of mass and child joints turn the
other way; all other links and joints stay as they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard.description.model import Link, Pose, RobotDescription
from roboyard.description.semantic import SemanticDescription
from roboyard.transforms import Array, multiply, quaternion_from_matrix

UPRIGHT = 0.5
"""Least z component of the upward direction of a robot that needs no turn."""


def turn_to_upright(semantic: SemanticDescription) -> Array | None:
    """Return the (3, 3) rotation from the root link's frame to one with z up and x forwards; None for a robot
    that is upright, or whose base moves by joints of its file.
    """
    up, forward = np.asarray(semantic.up, dtype=float), np.asarray(semantic.forward, dtype=float)
    if up[2] >= UPRIGHT or abs(float(up @ forward)) > 1e-6 or semantic.base != "legged":
        return None
    return np.stack([forward, np.cross(up, forward), up])


def turned(description: RobotDescription, rotation: Array) -> RobotDescription:
    """Return the robot with its root link's frame turned.

    Args:
        description: the robot.
        rotation: (3, 3) from the old frame to the new one.
    """
    root = description.root.name
    return replace(
        description,
        links=tuple(_turned_link(x, rotation) if x.name == root else x for x in description.links),
        joints=tuple(
            replace(joint, origin=_turned_pose(joint.origin, rotation)) if joint.parent == root else joint
            for joint in description.joints
        ),
    )


def _turned_link(link: Link, rotation: Array) -> Link:
    inertial = link.inertial
    if inertial is not None:
        inertial = replace(inertial, origin=_turned_pose(inertial.origin, rotation))
    return replace(
        link,
        inertial=inertial,
        visuals=tuple(replace(v, origin=_turned_pose(v.origin, rotation)) for v in link.visuals),
        collisions=tuple(replace(c, origin=_turned_pose(c.origin, rotation)) for c in link.collisions),
    )


def _turned_pose(pose: Pose, rotation: Array) -> Pose:
    position = rotation @ np.asarray(pose.position)
    quaternion = multiply(quaternion_from_matrix(rotation), np.asarray(pose.quaternion))
    x, y, z = (float(value) + 0.0 for value in position)
    qx, qy, qz, qw = (float(value) + 0.0 for value in quaternion)
    return Pose(position=(x, y, z), quaternion=(qx, qy, qz, qw))
