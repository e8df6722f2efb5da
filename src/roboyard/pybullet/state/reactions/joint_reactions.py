"""Reaction forces and torques of joints, for enableJointForceTorqueSensor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.native import compiled
from roboyard.pybullet.face.constants import JOINT_PRISMATIC, JOINT_REVOLUTE
from roboyard.pybullet.state.bodies.joint_groups import NO_REACTION
from roboyard.pybullet.state.reactions import second_pass
from roboyard.pybullet.state.reactions.second_pass import cross, minus, plus, times, vector

if TYPE_CHECKING:
    from roboyard.pybullet.state.bodies.body_records import BodyRecord
    from roboyard.sim.world import World


class JointWrenches(NamedTuple):
    """Forces and torques in the joints above all links in the last step, in the axes of the world."""

    whole: np.ndarray
    """(nbody, 6) torques (N m), about the centre of mass of the link's tree, and forces (N)."""
    repeated: np.ndarray
    """(nbody, 6) forces and torques, at the link's own, that Bullet adds; see `second_pass`."""
    joints: np.ndarray
    """(nv,) efforts of motors and limits (N m or N)."""


class WrenchFinder:
    """Computes the forces and torques of the last step, in one world's arrays."""

    def __init__(self, world: World) -> None:
        """Look up the arrays, which are those of the world's present bodies."""
        from roboyard._mujoco import mujoco

        model, data = world.live_model, world.live_data
        self._world, self._revision, self._data = world, world.revision, data
        self._damping = world.surfaces.damping_of_all(model, data)
        self._links = second_pass.LINKS.of(
            second_pass.Links(
                parent=model.body_parentid, root=model.body_rootid,
                first_dof=model.body_dofadr, dofs=model.body_dofnum,
                mass=model.body_mass, inertia=model.body_inertia, damping=self._damping,
                axes=data.cdof, velocity=data.cvel, middle=data.xipos, turned=data.ximat,
                tree_middle=data.subtree_com, smooth=data.qacc_smooth,
            )
        )  # fmt: skip
        self._slides = model.jnt_type[model.dof_jntid] == int(mujoco.mjtJoint.mjJNT_SLIDE)
        self._room = np.empty((model.nbody, second_pass.MOVES)), np.empty((model.nbody, 6))

    @property
    def is_current(self) -> bool:
        """Whether the arrays are still those of the world."""
        world = self._world
        return (
            world.revision == self._revision
            and world.live_data is self._data
            and world.surfaces.damping_of_all(world.live_model, self._data) is self._damping
        )

    def find(self) -> JointWrenches:
        """Return what is in the joints."""
        from roboyard._mujoco import mujoco

        world, data, (motions, forces) = self._world, self._data, self._room
        world.find_reactions()
        model = world.live_model
        joints = world.stepping.forces.joint_forces(model)
        acceleration, efforts, wrenches = np.zeros(model.nv), np.empty(model.nv), np.empty((model.nbody, 6))
        pushes = np.where(self._slides, joints, 0.0)
        arguments = self._links, model.opt.timestep, pushes, acceleration, motions, wrenches, efforts
        second_pass.second_pass(*arguments)
        if model.nv:
            mujoco.mj_solveM(model, data, acceleration[None], -efforts[None])
            second_pass.second_pass(*arguments)
        second_pass.add_drag(self._links, forces, wrenches)
        return JointWrenches(data.cfrc_int, wrenches, joints)


def reaction(scene: Any, record: BodyRecord, joint: int) -> tuple[float, ...]:
    """Return the force (N) and torque (N m) in a joint during the last step, as six numbers.

    They act from the parent on the child link through the joint, at the child's centre of mass and in its
    inertial frame, without what its motor and its limits do along the joint's axis.
    """
    wrenches = scene.joint_wrenches()
    if wrenches is None:  # the world has changed since, or there was no step
        return record.reactions.get(joint, NO_REACTION)
    reader = record.reaction_reader
    if reader is None:
        reader = record.reaction_reader = ReactionReader(record, scene.world)
    return reader.read(wrenches, joint)


class ReactionReader:
    """Reads reactions of one body; valid until MuJoCo's arrays are new."""

    __slots__ = ("_axes", "_dofs", "_found", "_frames", "_kinds", "_of", "_out", "_places", "_rows")

    def __init__(self, record: BodyRecord, world: World) -> None:
        """Create the arrays for the joints of a body."""
        model, data, count = world.live_model, world.live_data, record.joint_count
        self._places = data.subtree_com, data.xipos, data.xquat, model.body_rootid
        self._frames = np.array([link.frame.quaternion for link in record.links[1:]])
        self._axes = np.array([info[13] for info in record.infos], float).reshape(count, 3)
        self._kinds = [_KINDS.get(record.joint_type(joint), OTHER) for joint in range(count)]
        self._dofs = [record.velocity_addresses[joint] for joint in range(count)]
        self._rows = record.rows
        self._out = np.zeros(6)
        self._of: JointWrenches | None = None
        self._found: dict[int, tuple[float, ...]] = {}
        """Numbers that were read of these wrenches, by joint."""

    def read(self, wrenches: JointWrenches, joint: int) -> tuple[float, ...]:
        """Return force (N) and torque (N m) in a joint."""
        if self._of is not wrenches:
            self._of = wrenches
            self._found.clear()
        elif joint in self._found:
            return self._found[joint]
        out, kind = self._out, self._kinds[joint]
        effort = 0.0 if kind == OTHER else wrenches.joints.item(self._dofs[joint])
        write_reaction(
            wrenches.whole, wrenches.repeated, *self._places, self._rows[joint + 1], self._frames,
            self._axes, joint, kind, effort, out,
        )  # fmt: skip
        found = self._found[joint] = tuple(out.tolist())
        return found


OTHER, SLIDES, TURNS = range(3)
_KINDS = {JOINT_PRISMATIC: SLIDES, JOINT_REVOLUTE: TURNS}


@compiled("f8[:,:] f8[:,::1] f8[:,:] f8[:,:] f8[:,:] i4[:] i8 f8[:,:] f8[:,:] i8 i8 f8 f8[:]")
def write_reaction(
    whole, repeated, centres, xipos, xquat, rootid, row, frames, axes, joint, kind, effort, out
):  # pragma: no cover
    """Write force and torque in a joint, in its link's inertial frame at the centre of mass, to `out` (6,).

    whole, repeated: see `JointWrenches`. centres: (nbody, 3) centres of mass of trees. row: of the link.
    frames: (n, 4) x, y, z, w of links' inertial frames in link frames. axes: (n, 3) of joints, in inertial
    frames. kind: `SLIDES`, `TURNS` or `OTHER`. effort: of the joint's motor and limits (N or N m).
    """
    apart = minus(vector(centres, rootid[row], 0), vector(xipos, row, 0))
    force = vector(whole, row, 3)
    torque = plus(plus(vector(whole, row, 0), cross(apart, force)), vector(repeated, row, 3))
    force = plus(force, vector(repeated, row, 0))
    w, x, y, z = xquat[row, 0], xquat[row, 1], xquat[row, 2], xquat[row, 3]
    i, j, k, r = frames[joint, 0], frames[joint, 1], frames[joint, 2], frames[joint, 3]
    turn = w * i + x * r + y * k - z * j, w * j + y * r + z * i - x * k, w * k + z * r + x * j - y * i
    real, axis = w * r - x * i - y * j - z * k, vector(axes, joint, 0)
    force, torque = turned_back(turn, real, force), turned_back(turn, real, torque)
    if kind == SLIDES:
        force = minus(force, times(effort, axis))
    elif kind == TURNS:
        torque = minus(torque, times(effort, axis))
    out[0], out[1], out[2] = force
    out[3], out[4], out[5] = torque


def turned_back(turn, real, a):  # pragma: no cover
    """Return a vector of the world in a frame with the quaternion of these imaginary parts and real part."""
    twice = times(2.0, cross(a, turn))
    return plus(plus(a, times(real, twice)), cross(twice, turn))
