"""The rows of the bases of all bodies of a world, whose poses are written all at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from roboyard._records import NamedTuple
from roboyard.sim.build.records import Built

Poses = tuple[np.ndarray, np.ndarray]
"""Positions (n, 3) (m) and quaternions (n, 4), w, x, y, z, of the frames of root links in the world."""


class BaseRows(NamedTuple):
    """Rows of n bases in MuJoCo's arrays."""

    bodies: np.ndarray
    """(n,) among its bodies."""
    positions: np.ndarray
    """(n,) first one in qpos; -1 for a fixed base."""

    def move(self, model: Any, before: Poses, now: Poses) -> bool:
        """Write the poses of those that are elsewhere than before; return whether there are any.

        Args:
            model: MjModel.
            before: the poses that it has.
            now: those that it gets.
        """
        if now[0].tobytes() == before[0].tobytes() and now[1].tobytes() == before[1].tobytes():
            return False
        pairs = zip(now, before, strict=True)
        differ = [(new.view(np.int64) != old.view(np.int64)).any(axis=1) for new, old in pairs]
        moved = np.flatnonzero(differ[0] | differ[1])
        positions, quaternions = now[0][moved], now[1][moved]
        rows, firsts = self.bodies[moved], self.positions[moved]
        model.body_pos[rows], model.body_quat[rows] = positions, quaternions
        free = firsts >= 0
        places = firsts[free, None] + _POSE
        poses = np.concatenate([positions[free], quaternions[free]], axis=1)
        model.qpos0[places] = model.qpos_spring[places] = poses
        return True


_POSE = np.arange(7)
"""Numbers of a free joint in qpos."""


def bases_of(model: Any, bodies: Sequence[Built]) -> BaseRows:
    """Return the rows of the bases of bodies with these elements in an MjModel."""
    firsts = [-1 if body.free_joint is None else model.jnt_qposadr[body.free_joint.id] for body in bodies]
    return BaseRows(
        np.array([body.links[0].element.id for body in bodies], np.intp), np.array(firsts, np.intp)
    )
