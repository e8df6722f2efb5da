"""Reaction forces and torques of joints, for enableJointForceTorqueSensor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.pybullet.face.constants import JOINT_PRISMATIC, JOINT_REVOLUTE
from roboyard.pybullet.state.joint_groups import NO_REACTION
from roboyard.pybullet.state.reactions import second_pass

if TYPE_CHECKING:
    from roboyard.pybullet.state.body_records import BodyRecord
    from roboyard.sim.world import World


class JointWrenches(NamedTuple):
    """Forces and torques in the joints above all links in the last step, in the axes of the world."""

    whole: np.ndarray
    """(nbody, 6) torques (N m), about the centre of mass of the link's tree, and forces (N)."""
    repeated: np.ndarray
    """(nbody, 6) forces and torques, at the link's own, that Bullet adds; see `second_pass`."""
    joints: np.ndarray
    """(nv,) efforts of motors and limits (N m or N)."""


def find_wrenches(world: World) -> JointWrenches:
    """Compute the forces and torques of the last step."""
    from roboyard._mujoco import mujoco

    world.find_reactions()
    model, data = world.live_model, world.live_data
    links = second_pass.LINKS.of(
        second_pass.Links(
            parent=model.body_parentid, root=model.body_rootid,
            first_dof=model.body_dofadr, dofs=model.body_dofnum,
            mass=model.body_mass, inertia=model.body_inertia,
            damping=world.surfaces.damping_of_all(model, data),
            axes=data.cdof, velocity=data.cvel, middle=data.xipos, turned=data.ximat,
            tree_middle=data.subtree_com, smooth=data.qacc_smooth,
        )
    )  # fmt: skip
    acceleration, efforts = np.zeros(model.nv), np.zeros(model.nv)
    motions, wrenches = np.empty((model.nbody, second_pass.MOVES)), np.empty((model.nbody, 6))
    slides = model.jnt_type[model.dof_jntid] == int(mujoco.mjtJoint.mjJNT_SLIDE)
    joints = world.stepping.joint_forces(model)
    pushes = np.where(slides, joints, 0.0)
    arguments = links, model.opt.timestep, pushes, acceleration, motions, wrenches, efforts
    second_pass.second_pass(*arguments)
    if model.nv:
        mujoco.mj_solveM(model, data, acceleration[None], -efforts[None])
        second_pass.second_pass(*arguments)
    second_pass.add_drag(links, np.empty((model.nbody, 6)), wrenches)
    return JointWrenches(data.cfrc_int, wrenches, joints)


def reaction(scene: Any, record: BodyRecord, joint: int) -> tuple[float, ...]:
    """Return the force (N) and torque (N m) in a joint during the last step, as six numbers.

    They act from the parent on the child link through the joint, at the child's centre of mass and in its
    inertial frame, without what its motor and its limits do along the joint's axis.
    """
    wrenches = scene.joint_wrenches()
    if wrenches is None:  # the world has changed since, or there was no step
        return record.reactions.get(joint, NO_REACTION)
    model, data = scene.world.live_model, scene.world.live_data
    row = record.rows[joint + 1]
    tx, ty, tz, fx, fy, fz = wrenches.whole[row].tolist()
    rx, ry, rz = (data.subtree_com[model.body_rootid[row]] - data.xipos[row]).tolist()
    gx, gy, gz, ux, uy, uz = wrenches.repeated[row].tolist()
    tx, ty, tz = tx + ry * fz - rz * fy + ux, ty + rz * fx - rx * fz + uy, tz + rx * fy - ry * fx + uz
    fx, fy, fz = fx + gx, fy + gy, fz + gz
    turn = _inertial_turn(data.xquat[row].tolist(), record.links[joint + 1].frame.quaternion)
    force, torque = _turned_back(turn, fx, fy, fz), _turned_back(turn, tx, ty, tz)
    dofs = record.velocities_of(joint)
    if record.joint_type(joint) in (JOINT_REVOLUTE, JOINT_PRISMATIC):
        effort = wrenches.joints.item(dofs.start)
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
