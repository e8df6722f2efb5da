"""Reaction forces and torques of joints, for enableJointForceTorqueSensor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face.constants import JOINT_PRISMATIC
from roboyard.pybullet.state.joint_groups import NO_REACTION

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
    tx, ty, tz, fx, fy, fz = wrenches[row].tolist()
    rx, ry, rz = (data.subtree_com[model.body_rootid[row]] - data.xipos[row]).tolist()
    tx, ty, tz = tx + ry * fz - rz * fy, ty + rz * fx - rx * fz, tz + rx * fy - ry * fx
    turn = _inertial_turn(data.xquat[row].tolist(), record.links[joint + 1].frame.quaternion)
    force, torque = _turned_back(turn, fx, fy, fz), _turned_back(turn, tx, ty, tz)
    applied = scene.applied(record, joint)
    if isinstance(applied, float):
        effort = applied * scene.parts
        ax, ay, az = (effort * float(part) for part in record.infos[joint][13])
        if record.joint_type(joint) == JOINT_PRISMATIC:
            force = force[0] - ax, force[1] - ay, force[2] - az
        else:
            torque = torque[0] - ax, torque[1] - ay, torque[2] - az
    return (*force, *torque)


def _inertial_turn(wxyz: Sequence[float], frame: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the quaternion x, y, z, w of a link's turn, which is w, x, y, z, and that of a frame in it."""
    w, x, y, z = wxyz
    i, j, k, r = frame
    return (
        w * i + x * r + y * k - z * j,
        w * j + y * r + z * i - x * k,
        w * k + z * r + x * j - y * i,
        w * r - x * i - y * j - z * k,
    )


def _turned_back(
    turn: tuple[float, float, float, float], a: float, b: float, c: float
) -> tuple[float, float, float]:
    """Return a vector (a, b, c) of the world in a frame with the quaternion x, y, z, w."""
    x, y, z, w = turn
    u, v, t = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return a + w * u + v * z - t * y, b + w * v + t * x - u * z, c + w * t + u * y - v * x
