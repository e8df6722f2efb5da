"""State logs: the states of a world over time, in a NumPy archive with named columns.

time               (n,) simulated time (s)
positions          (n, p) in the units of position_units, columns named by position_names
velocities         (n, v) likewise
fixed_positions    (m, f, 3) positions of all frames in their parents (m), once for each change
fixed_quaternions  (m, f, 4) their orientations (x, y, z, w)
fixed_index        (n,) index into the m versions of the two above
about              JSON: format version, setup of the scene, time step
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import ConfigError
from roboyard.recording.columns import position_columns, velocity_columns
from roboyard.transforms import Array, from_wxyz, to_wxyz
from roboyard.untrusted.arrays import ArraysError, read_arrays

if TYPE_CHECKING:
    from roboyard.sim import World

VERSION = 1
MAX_BYTES = 512 * 1024 * 1024
"""Largest log, unpacked (bytes): days of a robot of thirty joints at 20 Hz."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StateLog:
    """Recorded states of a world: n states of p position and v velocity coordinates."""

    time: Array
    """(n,) simulated time (s)."""
    positions: Array
    """(n, p) position coordinates."""
    position_names: tuple[str, ...]
    """Names of the p columns, such as "r1/torso_joint1"."""
    position_units: tuple[str, ...]
    """Units of the p columns."""
    velocities: Array
    """(n, v) velocity coordinates."""
    velocity_names: tuple[str, ...]
    """Names of the v columns."""
    velocity_units: tuple[str, ...]
    """Units of the v columns."""
    fixed_positions: Array
    """(m, f, 3) positions of all frames in their parents (m), once for each change."""
    fixed_quaternions: Array
    """(m, f, 4) orientations (x, y, z, w) of all frames in their parents."""
    fixed_index: np.ndarray
    """(n,) index of each state into the m versions of `fixed_positions` and `fixed_quaternions`."""
    timestep: float
    """Time step of the recorded world (s)."""
    setup: dict[str, Any] = field(default_factory=dict)
    """Data to build the scene again (see `roboyard.recording.set_up`); empty for a world built otherwise."""

    def __len__(self) -> int:
        """Return the number of states."""
        return len(self.time)

    def column(self, name: str) -> Array:
        """Return the (n,) positions of one column, such as "r1/torso_joint1" (m or rad).

        Raises:
            ConfigError: there is no column `name`; the message lists the nearest.
        """
        from roboyard.errors import unknown_name

        if name not in self.position_names:
            raise ConfigError(unknown_name("column", name, self.position_names))
        return self.positions[:, self.position_names.index(name)]

    def check_fits(self, world: World) -> None:
        """Check that a world has the bodies and joints of this log.

        Raises:
            ConfigError: it has others; the message names one.
        """
        mine, there = self.position_names, position_columns(world).names
        if mine != there:
            missing = [name for name in mine if name not in there]
            extra = [name for name in there if name not in mine]
            difference = (
                f"this world has no {missing[0]!r}"
                if missing
                else f"this world also has {extra[0]!r}"
                if extra
                else f"{mine[0]!r} and the others are in another order"
            )
            raise ConfigError(f"the log is of another world: {difference}")
        if self.fixed_positions.shape[1] != world.model.nbody:
            count = self.fixed_positions.shape[1]
            raise ConfigError(
                f"the log is of another world: it has {count} frames, this world {world.model.nbody}"
            )

    def restore(self, world: World, k: int) -> None:
        """Set a world that `check_fits` accepts to state k, with exactly the recorded numbers."""
        places, speeds = position_columns(world).places, velocity_columns(world).places
        model, data = world.model, world.data
        data.qpos[places] = self.positions[k]
        data.qvel[speeds] = self.velocities[k]
        data.time = self.time[k]
        version = int(self.fixed_index[k])
        model.body_pos[:] = self.fixed_positions[version]
        model.body_quat[:] = to_wxyz(self.fixed_quaternions[version])
        world.mark_fixed_moved()

    def save(self, path: str | Path) -> Path:
        """Write the archive and return its path.

        Raises:
            ConfigError: `path` does not end in .npz.
        """
        target = Path(path)
        if target.suffix != ".npz":
            raise ConfigError(f"the file of a state log must end in .npz, got {str(path)!r}")
        about = {"version": VERSION, "timestep": self.timestep, "setup": self.setup}
        np.savez_compressed(
            target,
            time=self.time,
            positions=self.positions,
            position_names=np.array(self.position_names, dtype=np.str_),
            position_units=np.array(self.position_units, dtype=np.str_),
            velocities=self.velocities,
            velocity_names=np.array(self.velocity_names, dtype=np.str_),
            velocity_units=np.array(self.velocity_units, dtype=np.str_),
            fixed_positions=self.fixed_positions,
            fixed_quaternions=self.fixed_quaternions,
            fixed_index=self.fixed_index,
            about=np.array(json.dumps(about)),
        )
        return target


def load_log(path: str | Path) -> StateLog:
    """Load a state log.

    Raises:
        ConfigError: the file is missing, is not a state log, or its arrays have contradictory shapes.
    """
    source = Path(path)
    if not source.exists():
        raise ConfigError(f"state log {str(path)!r} not found")
    try:
        data = read_arrays(source, MAX_BYTES)
        about = json.loads(str(data["about"]))
        version = about["version"]
        if version != VERSION:
            raise ConfigError(
                f"{source.name}: format version {version} is not supported; this Roboyard reads {VERSION}"
            )
        log = StateLog(
            time=data["time"],
            positions=data["positions"],
            position_names=tuple(str(v) for v in data["position_names"]),
            position_units=tuple(str(v) for v in data["position_units"]),
            velocities=data["velocities"],
            velocity_names=tuple(str(v) for v in data["velocity_names"]),
            velocity_units=tuple(str(v) for v in data["velocity_units"]),
            fixed_positions=data["fixed_positions"],
            fixed_quaternions=data["fixed_quaternions"],
            fixed_index=data["fixed_index"],
            timestep=float(about["timestep"]),
            setup=dict(about["setup"]),
        )
    except ConfigError:
        raise
    except KeyError as error:
        raise ConfigError(f"{source.name} is not a state log: it has no array {error}") from None
    except OSError as error:
        raise ConfigError(f"{source.name} is not a state log: {error.strerror or error}") from None
    except (ValueError, TypeError, RecursionError, ArraysError) as error:
        reason = " ".join(str(error).split())
        if "not a zip file" in reason:
            reason = "give the .npz file that `roboyard drive --log` or Recorder.log().save() wrote"
        raise ConfigError(f"{source.name} is not a state log: {reason}") from None
    n, p, v, m = len(log.time), len(log.position_names), len(log.velocity_names), len(log.fixed_positions)
    fits = (
        log.positions.shape == (n, p)
        and log.velocities.shape == (n, v)
        and len(log.position_units) == p
        and len(log.velocity_units) == v
        and log.fixed_index.shape == (n,)
        and log.fixed_positions.ndim == log.fixed_quaternions.ndim == 3
        and log.fixed_positions.shape[:2] == log.fixed_quaternions.shape[:2]
        and (n == 0 or (log.fixed_index.min() >= 0 and log.fixed_index.max() < m))
    )
    if not fits:
        raise ConfigError(f"{source.name}: the shapes of its arrays contradict each other")
    return log


class Recorder:
    """Records states of one world; bodies must not be added or removed meanwhile."""

    def __init__(self, world: World, *, setup: dict[str, Any] | None = None) -> None:
        """Begin a recording.

        Args:
            world: the world to record.
            setup: data for JSON to build the scene again; see `roboyard.recording.set_up`.
        """
        self._world = world
        self._setup = dict(setup or {})
        world.ensure_compiled()
        self._signature = tuple(world.body_by_id)
        self._positions, self._velocities = position_columns(world), velocity_columns(world)
        self._times: list[float] = []
        self._qpos: list[Array] = []
        self._qvel: list[Array] = []
        self._fixed: list[tuple[Array, Array]] = []
        self._fixed_index: list[int] = []

    def __len__(self) -> int:
        """Return the number of recorded states."""
        return len(self._times)

    def record(self) -> None:
        """Append the present state.

        Raises:
            ConfigError: bodies were added or removed since the recording began.
        """
        world = self._world
        if tuple(world.body_by_id) != self._signature:
            raise ConfigError(
                f"bodies were added or removed during the recording, {len(self._signature)} before and "
                f"{len(world.body_by_id)} now; begin a new recording"
            )
        model, data = world.model, world.data
        self._times.append(float(data.time))
        self._qpos.append(data.qpos[self._positions.places])
        self._qvel.append(data.qvel[self._velocities.places])
        last = self._fixed[-1] if self._fixed else None
        same = last is not None and np.array_equal(last[0], model.body_pos)
        if last is None or not same or not np.array_equal(last[1], model.body_quat):
            self._fixed.append((model.body_pos.copy(), model.body_quat.copy()))
        self._fixed_index.append(len(self._fixed) - 1)

    def log(self) -> StateLog:
        """Return the states recorded so far.

        Raises:
            ConfigError: no state was recorded.
        """
        if not self._times:
            raise ConfigError(f"no states recorded, got {len(self)}; call record() after each step")
        return StateLog(
            time=np.array(self._times),
            positions=np.array(self._qpos).reshape(len(self), -1),
            position_names=self._positions.names,
            position_units=self._positions.units,
            velocities=np.array(self._qvel).reshape(len(self), -1),
            velocity_names=self._velocities.names,
            velocity_units=self._velocities.units,
            fixed_positions=np.array([p for p, _ in self._fixed]),
            fixed_quaternions=from_wxyz(np.array([q for _, q in self._fixed])),
            fixed_index=np.array(self._fixed_index, dtype=np.int32),
            timestep=self._world.timestep,
            setup=self._setup,
        )
