"""The drives of several joints as arrays: a control step of a whole robot is a few array writes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from roboyard.errors import RoboyardError
from roboyard.sim.body import Body
from roboyard.sim.engine import Engine
from roboyard.sim.joint import Joint
from roboyard.transforms import Array


class DriveArrays:
    """The drives of n joints; each applies kp (position - q) + kd (velocity - v) + effort within its limit.

    Arrays are (n,) in the order of the joints given. Joints without a drive (mimics) are an error.
    """

    def __init__(self, world: Engine[Body], joints: Sequence[Joint]) -> None:
        self._world = world
        self.joints = tuple(joints)
        self._elements = []
        for joint in self.joints:
            if joint._built.actuator is None:
                raise RoboyardError(f"joint {joint.name!r} of {joint.body.name!r} has no drive")
            self._elements.append(joint._built.actuator)
        self._revision = -1
        self._rows = np.zeros(0, dtype=np.intp)
        self._position = self._velocity = self._effort = self._rows

    def __len__(self) -> int:
        return len(self.joints)

    def _bind(self) -> None:
        world = self._world
        world.ensure_compiled()
        if self._revision == world.revision:
            return
        self._rows = np.array([element.id for element in self._elements], dtype=np.intp)
        self._position = world.live_model.actuator_ctrladr[self._rows].astype(np.intp)
        self._velocity, self._effort = self._position + 1, self._position + 2
        self._revision = world.revision

    def write(self, position: Array, velocity: Array, effort: Array) -> None:
        """Write all inputs; those whose gain is zero have no effect.

        Args:
            position: (n,) targets (rad or m).
            velocity: (n,) targets (rad/s or m/s).
            effort: (n,) feedforward (N m or N).
        """
        if self._revision != self._world.revision or self._world.is_stale:
            self._bind()
        ctrl = self._world.live_data.ctrl
        ctrl[self._position] = position
        ctrl[self._velocity] = velocity
        ctrl[self._effort] = effort

    def write_effort(self, effort: Array, where: np.ndarray) -> None:
        """Write the effort inputs (k,) (N m or N) of the joints at the indices `where` (k,)."""
        if self._revision != self._world.revision or self._world.is_stale:
            self._bind()
        self._world.live_data.ctrl[self._effort[where]] = effort

    def write_gains(self, stiffness: Array, damping: Array) -> None:
        """Write the gains of all joints, which last until bodies are added or removed.

        Robots write them at every control step.

        Args:
            stiffness: (n,) kp (N m/rad or N/m).
            damping: (n,) kd (N m s/rad or N s/m).
        """
        if self._revision != self._world.revision or self._world.is_stale:
            self._bind()
        bias = self._world.live_model.actuator_biasprm
        bias[self._rows, 1] = -stiffness
        bias[self._rows, 2] = -damping

    @property
    def inputs(self) -> tuple[Array, Array, Array]:
        """Position, velocity and effort inputs, each (n,)."""
        self._bind()
        ctrl = self._world.live_data.ctrl
        return ctrl[self._position].copy(), ctrl[self._velocity].copy(), ctrl[self._effort].copy()

    @property
    def applied(self) -> Array:
        """Efforts (n,) of the drives in the last step (N m or N)."""
        self._bind()
        return self._world.live_data.actuator_force[self._rows].copy()
