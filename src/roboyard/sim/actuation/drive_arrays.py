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
    """Drives of n joints; each applies kp (position - q) + kd (velocity - v) + effort within its limit.

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
        """Set all inputs; those whose gain is zero have no effect."""
        if self._revision != self._world.revision or self._world.is_stale:
            self._bind()
        ctrl = self._world.live_data.ctrl
        ctrl[self._position] = position
        ctrl[self._velocity] = velocity
        ctrl[self._effort] = effort

    def write_effort(self, effort: Array, where: np.ndarray) -> None:
        """Set the effort inputs of some of the joints, `where` (k,) in this vector's order."""
        if self._revision != self._world.revision or self._world.is_stale:
            self._bind()
        self._world.live_data.ctrl[self._effort[where]] = effort

    def write_gains(self, stiffness: Array, damping: Array) -> None:
        """Set kp (N m/rad or N/m) and kd (N m s/rad or N s/m) of all joints.

        They last until bodies come or go: who drives a robot writes them at every control step.
        """
        if self._revision != self._world.revision or self._world.is_stale:
            self._bind()
        bias = self._world.live_model.actuator_biasprm
        bias[self._rows, 1] = -stiffness
        bias[self._rows, 2] = -damping

    @property
    def inputs(self) -> tuple[Array, Array, Array]:
        """Position, velocity and effort inputs as they are; (n,) each."""
        self._bind()
        ctrl = self._world.live_data.ctrl
        return ctrl[self._position].copy(), ctrl[self._velocity].copy(), ctrl[self._effort].copy()

    @property
    def applied(self) -> Array:
        """(n,) N m or N that the drives applied in the last step."""
        self._bind()
        return self._world.live_data.actuator_force[self._rows].copy()
