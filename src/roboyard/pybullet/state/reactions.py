"""Reaction forces and torques of joints, for enableJointForceTorqueSensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet.face.constants import JOINT_PRISMATIC
from roboyard.pybullet.state.joint_groups import NO_REACTION
from roboyard.transforms import Array, matrix_from_quaternion, multiply

if TYPE_CHECKING:
    from roboyard.pybullet.state.body_records import BodyRecord


def reaction(scene: Any, record: BodyRecord, joint: int) -> tuple[float, ...]:
    """Return the force (N) and torque (N m) in a joint during the last step, as six numbers.

    They act from the parent on the child link through the joint, at the child's centre of mass and in its
    inertial frame, without the effort of the motor along the joint's axis.
    """
    wrenches = scene.joint_wrenches()
    if wrenches is None:  # the world has changed since, or there was no step
        return record.reactions.get(joint, NO_REACTION)
    model, data = scene.world.live_model, scene.world.live_data
    row = record.rows[joint + 1]
    torque, force = wrenches[row, :3], wrenches[row, 3:]
    at_root = data.subtree_com[model.body_rootid[row]]
    torque = torque + np.cross(at_root - data.xipos[row], force)
    axes = _inertial_axes(record, joint, data.xquat[row])
    force, torque = axes.T @ force, axes.T @ torque
    applied = scene.applied(record, joint)
    if isinstance(applied, float):
        pushed = force if record.joint_type(joint) == JOINT_PRISMATIC else torque
        pushed -= applied * scene.parts * np.asarray(record.infos[joint][13])
    return (*force.tolist(), *torque.tolist())


def _inertial_axes(record: BodyRecord, joint: int, wxyz: Array) -> Array:
    w, x, y, z = wxyz
    return matrix_from_quaternion(multiply((x, y, z, w), record.links[joint + 1].frame.quaternion))
