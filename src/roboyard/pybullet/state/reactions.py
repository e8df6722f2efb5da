"""Reaction forces and torques of joints, for enableJointForceTorqueSensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.native import compiled
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
    reader = record.reaction_reader
    if reader is None:
        reader = record.reaction_reader = ReactionReader(record, scene.world)
    if record.is_scalar[joint] and record.motored[joint]:
        effort = scene.motor_forces().item(record.velocity_addresses[joint])
    else:
        effort = record.applied[joint]
    return reader.read(wrenches, joint, effort * scene.parts if type(effort) is float else 0.0)


class ReactionReader:
    """Reads reactions of one body; valid until MuJoCo's arrays are new."""

    __slots__ = ("_axes", "_frames", "_out", "_places", "_rows", "_slides")

    def __init__(self, record: BodyRecord, world: Any) -> None:
        model, data, count = world.live_model, world.live_data, record.joint_count
        self._places = data.subtree_com, data.xipos, data.xquat, model.body_rootid
        self._frames = np.array([link.frame.quaternion for link in record.links[1:]])
        self._axes = np.array([info[13] for info in record.infos], float).reshape(count, 3)
        self._slides = [int(record.joint_type(joint) == JOINT_PRISMATIC) for joint in range(count)]
        self._rows = record.rows
        self._out = np.zeros(6)

    def read(self, wrenches: Any, joint: int, effort: float) -> tuple[float, ...]:
        """Return force (N) and torque (N m) in a joint.

        Args:
            wrenches: (nbody, 6) torques and forces in joints, in world axes, about trees' centres of mass.
            joint: index of the joint.
            effort: of its motor along its axis (N m or N).
        """
        out = self._out
        write_reaction(
            wrenches, *self._places, self._rows[joint + 1], self._frames, self._axes, joint,
            self._slides[joint], effort, out,
        )  # fmt: skip
        return tuple(out.tolist())


@compiled("f8[:,:] f8[:,:] f8[:,:] f8[:,:] i4[:] i8 f8[:,:] f8[:,:] i8 i8 f8 f8[:]")
def write_reaction(
    wrenches, centres, xipos, xquat, rootid, row, frames, axes, joint, slides, effort, out
):  # pragma: no cover
    """Write force and torque in a joint, in its link's inertial frame at the centre of mass, to `out` (6,).

    wrenches: (nbody, 6) torque and force in world axes, about the centre of mass of the tree (`centres`).
    row: of the link. frames: (n, 4) x, y, z, w of links' inertial frames in link frames. axes: (n, 3) of
    joints, in inertial frames. slides: 1 where the motor has a force. effort: of the motor.
    """
    root = rootid[row]
    tx, ty, tz = wrenches[row, 0], wrenches[row, 1], wrenches[row, 2]
    fx, fy, fz = wrenches[row, 3], wrenches[row, 4], wrenches[row, 5]
    rx, ry, rz = (
        centres[root, 0] - xipos[row, 0],
        centres[root, 1] - xipos[row, 1],
        centres[root, 2] - xipos[row, 2],
    )
    tx, ty, tz = tx + ry * fz - rz * fy, ty + rz * fx - rx * fz, tz + rx * fy - ry * fx
    w, x, y, z = xquat[row, 0], xquat[row, 1], xquat[row, 2], xquat[row, 3]
    i, j, k, r = frames[joint, 0], frames[joint, 1], frames[joint, 2], frames[joint, 3]
    qx, qy, qz = w * i + x * r + y * k - z * j, w * j + y * r + z * i - x * k, w * k + z * r + x * j - y * i
    qw = w * r - x * i - y * j - z * k
    out[0], out[1], out[2] = _turned_back(qx, qy, qz, qw, fx, fy, fz)
    out[3], out[4], out[5] = _turned_back(qx, qy, qz, qw, tx, ty, tz)
    first = 0 if slides else 3
    for m in range(3):
        out[first + m] -= effort * axes[joint, m]


def _turned_back(x, y, z, w, a, b, c):  # pragma: no cover
    """Return a vector (a, b, c) of the world in a frame with the quaternion x, y, z, w."""
    u, v, t = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return a + w * u + v * z - t * y, b + w * v + t * x - u * z, c + w * t + u * y - v * x
