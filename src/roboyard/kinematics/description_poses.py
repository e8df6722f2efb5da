"""Where the links are: chains and forward kinematics of a description."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import unknown_name
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.transforms import (
    Array,
    normalized,
    pose_matrix,
    quaternion_from_axis_angle,
)

_SIZE = {
    "revolute": 1,
    "continuous": 1,
    "prismatic": 1,
    "planar": 3,
    "floating": 7,
    "spherical": 4,
    "fixed": 0,
}


def position_size(joint: Joint) -> int:
    """Numbers that `forward_kinematics` takes for one joint.

    1 for revolute, continuous (rad) and prismatic (m); planar 3 (x, y in m, angle in rad about the axis);
    spherical 4 (quaternion x, y, z, w); floating 7 (position in m, then quaternion x, y, z, w); fixed 0.
    """
    return _SIZE[joint.type]


def chain(description: RobotDescription, from_link: str, to_link: str) -> tuple[Joint, ...]:
    """Joints on the way from one link to another: up to their common ancestor, then down.

    Raises:
        KeyError: a link of that name does not exist.
    """
    up = _path_to_root(description, from_link)
    down = _path_to_root(description, to_link)
    while up and down and up[-1] is down[-1]:
        up.pop()
        down.pop()
    return (*up, *reversed(down))


def _path_to_root(description: RobotDescription, link: str) -> list[Joint]:
    if link not in description.link_by_name:
        raise KeyError(unknown_name("link", link, description.link_by_name))
    path: list[Joint] = []
    while (joint := description.parent_joint.get(link)) is not None:
        path.append(joint)
        link = joint.parent
    return path


def forward_kinematics(
    description: RobotDescription, positions: Mapping[str, ArrayLike] | ArrayLike | None = None
) -> dict[str, Array]:
    """Pose of every link in the root link's frame, for one or many configurations.

    Args:
        positions: joint name to position, (...) for one number a joint and (..., k) for joints of k numbers
            (see `position_size`); leading axes broadcast. Joints not named are at zero (multi-dof joints at
            the identity), mimic joints not named follow theirs. Or an array (..., n) of the n moving joints
            of one number that mimic no other, in the order of `vector_joints`.

    Returns:
        Link name to (..., 4, 4); the leading axes are those of all positions broadcast together.

    Raises:
        KeyError: a joint of that name does not exist.
        ValueError: a position has the wrong shape, or names a fixed joint.
    """
    values = _values(description, positions)
    batch = np.broadcast_shapes(*(value.shape[:-1] for value in values.values()))
    root = np.broadcast_to(np.eye(4), (*batch, 4, 4))
    poses: dict[str, Array] = {description.root.name: root}
    for joint in description.depth_first_joints:
        local = joint.origin.matrix()
        if joint.name in values:
            local = local @ joint_transform(joint, values[joint.name])
        poses[joint.child] = poses[joint.parent] @ local
    return {link.name: poses[link.name] for link in description.links}


def vector_joints(description: RobotDescription) -> tuple[Joint, ...]:
    """The joints that an array of positions holds: one number each, no mimics, depth first in file order."""
    joints = single_dof_joints(description.depth_first_joints)
    return tuple(joint for joint in joints if joint.mimic is None)


def joint_transform(joint: Joint, position: ArrayLike) -> Array:
    """(..., 4, 4) pose of the child frame after the joint's motion, in the child frame at position zero.

    Args:
        position: (..., k) with k = `position_size(joint)`.
    """
    q = np.asarray(position, dtype=float)
    axis = np.asarray(joint.axis)
    match joint.type:
        case "revolute" | "continuous":
            return pose_matrix(np.zeros(3), quaternion_from_axis_angle(axis, q[..., 0]))
        case "prismatic":
            return pose_matrix(axis * q)
        case "planar":
            first, second = plane_axes(axis)
            shift = first * q[..., 0:1] + second * q[..., 1:2]
            return pose_matrix(shift, quaternion_from_axis_angle(axis, q[..., 2]))
        case "spherical":
            return pose_matrix(np.zeros(3), normalized(q))
        case "floating":
            return pose_matrix(q[..., :3], normalized(q[..., 3:]))
        case _:
            return np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4))


def plane_axes(normal: ArrayLike) -> tuple[Array, Array]:
    """Two unit (3,) axes that span the plane of a planar joint, right-handed with its unit normal.

    x and y for the normal z, and likewise (y, z) for x and (z, x) for y: the frame whose third axis is the
    normal and which is reached from those by the smallest turn.
    """
    n = np.asarray(normal, dtype=float)
    k = int(np.argmax(np.abs(n)))
    first = np.eye(3)[(k + 1) % 3]
    first = first - n * (first @ n)
    first /= np.linalg.norm(first)
    return first, np.cross(n, first)


def _values(
    description: RobotDescription, positions: Mapping[str, ArrayLike] | ArrayLike | None
) -> dict[str, Array]:
    """(..., k) position of every joint that is not at rest, mimics included."""
    if positions is None:
        given: dict[str, Array] = {}
    elif isinstance(positions, Mapping):
        given = {name: _checked(description, name, value) for name, value in positions.items()}
    else:
        joints = vector_joints(description)
        array = np.asarray(positions, dtype=float)
        if array.ndim == 0 or array.shape[-1] != len(joints):
            raise ValueError(
                f"positions of shape {array.shape}; give (..., {len(joints)}), see vector_joints"
            )
        given = {joint.name: array[..., i : i + 1] for i, joint in enumerate(joints)}
    followers = [joint for joint in description.joints if joint.mimic is not None and joint.name not in given]
    for joint in followers:
        if position_size(joint) == 1:
            given[joint.name] = _followed(description, joint, given)
    return given


def _checked(description: RobotDescription, name: str, value: ArrayLike) -> Array:
    joint = description.joint_by_name.get(name)
    if joint is None:
        raise KeyError(unknown_name("joint", name, description.joint_by_name))
    size = position_size(joint)
    array = np.asarray(value, dtype=float)
    if size == 0:
        raise ValueError(f"joint {name!r} is fixed; it takes no position")
    if size == 1:
        return array[..., None]
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"joint {name!r} ({joint.type}) takes (..., {size}) numbers, not {array.shape}")
    return array


def _followed(description: RobotDescription, joint: Joint, given: Mapping[str, Array]) -> Array:
    """(..., 1) position of a mimic joint, through as many joints as follow each other."""
    multiplier, offset = 1.0, 0.0
    current: Joint | None = joint
    while (
        current is not None and current.mimic is not None and (current is joint or current.name not in given)
    ):
        offset += multiplier * current.mimic.offset
        multiplier *= current.mimic.multiplier
        leader = description.joint_by_name.get(current.mimic.joint)
        if leader is None or leader is joint:
            return np.full(1, offset)
        current = leader
    if current is None or current.name not in given or given[current.name].shape[-1] != 1:
        return np.full(1, offset)
    return multiplier * given[current.name] + offset
