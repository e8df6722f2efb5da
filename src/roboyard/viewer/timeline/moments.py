"""`Moments`: recorded states of a world, at most a minute of them and bounded in memory."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from roboyard.recording.columns import Columns, position_columns, velocity_columns
from roboyard.transforms import Array
from roboyard.viewer.scene.snapshot import Snapshot
from roboyard.viewer.timeline.readings import Drives, Readings, drives_of, read

if TYPE_CHECKING:
    from roboyard.sensors import Sensor
    from roboyard.sim import World

SPAN = 60.0
"""Longest recorded time (s)."""
PERIOD = 1.0 / 60.0
"""Least simulated time between two recorded states (s)."""
MOST_BYTES = 256 * 2**20
"""Largest memory of all recorded states (bytes); beyond it the oldest are dropped."""
MARGIN = 1e-9
"""Rounding of simulated times (s)."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Frames:
    """Poses of frames in their parents, and the columns of a log; shared by states that agree in them."""

    revision: int
    """Revision of the world."""
    positions: Array
    """(nbody, 3) positions (m)."""
    wxyz: Array
    """(nbody, 4) orientations w, x, y, z."""
    position_columns: Columns
    """Columns of qpos."""
    velocity_columns: Columns
    """Columns of qvel."""
    drives: Drives
    """Joints with a drive."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Moment:
    """A recorded state."""

    clock: float
    """Time since the recording began (s); it never goes back, unlike the simulated time at a reset."""
    snapshot: Snapshot
    """The state that a page shows; without `data`."""
    qvel: Array
    """(nv,) joint velocities (rad/s or m/s), as in MuJoCo."""
    readings: Readings
    """Efforts, targets, contact forces and sensors."""
    frames: Frames
    """Poses of frames in their parents."""
    timestep: float
    """Time step of the world (s)."""
    nbytes: int
    """Memory that this state holds and the one before does not (bytes)."""


class Moments:
    """The recorded states, oldest first. `record` belongs to the simulation thread, the rest to any."""

    def __init__(self, *, span: float = SPAN, period: float = PERIOD, most_bytes: int = MOST_BYTES) -> None:
        """Start without states.

        Args:
            span: longest recorded time (s).
            period: least simulated time between two states (s).
            most_bytes: largest memory of all states (bytes).
        """
        self._span, self._period, self._most_bytes = span, period, most_bytes
        self._kept: deque[Moment] = deque()
        self._lock = threading.Lock()
        self.sensors: dict[str, Sensor] = {}
        """Sensors to record, by name: those that return vectors, such as `Imu`."""
        self.nbytes = 0
        """Memory of all states (bytes), meshes and models that they share counted once."""

    def record(self, world: World, snapshot: Snapshot) -> bool:
        """Keep the present state of a world unless the last kept one is newer than a period.

        Args:
            world: the compiled world.
            snapshot: its present state.

        Returns:
            Whether the state was kept.
        """
        last = self._kept[-1] if self._kept else None
        clock = 0.0
        if last is not None:
            passed = snapshot.time - last.snapshot.time
            if 0.0 <= passed < self._period - MARGIN:
                return False
            clock = last.clock + (passed if passed > 0.0 else self._period)
        frames = _frames(world, last)
        qvel = np.array(world.data.qvel)
        readings = read(world, snapshot.links, self.sensors)
        kept = replace(snapshot, data=None)
        moment = Moment(
            clock=clock,
            snapshot=kept,
            qvel=qvel,
            readings=readings,
            frames=frames,
            timestep=world.timestep,
            nbytes=qvel.nbytes + readings.nbytes + _new_bytes(kept, frames, last),
        )
        with self._lock:
            self._kept.append(moment)
            self.nbytes += moment.nbytes
            while len(self._kept) > 1 and (
                clock - self._kept[0].clock > self._span + MARGIN or self.nbytes > self._most_bytes
            ):
                self.nbytes -= self._kept.popleft().nbytes
        return True

    def all(self) -> tuple[Moment, ...]:
        """Return all states, oldest first."""
        with self._lock:
            return tuple(self._kept)

    def clear(self) -> None:
        """Drop all states."""
        with self._lock:
            self._kept.clear()
            self.nbytes = 0


def _frames(world: World, last: Moment | None) -> Frames:
    """Return the frames of a world, those of the last state if they are the same."""
    model = world.model
    if last is not None and last.frames.revision == world.revision and last.snapshot.model is model:
        old = last.frames
        if np.array_equal(old.positions, model.body_pos) and np.array_equal(old.wxyz, model.body_quat):
            return old
        columns = old.position_columns, old.velocity_columns, old.drives
    else:
        columns = position_columns(world), velocity_columns(world), drives_of(world)
    return Frames(
        revision=world.revision,
        positions=model.body_pos.copy(),
        wxyz=model.body_quat.copy(),
        position_columns=columns[0],
        velocity_columns=columns[1],
        drives=columns[2],
    )


def _new_bytes(snapshot: Snapshot, frames: Frames, last: Moment | None) -> int:
    """Return the memory of a state (bytes) without what the last one holds, too."""
    before = None if last is None else last.snapshot
    size = snapshot.qpos.nbytes
    size += sum(array.nbytes for array in (snapshot.forces, snapshot.pull) if array is not None)
    if last is None or frames is not last.frames:
        size += frames.positions.nbytes + frames.wxyz.nbytes
    if before is None or snapshot.model is not before.model:
        size += int(snapshot.model.nbuffer)
    if before is None or snapshot.shapes is not before.shapes:
        known = set() if before is None else {id(shape.mesh) for shape in before.shapes}
        new = {id(shape.mesh): shape.mesh for shape in snapshot.shapes if id(shape.mesh) not in known}
        size += sum(mesh.vertices.nbytes + mesh.faces.nbytes for mesh in new.values())
    return size
