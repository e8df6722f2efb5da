"""What happens: the robot drops and settles, then its joints go through their ranges, group by group."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from roboyard.demo.demo_world import DemoWorld
from roboyard.demo.plan import Group
from roboyard.transforms import Array, rotate

STEPS_PER_TICK = 2
"""Time steps between two looks at the robot."""
SETTLE_LIMIT, SETTLE_LIMIT_SHORT = 3.0, 1.5
"""s"""
REST = 0.2
"""s for which it has to be still to count as settled."""
STILL_JOINTS, STILL_BASE = 0.05, 0.02
"""rad/s or m/s of every driven joint; m/s or rad/s of the base."""
FALLEN = np.radians(30.0)
"""Tilt of the base since the start that counts as a fall."""

OnTick = Callable[[str, float], None]
"""Called after each tick with the name of the act and the share of it that is over, 0 to 1."""


@dataclass(kw_only=True, slots=True)
class Record:
    """Positions, velocities and targets of the driven joints over time."""

    joints: tuple[str, ...]
    times: list[float] = field(default_factory=list)
    positions: list[Array] = field(default_factory=list)
    velocities: list[Array] = field(default_factory=list)
    targets: list[Array] = field(default_factory=list)


@dataclass(kw_only=True, slots=True)
class MotionSequence:
    """What happened, in figures."""

    record: Record
    settle_time: float | None = None
    """s until it was still; None: it never was."""
    fell_when_dropped: bool = False
    fell_when_moved: bool = False
    simulated: float = 0.0
    """s"""
    stepping: float = 0.0
    """s of wall clock inside `World.step`."""
    steps: int = 0
    errors: dict[str, tuple[float, float]] = field(default_factory=dict)
    """Joint name to mean square root and largest distance from its target while it moved; rad or m."""

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds for each second of computing the physics."""
        return self.simulated / self.stepping if self.stepping > 0 else 0.0


class MotionRecorder:
    """Tells the story on a stage, tick by tick."""

    def __init__(self, stage: DemoWorld, on_tick: OnTick, *, short: bool = False) -> None:
        self.stage = stage
        self.on_tick = on_tick
        self.short = short
        joints = tuple(stage.plan.home)
        self.story = MotionSequence(record=Record(joints=joints))
        self._targets = np.array([stage.plan.home[name] for name in joints])
        self._column = {name: k for k, name in enumerate(joints)}
        rows = {name: k for k, name in enumerate(stage.robot.joint_names)}
        self._rows = np.array([rows[name] for name in joints], dtype=np.intp)
        self._upright = self._up()

    def tell(self) -> MotionSequence:
        """Settle, hold up what cannot stand, move every joint."""
        stage, plan = self.stage, self.stage.plan
        self.settle()
        if plan.stance.kind != "mounted":
            self.story.fell_when_dropped = self._has_fallen()
        if not stage.robot.is_fixed and (plan.stance.kind == "held" or self.story.fell_when_dropped):
            self._hold_up()
        return self.story

    def settle(self) -> None:
        """Wait until the robot is still; note when that was."""
        limit = SETTLE_LIMIT_SHORT if self.short else SETTLE_LIMIT
        since: float | None = None
        world = self.stage.world
        while world.time < limit:
            self._tick("settling", world.time / limit)
            if not self._is_still():
                since = None
            elif since is None:
                since = world.time
            elif world.time - since >= REST:
                break
        self.story.settle_time = since

    def move(self) -> None:
        """Send every group of joints through its sweep."""
        world, plan = self.stage.world, self.stage.plan
        total, done = plan.duration, 0.0
        for group in plan.groups:
            self._move_group(group, done, total)
            if not self.stage.robot.is_fixed and self._has_fallen():
                self.story.fell_when_moved = True
                self._hold_up()
                self._move_group(group, done, total)
            done += group.duration
        self._wait(0.2)
        self.story.simulated = world.time

    # -------------------------------------------------------------------------------------------------- ticks

    def _move_group(self, group: Group, done: float, total: float) -> None:
        world = self.stage.world
        first = len(self.story.record.times)
        tick = STEPS_PER_TICK * world.timestep
        ticks = max(int(np.ceil(group.duration / tick - 1e-9)), 1)
        # where each joint should be half way through each tick, which the drive is told, and at its end
        ways = [
            (sweep, sweep.at((np.arange(ticks) + 0.5) / ticks), sweep.at((np.arange(ticks) + 1.0) / ticks)[0])
            for sweep in group.sweeps
        ]
        for k in range(ticks):
            for sweep, (target, slope), end in ways:
                self.stage.drive(sweep.joint, float(target[k]), float(slope[k]) / (ticks * tick))
                self._targets[self._column[sweep.joint]] = end[k]
            self._tick("moving", (done + k * tick) / total)
        self._note_errors(group, first)
        for sweep in group.sweeps:
            self.stage.drive(sweep.joint, sweep.home)
            self._targets[self._column[sweep.joint]] = sweep.home

    def _hold_up(self) -> None:
        """Put the robot on its stand and let it come to rest."""
        self.stage.place(free=False)
        self._upright = self._up()
        self._wait(0.5)

    def _wait(self, seconds: float) -> None:
        until = self.stage.world.time + seconds
        while self.stage.world.time < until:
            self._tick("settling", 1.0)

    def _tick(self, act: str, share: float) -> None:
        world, robot, record = self.stage.world, self.stage.robot, self.story.record
        began = perf_counter()
        world.step(STEPS_PER_TICK)
        self.story.stepping += perf_counter() - began
        self.story.steps += STEPS_PER_TICK
        record.times.append(world.time)
        record.positions.append(robot.joint_positions[self._rows])
        record.velocities.append(robot.joint_velocities[self._rows])
        record.targets.append(self._targets.copy())
        self.on_tick(act, min(share, 1.0))

    # --------------------------------------------------------------------------------------------- judgement

    def _is_still(self) -> bool:
        robot, record = self.stage.robot, self.story.record
        if record.joints and np.abs(record.velocities[-1]).max() > STILL_JOINTS:
            return False
        linear, angular = robot.velocity
        return bool(np.linalg.norm(linear) < STILL_BASE and np.linalg.norm(angular) < STILL_BASE)

    def _up(self) -> Array:
        """The base's own z axis in the world."""
        return rotate(self.stage.robot.orientation, np.array([0.0, 0.0, 1.0]))

    def _has_fallen(self) -> bool:
        return bool(np.arccos(np.clip(self._up() @ self._upright, -1.0, 1.0)) > FALLEN)

    def _note_errors(self, group: Group, first: int) -> None:
        """Root mean square and largest distance from the target, over the ticks since `first`."""
        record = self.story.record
        distance = np.abs(np.array(record.positions[first:]) - np.array(record.targets[first:]))
        for sweep in group.sweeps:
            off = distance[:, self._column[sweep.joint]]
            self.story.errors[sweep.joint] = (float(np.sqrt((off**2).mean())), float(off.max()))
