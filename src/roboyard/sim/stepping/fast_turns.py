"""Robots that tumble so fast that the cheap integrator would add energy to them.

MuJoCo's `implicitfast` takes damping and drives implicitly, but the gyroscopic, Coriolis and centrifugal
forces of mechanisms explicitly. Explicit steps add energy: a robot on legs that is thrown with 20 rad/s turns
faster and faster, and is infinitely fast after some seconds. `implicit` takes these forces implicitly, too,
which removes energy instead, at about twice the time. So it is the integrator of the steps in which a base
turns fast. Fast joints alone do not ask for it: drives and stops brake them, and where the links of a finger
move, it departs from the accelerations for which their constraints were solved. MuJoCo takes the gyroscopic
forces of free bodies without joints implicitly with either.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from roboyard._mujoco import mujoco

FAST = 10.0
"""Turning speed (rad/s) of a free base from which its steps are implicit: faster than robots turn at will."""


class FastTurns:
    """Chooses the integrator of one world's steps."""

    def __init__(self) -> None:
        self.invalidate()

    def invalidate(self) -> None:
        """Note that MuJoCo's arrays are new, or bodies were added or removed."""
        self._turns: list[np.ndarray] | None = None
        """The (3,) angular velocities (rad/s) of the bases of mechanisms; views."""

    def choose(self, model: Any, data: Any) -> None:
        """Choose the integrator of the next step, in a world whose usual one is implicitfast."""
        turns, kinds = self._turns, mujoco.mjtIntegrator
        if turns is None:
            turns = self._turns = _turns(model, data)
            self._is_implicit = model.opt.integrator == kinds.mjINT_IMPLICIT
        is_fast = any(turn.dot(turn) > FAST * FAST for turn in turns)
        if is_fast != self._is_implicit:
            model.opt.integrator = kinds.mjINT_IMPLICIT if is_fast else kinds.mjINT_IMPLICITFAST
            self._is_implicit = is_fast


def _turns(model: Any, data: Any) -> list[np.ndarray]:
    """Return the angular velocities of the free bases that have joints."""
    starts = model.jnt_dofadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    sizes = np.bincount(model.dof_treeid, minlength=model.ntree) if model.nv else np.zeros(0, dtype=int)
    return [data.qvel[k + 3 : k + 6] for k in starts if sizes[model.dof_treeid[k]] > 6]
