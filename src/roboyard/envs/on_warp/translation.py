"""A world's model as MuJoCo Warp can run it: joint drives as plain actuators, and their inputs.

A drive has the effort kp (target - q) + kd (target velocity - v) + feedforward. As an affine actuator it has
one input, kp target + kd target velocity + feedforward, and the bias -kp q - kd v; its range of effort stays.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from roboyard.errors import ModelError
from roboyard.sim.world import World
from roboyard.transforms import Array

INPUTS = 3
"""Of a joint drive: position, velocity, effort."""


class Translation:
    """The model for MuJoCo Warp, and how inputs of the world's drives become inputs of its actuators."""

    def __init__(self, world: World) -> None:
        """Translate a compiled world.

        Raises:
            ModelError: it has an actuator with another law than a joint drive or a plain one.
        """
        model = world.model
        pid, affine = int(mujoco.mjtGain.mjGAIN_PID), int(mujoco.mjtBias.mjBIAS_AFFINE)
        is_drive = model.actuator_gaintype == pid
        strange = is_drive & (
            (model.actuator_ctrlnum != INPUTS)
            | (model.actuator_biastype != affine)
            | (model.actuator_dyntype != int(mujoco.mjtDyn.mjDYN_NONE))
        )
        if strange.any():
            name = model.actuator(int(np.flatnonzero(strange)[0])).name
            raise ModelError(f"actuator {name!r}: its drive has an integral part, which MuJoCo Warp lacks")
        spec = world.spec.copy()
        for actuator, drives in zip(spec.actuators, is_drive, strict=True):
            if drives:
                bias = actuator.biasprm.copy()
                actuator.set_to_motor()
                actuator.biastype, actuator.biasprm = mujoco.mjtBias.mjBIAS_AFFINE, bias
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        spec.option.cone = model.opt.cone
        self.model: Any = spec.compile()
        """MuJoCo's model for Warp."""
        _copy_numbers(model, self.model)
        self._drives = np.flatnonzero(is_drive)
        self._plain = np.flatnonzero(~is_drive)
        self._address = model.actuator_ctrladr.astype(np.intp)

    def inputs(self, ctrl: Array, bias: Array) -> Array:
        """Return (n, actuators) inputs of the translated actuators.

        Args:
            ctrl: (n, nu) inputs of the world's drives.
            bias: (n, actuators, 10) or (1, actuators, 10) MuJoCo's `actuator_biasprm`.
        """
        out = np.empty((len(ctrl), len(self._address)))
        out[:, self._plain] = ctrl[:, self._address[self._plain]]
        at, rows = self._address[self._drives], self._drives
        out[:, rows] = ctrl[:, at + 2] - bias[:, rows, 1] * ctrl[:, at] - bias[:, rows, 2] * ctrl[:, at + 1]
        return out


def _copy_numbers(source: Any, target: Any) -> None:
    """Copy what was changed in a compiled model since its spec was written, such as gains of drives."""
    for name in dir(target):
        if name.startswith(("_", "actuator_gain", "actuator_ctrl")):
            continue
        there, here = getattr(target, name), getattr(source, name, None)
        if (
            isinstance(there, np.ndarray)
            and isinstance(here, np.ndarray)
            and there.dtype.kind == "f"
            and there.shape == here.shape
        ):
            there[:] = here
