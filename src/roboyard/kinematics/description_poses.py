"""Chains and forward kinematics of a description, in plain NumPy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.description.model import Joint, RobotDescription
from roboyard.errors import unknown_name
from roboyard.kinematics.joint_models import joint_transform, mimic_source, position_size
from roboyard.kinematics.joint_order import single_dof_joints
from roboyard.transforms import Array


def chain(description: RobotDescription, from_link: str, to_link: str) -> tuple[Joint, ...]:
    """Return the joints from one link to another: up to their common ancestor, then down.

    Raises:
        KeyError: no link has that name.
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
    """Return the pose of every link in the root link's frame, for one or many configurations.

    Multi-DOF joints take quaternions; see `joint_models` for the compiled alternative.

    Args:
        description: the robot.
        positions: joint name to position: (...) for single-DOF joints, (..., k) for joints with k entries
            (see `position_size`), rad and m; leading axes broadcast. Joints not named are at zero (multi-DOF
            joints at the identity), mimic joints not named follow their leaders. Or an array (..., n) of the
            n joints of `vector_joints`.

    Returns:
        Link name to (..., 4, 4) pose (m), with the broadcast leading axes of all positions.

    Raises:
        KeyError: no joint has that name.
        ValueError: a position has the wrong shape, or is for a fixed joint.
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
    """Return the joints of a position vector: single-DOF, no mimic joints, depth first in file order."""
    joints = single_dof_joints(description.depth_first_joints)
    return tuple(joint for joint in joints if joint.mimic is None)


def _values(
    description: RobotDescription, positions: Mapping[str, ArrayLike] | ArrayLike | None
) -> dict[str, Array]:
    """Return the (..., k) position of every joint that is not at zero, mimic joints included."""
    if positions is None:
        given: dict[str, Array] = {}
    elif isinstance(positions, Mapping):
        given = {name: _checked(description, name, value) for name, value in positions.items()}
    else:
        joints = vector_joints(description)
        array = np.asarray(positions, dtype=float)
        if array.ndim == 0 or array.shape[-1] != len(joints):
            raise ValueError(
                f"positions must have shape (..., {len(joints)}) (see vector_joints), got {array.shape}"
            )
        given = {joint.name: array[..., i : i + 1] for i, joint in enumerate(joints)}
    followers = [joint for joint in description.joints if joint.mimic is not None and joint.name not in given]
    for joint in followers:
        if position_size(joint) == 1:
            given[joint.name] = _mimicked(description, joint, given)
    return given


def _checked(description: RobotDescription, name: str, value: ArrayLike) -> Array:
    joint = description.joint_by_name.get(name)
    if joint is None:
        raise KeyError(unknown_name("joint", name, description.joint_by_name))
    size = position_size(joint)
    array = np.asarray(value, dtype=float)
    if size == 0:
        raise ValueError(f"joint {name!r} is fixed and has no position, got {value}")
    if size == 1:
        return array[..., None]
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(
            f"joint {name!r} ({joint.type}) takes positions of shape (..., {size}), got {array.shape}"
        )
    return array


def _mimicked(description: RobotDescription, joint: Joint, given: Mapping[str, Array]) -> Array:
    """Return the (..., 1) position of a mimic joint; its offset where the leader is at zero or missing."""
    source = mimic_source(description, joint, given)
    if source.leader is None or source.leader.name not in given:
        return np.full(1, source.offset)
    return source.multiplier * given[source.leader.name] + source.offset
