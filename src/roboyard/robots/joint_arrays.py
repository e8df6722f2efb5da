"""A robot's joints as arrays: views of MuJoCo's state in the robot's joint order."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from roboyard._arrays import NDArray
from roboyard._mujoco import mujoco
from roboyard.sim.body import Body
from roboyard.sim.joint import Joint
from roboyard.sim.world import World
from roboyard.transforms import Array

Indices = NDArray[np.intp]
"""(k,) indices into joint vectors."""


class JointArrays:
    """n joints of one body; all vectors are (n,) in the order of `names`."""

    def __init__(self, body: Body, names: Sequence[str]) -> None:
        """Create the arrays of a body's joints of these names."""
        self.body = body
        self.names = tuple(names)
        self.joints: tuple[Joint, ...] = tuple(body.joint(name) for name in self.names)
        self.index = {name: i for i, name in enumerate(self.names)}
        """Joint name to its index in the vectors."""
        self.driven: Indices = np.array(
            [i for i, joint in enumerate(self.joints) if joint._built.actuator is not None], dtype=np.intp
        )
        """(k,) indices of the joints that have a drive; mimic joints have none."""
        self.drives = World.of(body).drives.vector([self.joints[i] for i in self.driven])
        self._revision = -1
        self._damping = np.zeros(len(self.names))
        self._qpos = self._dofs = self._diagonal = np.zeros(0, dtype=np.intp)
        self._full = np.zeros((0, 0))

    @property
    def world(self) -> World:
        """The world of the body."""
        return World.of(self.body)

    def indices_of(self, names: Iterable[str]) -> Indices:
        """Return the (k,) indices of joints in the vectors, in the order of their `names`."""
        return np.array([self.index[name] for name in names], dtype=np.intp)

    def bind(self) -> bool:
        """Find the joints in MuJoCo's arrays after a compilation; return whether there was one."""
        world = World.of(self.body)
        world.ensure_compiled()
        if self._revision == world.revision:
            return False
        body = self.body
        order = [joint.index for joint in self.joints]
        self._qpos = body.qpos_addresses[order].astype(np.intp)
        self._dofs = body.dof_addresses[order].astype(np.intp)
        self._full = np.zeros((world.live_model.nv, world.live_model.nv))
        self._diagonal = (world.live_model.M_rowadr + world.live_model.M_rownnz - 1)[self._dofs]
        self._damping = np.array([joint.damping for joint in self.joints])
        self._revision = world.revision
        return True

    def refresh(self) -> None:
        """Compute forces and inertias at the present positions, as a time step does."""
        self.bind()
        mujoco.mj_forward(self.world.live_model, self.world.live_data)

    @property
    def q(self) -> Array:
        """(n,) joint positions (rad or m)."""
        self.bind()
        return self.world.live_data.qpos[self._qpos]

    @q.setter
    def q(self, values: Array) -> None:
        self.bind()
        self.world.live_data.qpos[self._qpos] = values
        self.world.mark_moved()

    @property
    def v(self) -> Array:
        """(n,) joint velocities (rad/s or m/s)."""
        self.bind()
        return self.world.live_data.qvel[self._dofs]

    @v.setter
    def v(self, values: Array) -> None:
        self.bind()
        self.world.live_data.qvel[self._dofs] = values
        self.world.mark_moved()

    @property
    def bias(self) -> Array:
        """(n,) effort of gravity, Coriolis and centrifugal forces at the last step (N m or N)."""
        return self.world.live_data.qfrc_bias[self._dofs]

    @property
    def efforts(self) -> Array:
        """(n,) effort of the drives in the last step (N m or N); 0 for joints without a drive."""
        found = np.zeros(len(self.names))
        found[self.driven] = self.drives.applied
        return found

    @property
    def damping(self) -> Array:
        """(n,) viscous damping of the joints (N m s/rad or N s/m), which velocity drives compensate."""
        return self._damping

    @property
    def friction(self) -> Array:
        """(n,) dry friction of the joints (N m or N)."""
        return self.world.live_model.dof_frictionloss[self._dofs]

    @property
    def dofs(self) -> Indices:
        """(n,) indices of the joints in MuJoCo's velocity vector."""
        self.bind()
        return self._dofs

    @property
    def inertia(self) -> Array:
        """(n,) inertia of each joint at the last step, all others fixed (kg m² or kg)."""
        return self.world.live_data.M[self._diagonal]

    def mass_matrix(self, indices: Indices) -> Array:
        """Return the joint-space inertia of some joints at the last step, all others fixed.

        Args:
            indices: (k,) of the joints in the vectors.

        Returns:
            (k, k) in kg m², kg m or kg.
        """
        mujoco.mj_fullM(self.world.live_model, self.world.live_data, self._full)
        dofs = self._dofs[indices]
        return self._full[np.ix_(dofs, dofs)]
