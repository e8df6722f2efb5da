"""Turn a robot whose file is drawn with another axis up, so that it stands on its legs or wheels.

The root link's frame turns: z is up and x forwards. Its shapes, centre of mass and child joints turn the
other way; all other links and joints stay as they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from roboyard.description.loops import reframed
from roboyard.description.model import Collision, Link, Pose, Quaternion, RobotDescription, Vector3
from roboyard.description.semantic import SemanticDescription
from roboyard.morphology.skeleton import Skeleton, is_endless
from roboyard.transforms import Array, multiply, quaternion_from_matrix

UPRIGHT = 0.5
"""Least z component of the upward direction of a robot that needs no turn."""
ALONG = 0.97
"""Least |cosine| between z and the axles of a robot that is drawn on its side."""


def turn_to_upright(semantic: SemanticDescription) -> Array | None:
    """Return the (3, 3) rotation from the root link's frame to one with z up and x forwards; None for a robot
    that is upright, or stands neither on legs nor on wheels.
    """
    up, forward = np.asarray(semantic.up, dtype=float), np.asarray(semantic.forward, dtype=float)
    stands = semantic.base == "legged" or bool(semantic.driven_wheels)
    if up[2] >= UPRIGHT or abs(float(up @ forward)) > 1e-6 or not stands:
        return None
    return np.stack([forward, np.cross(up, forward), up])


def standing_orientation(semantic: SemanticDescription) -> Quaternion | None:
    """Return the orientation (x, y, z, w) of the root link's frame in which a robot stands with z up and
    x forwards; None for a robot that is upright, or stands neither on legs nor on wheels.
    """
    rotation = turn_to_upright(semantic)
    if rotation is None:
        return None
    x, y, z, w = (round(float(value), 9) + 0.0 for value in quaternion_from_matrix(rotation))
    return (x, y, z, w)


def sideways_wheels(skeleton: Skeleton) -> list[Array]:
    """Return the (3, 3) rotations after which a robot may stand on its wheels, from its file's frame.

    Mechanical engineers' programs draw with y up; the axles of such a file are along z. There is nothing to
    try unless the robot has at least two joints without limits, all along z.
    """
    loose = [name for name, joint in skeleton.joint.items() if is_endless(joint)]
    if len(loose) < 2 or any(abs(float(skeleton.axis(name)[2])) < ALONG for name in loose):
        return []
    found = []
    for up in ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)):
        across = np.array([0.0, 0.0, 1.0])
        found.append(np.stack([np.cross(across, up), across, up]))
    return found


def seen_from(semantic: SemanticDescription, rotation: Array) -> SemanticDescription:
    """Return the semantics of a turned robot with its directions and wheels in the file's frame.

    Args:
        semantic: of the turned robot.
        rotation: (3, 3) from the file's frame to the turned one.
    """
    return replace(
        semantic,
        up=_back(semantic.up, rotation),
        forward=_back(semantic.forward, rotation),
        wheels=tuple(replace(w, centre=_back(w.centre, rotation)) for w in semantic.wheels),
    )


def _back(vector: Vector3, rotation: Array) -> Vector3:
    x, y, z = (float(value) + 0.0 for value in np.asarray(vector) @ rotation)
    return (x, y, z)


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
            replace(joint, origin=turned_pose(joint.origin, rotation)) if joint.parent == root else joint
            for joint in description.joints
        ),
        loops=reframed(description.loops, root, lambda pose: turned_pose(pose, rotation)),
    )


def _turned_link(link: Link, rotation: Array) -> Link:
    inertial = link.inertial
    if inertial is not None:
        inertial = replace(inertial, origin=turned_pose(inertial.origin, rotation))
    return replace(
        link,
        inertial=inertial,
        visuals=tuple(replace(v, origin=turned_pose(v.origin, rotation)) for v in link.visuals),
        collisions=tuple(turned_collision(c, rotation) for c in link.collisions),
    )


def turned_collision(collision: Collision, rotation: Array) -> Collision:
    """Return a shape of a link whose frame turns by a (3, 3) rotation, from the old frame to the new one."""
    return replace(collision, origin=turned_pose(collision.origin, rotation))


def turned_pose(pose: Pose, rotation: Array) -> Pose:
    """Return a pose in a frame that turns by a (3, 3) rotation, from the old frame to the new one."""
    position = rotation @ np.asarray(pose.position)
    quaternion = multiply(quaternion_from_matrix(rotation), np.asarray(pose.quaternion))
    x, y, z = (float(value) + 0.0 for value in position)
    qx, qy, qz, qw = (float(value) + 0.0 for value in quaternion)
    return Pose(position=(x, y, z), quaternion=(qx, qy, qz, qw))
