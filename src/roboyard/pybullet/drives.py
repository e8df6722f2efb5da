"""The usual motor commands without detours: one joint written in place, many joints at the next step.

Scripts command every joint in every step. A command for many joints is checked and copied when it is given
and reaches the World's arrays when they are next needed, so that one that is given twice costs once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.pybullet import constants as c

if TYPE_CHECKING:
    from roboyard.pybullet.records import BodyRecord
    from roboyard.sim.motors import BodyMotors

Vector = Sequence[float]
_FAR = 1e300
_POSITION, _VELOCITY = c.POSITION_CONTROL, c.VELOCITY_CONTROL


class _Group:
    """Joints that are commanded together; those that have no motor (fixed ones) are passed over."""

    __slots__ = ("count", "driven", "forces", "generation", "lower", "picked", "rows", "scratch", "upper")

    def __init__(self, key: tuple[int, ...], all_rows: list[int], limits: np.ndarray) -> None:
        self.count = len(key)
        self.picked = np.flatnonzero(np.array(all_rows) >= 0)
        self.driven = tuple(key[i] for i in self.picked)
        self.rows = np.array(all_rows)[self.picked]
        self.lower, self.upper = limits[:, 0].copy(), limits[:, 1].copy()
        self.scratch = np.zeros((len(key), 5))
        self.forces: tuple[float, ...] | None = None
        self.generation = -1


class Drives:
    """Position and velocity motors of one body, for commands that leave them switched on.

    Attributes:
        generation: changes whenever a motor was switched on or off, or its force bound set, elsewhere.
        pending: commands that have not reached the World yet, by joints.
    """

    __slots__ = ("_groups", "_joints", "_limits", "_motored", "_motors", "_rows", "generation", "pending")

    def __init__(self, record: BodyRecord, motors: BodyMotors) -> None:
        self._motors = motors
        self._motored = record.motored
        self._joints = record.joint_count
        self._rows = [
            record.body.dof_offsets[i] if info[2] in (0, 1) else -1 for i, info in enumerate(record.infos)
        ]
        self._limits = [(info[8], info[9]) if info[8] <= info[9] else (-_FAR, _FAR) for info in record.infos]
        self._groups: dict[tuple[int, ...], _Group] = {}
        self.pending: dict[tuple[int, ...], tuple[Any, ...]] = {}
        self.generation = 0

    def set(
        self, joint: int, mode: int, position: float, velocity: float, force: float, kp: float, kd: float,
        fastest: float, time_step: float,
    ) -> bool:  # fmt: skip
        """Set one joint's motor at once; False: not a usual case, nothing was done."""
        row = self._rows[joint]
        if joint < 0 or row < 0 or force <= 0.0 or not self._motored[joint]:
            return False
        if self.pending:
            self.flush()
        self.generation += 1
        if mode == _POSITION:
            lower, upper = self._limits[joint]
            if position < lower:
                position = lower
            elif position > upper:
                position = upper
            largest = fastest if fastest > 0.0 else 0.0
            self._motors.set(row, 2.0, position, velocity, kp, kd, 0.0, force * time_step, largest)
            return True
        if mode == _VELOCITY:
            self._motors.set(row, 1.0, 0.0, velocity, 0.0, kd, 0.0, force * time_step, 0.0)
            return True
        return False

    def set_many(
        self, joints: Sequence[int], mode: int, positions: Vector | None, velocities: Vector | None,
        forces: Vector | None, kps: Vector | None, kds: Vector | None, time_step: float,
    ) -> bool:  # fmt: skip
        """Set several joints' motors before the next step; False: not a usual case, nothing was done."""
        key = tuple(joints)
        group = self._groups.get(key)
        if group is None:
            group = self._group(key)
            if group is None:
                return False
        if (mode != _POSITION and mode != _VELOCITY) or forces is None:
            return False
        count, total = group.count, 0.0
        bounds = tuple(forces)
        if len(bounds) != count:
            return False
        if bounds != group.forces or self.generation != group.generation:
            if not all(self._motored[joint] for joint in group.driven) or not min(bounds) > 0.0:
                return False
            total += sum(bounds)
        copies = []
        for values in (positions, velocities, kps, kds):
            if values is None:
                copies.append(None)
                continue
            copy = tuple(values)
            if len(copy) != count:
                return False
            total += sum(copy)
            copies.append(copy)
        if total - total != 0.0:  # something is not finite
            return False
        self.pending.pop(key, None)
        self.pending[key] = (group, mode, bounds, time_step, *copies)
        return True

    def flush(self) -> None:
        """Bring waiting commands into the World, in the order in which they were given."""
        waiting, self.pending = self.pending, {}
        motors = self._motors
        for group, mode, bounds, time_step, positions, velocities, kps, kds in waiting.values():
            rows, picked, scratch = group.rows, group.picked, group.scratch
            scratch[:, 0] = 2.0 if mode == _POSITION else 1.0
            scratch[:, 1] = 0.0 if mode == _VELOCITY else 0.1 if kps is None else kps
            scratch[:, 2] = 0.0 if velocities is None else velocities
            scratch[:, 3] = 1.0 if kds is None else kds
            motors.motors[rows] = scratch[picked]
            if mode == _POSITION:
                goal = np.zeros(group.count) if positions is None else np.array(positions, dtype=float)
                motors.targets[rows, 0] = np.minimum(np.maximum(goal, group.lower), group.upper)[picked]
            if bounds != group.forces or self.generation != group.generation:
                self.generation += 1
                group.forces, group.generation = bounds, self.generation
                motors.set_bounds(rows, np.array(bounds, dtype=float)[picked] * time_step)

    def _group(self, key: tuple[int, ...]) -> _Group | None:
        if not key or not all(type(joint) is int and 0 <= joint < self._joints for joint in key):
            return None
        rows = [self._rows[joint] for joint in key]
        if len(set(key)) != len(key) or max(rows) < 0:
            return None
        group = _Group(key, rows, np.array([self._limits[joint] for joint in key]))
        self._groups[key] = group
        return group
