"""Fast motor commands: one joint written at once, many joints before the next step.

Scripts command every joint in every step. A command for many joints is checked and copied when it is given,
and applied to the World's arrays when they are next needed, so that a repeated command costs once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from itertools import count
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.native import Kernel
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.direct_calls import MOST, START

if TYPE_CHECKING:
    from roboyard.sim.actuation.velocity_motors import BodyMotors

Vector = Sequence[float]
_FAR = 1e300
DEFAULT_MAX_FORCE = 100000.0
"""Largest torque or force of a motor whose command names none (N m or N)."""
_PLAIN = (list, tuple, range)
_POSITION, _VELOCITY = c.POSITION_CONTROL, c.VELOCITY_CONTROL


_aim: Any = None
"""The compiled command of one motor, once machine code is used."""
_calls = count(1)


def _load() -> None:
    """Use the compiled command where it is stored; without it, compile it after many calls."""
    global _aim
    from roboyard.pybullet.bullet_rules import motor_kernels

    loop: Any = motor_kernels.aim_motor
    if not isinstance(loop, Kernel):  # loaded already
        _aim = loop
        return

    def counted(*given: Any) -> int:
        global _aim
        if next(_calls) == MOST:
            _aim = loop.load() if loop.is_cheap else None
        return 0

    _aim = loop.load() if loop.is_ready else counted


START.later(_load)


class _Group:
    """Joints that are commanded together; fixed ones are skipped."""

    __slots__ = ("count", "driven", "joints", "lower", "picked", "rows", "scratch", "unbounded", "upper")

    def __init__(self, key: tuple[int, ...], all_rows: list[int], limits: np.ndarray) -> None:
        self.count = len(key)
        self.picked = np.flatnonzero(np.array(all_rows) >= 0)
        self.driven = tuple(key[i] for i in self.picked)
        self.joints = np.array(self.driven)
        self.rows = np.array(all_rows)[self.picked]
        self.lower, self.upper = limits[:, 0].copy(), limits[:, 1].copy()
        self.scratch = np.zeros((len(key), 5))
        self.unbounded = (DEFAULT_MAX_FORCE,) * len(key)


class MotorCommands:
    """Commands for the position and velocity motors of one body that are switched on.

    Attributes:
        pending: commands that are not applied to the World yet, by group of joints.
    """

    __slots__ = (
        "_arrays", "_bounds_in_use", "_groups", "_impulses", "_joints", "_last", "_limits", "_motors",
        "_motors_off", "_rows", "pending",
    )  # fmt: skip

    def __init__(
        self,
        motors: BodyMotors,
        infos: Sequence[tuple[Any, ...]],
        dof_offsets: Sequence[int],
        motors_off: AbstractSet[int],
    ) -> None:
        """Prepare the commands of one body.

        Args:
            motors: the World's motors of the body.
            infos: the fields of getJointInfo of each joint.
            dof_offsets: row of each joint in the motors' arrays.
            motors_off: joints whose motor is switched off; the caller keeps it up to date.
        """
        self._motors = motors
        self._motors_off = motors_off
        self._joints = len(infos)
        self._rows = [dof_offsets[i] if info[2] in (0, 1) else -1 for i, info in enumerate(infos)]
        self._limits = [(info[8], info[9]) if info[8] <= info[9] else (-_FAR, _FAR) for info in infos]
        self._groups: dict[tuple[int, ...], _Group] = {}
        self.pending: dict[_Group, tuple[Any, ...]] = {}
        self._impulses = np.full(self._joints, nan)
        """Known largest impulse of each motor in a step (N m s or N s): 0 if switched off, NaN if unknown."""
        self._arrays: Any = None
        """Arguments of the compiled command, for the arrays that the motors have."""
        self._last: tuple[Any, Any] = (None, None)
        """Joints and group of the last command for many joints."""
        self._bounds_in_use: tuple[_Group, tuple[float, ...], float] | None = None
        """Group, forces and time step of the last command for many joints, unless a limit changed since."""

    def bound_changed(self, joint: int, impulse: float) -> None:
        """Note a motor's largest impulse in a step (N m s or N s) that was set elsewhere.

        0 for one that is switched off; NaN where it is not known.
        """
        self._impulses[joint] = impulse
        self._bounds_in_use = None

    def set(
        self, joint: int, mode: int, position: float, velocity: float, force: float, kp: float, kd: float,
        fastest: float, time_step: float,
    ) -> bool:  # fmt: skip
        """Set one joint's motor; return False, with no effect, for arguments that need the general path."""
        if _aim is not None and not self.pending and joint not in self._motors_off:
            arrays, motors = self._arrays, self._motors
            if arrays is None or arrays[0] is not motors.motors:
                arrays = self._arrays = self._compiled_arguments()
            done = _aim(
                arrays, joint, mode, position, velocity, force, kp, kd, fastest, time_step
            )  # fmt: skip
            if done:
                if done == 2:
                    self._bound(joint, float(force) * time_step)
                return True
        row = self._rows[joint]
        if joint < 0 or row < 0 or not force > 0.0 or joint in self._motors_off:
            return False
        if mode == _POSITION:
            lower, upper = self._limits[joint]
            if position < lower:
                position = lower
            elif position > upper:
                position = upper
            if fastest < 0.0:
                fastest = 0.0
        elif mode == _VELOCITY:
            position = kp = fastest = 0.0
        else:
            return False
        if self.pending:
            self.flush()
        self._motors.aim(row, 2.0 if mode == _POSITION else 1.0, position, velocity, kp, kd, fastest)
        impulse = float(force) * time_step
        if impulse != self._impulses[joint]:
            self._bound(joint, impulse)
        return True

    def _bound(self, joint: int, impulse: float) -> None:
        """Bound a motor by its impulse in a step (N m s or N s)."""
        self._motors.bound(self._rows[joint], impulse)
        self._impulses[joint] = impulse or nan  # 0 without a time step
        self._bounds_in_use = None

    def prepared(self, parameters: Any, switch: Callable[[int, bool | None], None]) -> tuple[Any, ...]:
        """Return what machine code needs to command many joints.

        Args:
            parameters: have the time step.
            switch: notes that the motor of a joint is switched off (True) or on (None).
        """
        arrays, read = self._compiled_arguments(), np.zeros((self._joints, 7))
        return (self, parameters, *arrays, read, DEFAULT_MAX_FORCE, *self._motors.bound_places(), switch)

    def _compiled_arguments(self) -> Any:
        from roboyard.pybullet.bullet_rules.motor_kernels import Motors

        rows = np.array(self._rows, dtype=np.int64)
        limits = np.array(self._limits, dtype=float).reshape(-1, 2)
        return Motors(self._motors.motors, self._motors.targets, rows, limits, self._impulses)

    def set_many(
        self, joints: Sequence[int], mode: int, positions: Vector | None, velocities: Vector | None,
        forces: Vector | None, kps: Vector | None, kds: Vector | None, time_step: float,
    ) -> bool:  # fmt: skip
        """Set several motors before the next step; return False, with no effect, for the general path."""
        last, group = self._last
        if type(joints) is not type(last) or joints != last:
            key = tuple(_plain(joints))
            group = self._groups.get(key) or self._group(key)
            if type(joints) in _PLAIN:
                self._last = joints[:], group
        if group is None or (mode != _POSITION and mode != _VELOCITY):
            return False
        count, off = group.count, self._motors_off
        if off and not off.isdisjoint(group.driven):
            return False
        if forces is None:
            bounds = group.unbounded
        else:
            bounds = tuple(forces.tolist() if type(forces) is np.ndarray else forces)
            if len(bounds) != count:
                return False
        known, total = self._bounds_in_use, 0.0
        if known is None or known[0] is not group or known[2] != time_step or known[1] != bounds:
            if not min(bounds) > 0.0:
                return False
            total = sum(bounds)
        if positions is not None:
            positions = tuple(positions.tolist() if type(positions) is np.ndarray else positions)
            if len(positions) != count:
                return False
            total += sum(positions)
        if velocities is not None:
            velocities = tuple(velocities.tolist() if type(velocities) is np.ndarray else velocities)
            if len(velocities) != count:
                return False
            total += sum(velocities)
        if kps is not None or kds is not None:
            kps, kds = (None if gains is None else tuple(_plain(gains)) for gains in (kps, kds))
            for gains in (kps, kds):
                if gains is not None:
                    if len(gains) != count:
                        return False
                    total += sum(gains)
        if total - total != 0.0:  # something is not finite
            return False
        pending = self.pending
        if pending:
            pending.pop(group, None)  # the last one given is applied last
        pending[group] = (mode, bounds, time_step, positions, velocities, kps, kds)
        return True

    def flush(self) -> None:
        """Apply pending commands to the World, in the order in which they were given."""
        waiting, self.pending = self.pending, {}
        motors = self._motors
        for group, (mode, bounds, time_step, positions, velocities, kps, kds) in waiting.items():
            rows, picked, scratch = group.rows, group.picked, group.scratch
            scratch[:, 0] = 2.0 if mode == _POSITION else 1.0
            scratch[:, 1] = 0.0 if mode == _VELOCITY else 0.1 if kps is None else kps
            scratch[:, 2] = 0.0 if velocities is None else velocities
            scratch[:, 3] = 1.0 if kds is None else kds
            motors.motors[rows] = scratch[picked]
            if mode == _POSITION:
                goal = np.zeros(group.count) if positions is None else np.array(positions, dtype=float)
                motors.targets[rows, 0] = np.minimum(np.maximum(goal, group.lower), group.upper)[picked]
            if self._bounds_in_use != (group, bounds, time_step):
                self._bounds_in_use = group, bounds, time_step
                impulses = np.array(bounds, dtype=float)[picked] * time_step
                self._impulses[group.joints] = impulses if impulses.all() else nan
                motors.set_bounds(rows, impulses)

    def _group(self, key: tuple[int, ...]) -> _Group | None:
        if not key or not all(type(joint) is int and 0 <= joint < self._joints for joint in key):
            return None
        rows = [self._rows[joint] for joint in key]
        if len(set(key)) != len(key) or max(rows) < 0:
            return None
        group = _Group(key, rows, np.array([self._limits[joint] for joint in key]))
        self._groups[key] = group
        return group


def _plain(values: Any) -> Any:
    """Return an array as a list of Python's numbers, which are handled faster; anything else as it is."""
    return values.tolist() if type(values) is np.ndarray else values
