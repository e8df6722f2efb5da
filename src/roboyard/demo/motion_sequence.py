"""The motion of the demo: the robot is dropped and comes to rest; then groups of joints sweep their range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from roboyard.demo.demo_world import DemoWorld
from roboyard.demo.plan import Group
from roboyard.transforms import Array, rotate

STEPS_PER_TICK = 2
"""Time steps between two samples of the robot's state."""
SETTLE_LIMIT, SETTLE_LIMIT_SHORT = 3.0, 1.5
"""Longest wait for rest (s), and that of a short demo."""
REST = 0.2
"""Time without motion that counts as rest (s)."""
STILL_JOINTS, STILL_BASE = 0.05, 0.02
"""Speeds that count as still: of every driven joint (rad/s or m/s) and of the base (m/s or rad/s)."""
FALLEN = np.radians(30.0)
"""Tilt of the base since the start that counts as a fall (rad)."""

OnTick = Callable[[str, float], None]
"""Called after each tick with the phase's name and its finished share, 0 to 1."""


@dataclass(kw_only=True, slots=True)
class Record:
    """Positions, velocities and targets of the driven joints over time."""

    joints: tuple[str, ...]
    """Names of the n joints."""
    times: list[float] = field(default_factory=list)
    """Simulated times (s)."""
    positions: list[Array] = field(default_factory=list)
    """(n,) positions at each time (rad or m)."""
    velocities: list[Array] = field(default_factory=list)
    """(n,) velocities at each time (rad/s or m/s)."""
    targets: list[Array] = field(default_factory=list)
    """(n,) target positions at each time (rad or m)."""


@dataclass(kw_only=True, slots=True)
class MotionSequence:
    """The outcome of the motion."""

    record: Record
    settle_time: float | None = None
    """Time at which the robot came to rest (s); None if it never did."""
    fell_when_dropped: bool = False
    fell_when_moved: bool = False
    simulated: float = 0.0
    """Simulated time (s)."""
    stepping: float = 0.0
    """Wall-clock time spent in `World.step` (s)."""
    steps: int = 0
    errors: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Joint name to its root mean square and largest tracking error while it moved (rad or m)."""

    @property
    def real_time_factor(self) -> float:
        """Simulated time per wall-clock time of stepping; 0 before the first step."""
        return self.simulated / self.stepping if self.stepping > 0 else 0.0


class MotionRecorder:
    """Runs the motion sequence in a demo world and records it tick by tick."""

    def __init__(self, scene: DemoWorld, on_tick: OnTick, *, short: bool = False) -> None:
        """Prepare a recorder.

        Args:
            scene: the world with the robot.
            on_tick: called after each tick.
            short: wait less long for rest.
        """
        self.scene = scene
        self.on_tick = on_tick
        self.short = short
        joints = tuple(scene.plan.home)
        self.sequence = MotionSequence(record=Record(joints=joints))
        self._targets = np.array([scene.plan.home[name] for name in joints])
        self._column = {name: k for k, name in enumerate(joints)}
        rows = {name: k for k, name in enumerate(scene.robot.joint_names)}
        self._rows = np.array([rows[name] for name in joints], dtype=np.intp)
        self._upright = self._up()

    def settle_on_support(self) -> None:
        """Wait for rest; then fix the base of a robot that legs carry or that fell."""
        scene, support = self.scene, self.scene.plan.support
        self._settle()
        if support.kind != "mounted":
            self.sequence.fell_when_dropped = self._has_fallen()
        if not scene.robot.is_fixed and (support.kind == "supported" or self.sequence.fell_when_dropped):
            self._fix_base()

    def move(self) -> None:
        """Move every group of joints; a free robot that falls repeats the group with a fixed base."""
        world, plan = self.scene.world, self.scene.plan
        total, done = plan.duration, 0.0
        for group in plan.groups:
            self._move_group(group, done, total)
            if not self.scene.robot.is_fixed and self._has_fallen():
                self.sequence.fell_when_moved = True
                self._fix_base()
                self._move_group(group, done, total)
            done += group.duration
        self._wait(0.2)
        self.sequence.simulated = world.time

    def _settle(self) -> None:
        """Step until the robot is at rest or the time limit is reached; record when it came to rest."""
        limit = SETTLE_LIMIT_SHORT if self.short else SETTLE_LIMIT
        since: float | None = None
        world = self.scene.world
        while world.time < limit:
            self._tick("settling", world.time / limit)
            if not self._is_still():
                since = None
            elif since is None:
                since = world.time
            elif world.time - since >= REST:
                break
        self.sequence.settle_time = since

    def _move_group(self, group: Group, done: float, total: float) -> None:
        world = self.scene.world
        first = len(self.sequence.record.times)
        tick = STEPS_PER_TICK * world.timestep
        ticks = max(int(np.ceil(group.duration / tick - 1e-9)), 1)
        # position and slope half way through each tick, which is the drive's target, and position at its end
        ways = [
            (sweep, sweep.at((np.arange(ticks) + 0.5) / ticks), sweep.at((np.arange(ticks) + 1.0) / ticks)[0])
            for sweep in group.sweeps
        ]
        for k in range(ticks):
            for sweep, (target, slope), end in ways:
                self.scene.drive(sweep.joint, float(target[k]), float(slope[k]) / (ticks * tick))
                self._targets[self._column[sweep.joint]] = end[k]
            self._tick("moving", (done + k * tick) / total)
        self._record_errors(group, first)
        for sweep in group.sweeps:
            self.scene.drive(sweep.joint, sweep.home)
            self._targets[self._column[sweep.joint]] = sweep.home

    def _fix_base(self) -> None:
        """Place the robot on its stand with a fixed base and wait until it is at rest."""
        self.scene.place(free=False)
        self._upright = self._up()
        self._wait(0.5)

    def _wait(self, seconds: float) -> None:
        until = self.scene.world.time + seconds
        while self.scene.world.time < until:
            self._tick("settling", 1.0)

    def _tick(self, phase: str, share: float) -> None:
        world, robot, record = self.scene.world, self.scene.robot, self.sequence.record
        began = perf_counter()
        world.step(STEPS_PER_TICK)
        self.sequence.stepping += perf_counter() - began
        self.sequence.steps += STEPS_PER_TICK
        record.times.append(world.time)
        record.positions.append(robot.joint_positions[self._rows])
        record.velocities.append(robot.joint_velocities[self._rows])
        record.targets.append(self._targets.copy())
        self.on_tick(phase, min(share, 1.0))

    def _is_still(self) -> bool:
        robot, record = self.scene.robot, self.sequence.record
        if record.joints and np.abs(record.velocities[-1]).max() > STILL_JOINTS:
            return False
        linear, angular = robot.velocity
        return bool(np.linalg.norm(linear) < STILL_BASE and np.linalg.norm(angular) < STILL_BASE)

    def _up(self) -> Array:
        """Return (3,) the z axis of the base link in the world frame."""
        return rotate(self.scene.robot.orientation, np.array([0.0, 0.0, 1.0]))

    def _has_fallen(self) -> bool:
        return bool(np.arccos(np.clip(self._up() @ self._upright, -1.0, 1.0)) > FALLEN)

    def _record_errors(self, group: Group, first: int) -> None:
        """Record the root mean square and the largest tracking error of a group since tick `first`."""
        record = self.sequence.record
        distance = np.abs(np.array(record.positions[first:]) - np.array(record.targets[first:]))
        for sweep in group.sweeps:
            error = distance[:, self._column[sweep.joint]]
            self.sequence.errors[sweep.joint] = (float(np.sqrt((error**2).mean())), float(error.max()))
