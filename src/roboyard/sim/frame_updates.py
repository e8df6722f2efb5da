"""Positions and velocities of all bodies, as MuJoCo computes them from the state, in one compiled call."""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco
from roboyard.native import c_function, can_call, compiled
from roboyard.sim.mujoco_library import mujoco_library

KEEP, POSES, CENTRES, SPEEDS = 1, 2, 4, 8
"""Parts of an update: the old poses are kept; poses, centres of mass and axes, velocities are computed."""

mj_kinematics = c_function("mj_kinematics", "i8 i8 -> i8", library=mujoco_library)
mj_comPos = c_function("mj_comPos", "i8 i8 -> i8", library=mujoco_library)
mj_comVel = c_function("mj_comVel", "i8 i8 -> i8", library=mujoco_library)


@compiled("i8 i8 i8 f8[:,::1] f8[:,::1] f8[:,::1] f8[:,::1]", library=mujoco_library)
def update_frames(model, data, parts, xpos, xquat, kept_xpos, kept_xquat):  # pragma: no cover
    """Compute parts of the positions and velocities of bodies.

    model, data: addresses of MjModel and MjData. xpos, xquat: poses of bodies, (nbody, 3) and (nbody, 4), of
    which the old ones may be written to kept_xpos and kept_xquat.
    """
    if parts & KEEP:
        for row in range(len(xpos)):
            for k in range(3):
                kept_xpos[row, k] = xpos[row, k]
            for k in range(4):
                kept_xquat[row, k] = xquat[row, k]
    if parts & POSES:
        mj_kinematics(model, data)
    if parts & CENTRES:
        mj_comPos(model, data)
    if parts & SPEEDS:
        mj_comVel(model, data)


class FrameUpdates:
    """Updates of one MjData."""

    def __init__(self, model: Any, data: Any) -> None:
        """Look up MuJoCo's arrays."""
        self._model, self._data = model, data
        arrays = data.xpos, data.xquat
        self.kept: tuple[Any, Any] = np.empty_like(arrays[0]), np.empty_like(arrays[1])
        """Poses of bodies before the last update that kept them, (nbody, 3) m and (nbody, 4) w first."""
        self._arrays = (*arrays, *self.kept)
        known = can_call(mujoco_library) and hasattr(model, "_address") and hasattr(data, "_address")
        self._addresses = (model._address, data._address) if known else None

    @property
    def arguments(self) -> tuple[tuple[Any, ...], tuple[Any, ...]] | None:
        """What `update_frames` takes before and after `parts`; None where it is not called."""
        return None if self._addresses is None else (self._addresses, self._arrays)

    def update(self, parts: int) -> None:
        """Compute parts of the positions and velocities of bodies; see `KEEP`."""
        if self._addresses is not None:
            update_frames(*self._addresses, parts, *self._arrays)
            return
        if parts & KEEP:
            for kept, present in zip(self.kept, self._arrays[:2], strict=True):
                kept[:] = present
        for part, call in (
            (POSES, mujoco.mj_kinematics),
            (CENTRES, mujoco.mj_comPos),
            (SPEEDS, mujoco.mj_comVel),
        ):
            if parts & part:
                call(self._model, self._data)
