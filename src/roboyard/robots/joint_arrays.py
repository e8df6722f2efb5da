"""A robot's joints as arrays: where their numbers lie in MuJoCo, read and written in the robot's order."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.sim.world import World
from roboyard.transforms import Array

Indices = NDArray[np.intp]


class JointArrays:
    """n joints of one body; all vectors are (n,) in the order of `names`."""

    def __init__(self, body: Body, names: Sequence[str]) -> None:
        self.body = body
        self.names = tuple(names)
        self.joints: tuple[Joint, ...] = tuple(body.joint(name) for name in self.names)
        self.index = {name: i for i, name in enumerate(self.names)}
        self.driven: Indices = np.array(
            [i for i, joint in enumerate(self.joints) if joint._built.actuator is not None], dtype=np.intp
        )
        """Joints that have a drive; mimics have none."""
        self.drives = World.of(body).drives.vector([self.joints[i] for i in self.driven])
        self._revision = -1
        self._damping = np.zeros(len(self.names))
        self._qpos = self._dofs = self._diagonal = np.zeros(0, dtype=np.intp)
        self._full = np.zeros((0, 0))

    @property
    def world(self) -> World:
        return World.of(self.body)

    def places(self, names: Sequence[str]) -> Indices:
        """Where these joints stand in the vectors."""
        return np.array([self.index[name] for name in names], dtype=np.intp)

    def bind(self) -> bool:
        """Find the joints in freshly compiled arrays; whether there was anything to do."""
        world = self.body.world
        world.ensure_compiled()
        if self._revision == world.revision:
            return False
        body = self.body
        order = [joint.index for joint in self.joints]
        self._qpos = body.qpos_addresses[order].astype(np.intp)
        self._dofs = body.dof_addresses[order].astype(np.intp)
        self._full = np.zeros((world.model.nv, world.model.nv))
        self._diagonal = (world.model.M_rowadr + world.model.M_rownnz - 1)[self._dofs]
        self._damping = np.array([joint.damping for joint in self.joints])
        self._revision = world.revision
        return True

    def refresh(self) -> None:
        """Work out forces and inertias of the present positions, as a step would."""
        self.bind()
        mujoco.mj_forward(self.world.model, self.world.data)

    @property
    def q(self) -> Array:
        """Rad or m"""
        self.bind()
        return self.world.data.qpos[self._qpos]

    @q.setter
    def q(self, values: Array) -> None:
        self.bind()
        self.world.data.qpos[self._qpos] = values
        self.world.mark_moved()

    @property
    def v(self) -> Array:
        """rad/s or m/s"""
        self.bind()
        return self.world.data.qvel[self._dofs]

    @v.setter
    def v(self, values: Array) -> None:
        self.bind()
        self.world.data.qvel[self._dofs] = values
        self.world.mark_moved()

    @property
    def bias(self) -> Array:
        """N m or N that gravity, Coriolis and centrifugal forces took at the last step."""
        return self.world.data.qfrc_bias[self._dofs]

    @property
    def efforts(self) -> Array:
        """N m or N that the drives applied in the last step; 0 where there is none."""
        found = np.zeros(len(self.names))
        found[self.driven] = self.drives.applied
        return found

    @property
    def damping(self) -> Array:
        """N m s/rad or N s/m that resist each joint's motion; what velocity drives add to their effort."""
        return self._damping

    @property
    def friction(self) -> Array:
        """N m or N of dry friction in each joint."""
        return self.world.model.dof_frictionloss[self._dofs]

    @property
    def dofs(self) -> Indices:
        """(n,) of the joints in MuJoCo's velocities."""
        self.bind()
        return self._dofs

    @property
    def inertia(self) -> Array:
        """Kg m² or kg that each joint moved at the last step, all others held."""
        return self.world.data.M[self._diagonal]

    def mass_matrix(self, places: Indices) -> Array:
        """(k, k) joint-space inertia of some joints at the last step, all others held."""
        mujoco.mj_fullM(self.world.model, self.world.data, self._full)
        dofs = self._dofs[places]
        return self._full[np.ix_(dofs, dofs)]
