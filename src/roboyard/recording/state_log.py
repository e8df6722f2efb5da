"""The state of a world over time, in one NumPy archive that says what each column is.

time            (n,) s
positions       (n, p) in the units of position_units, columns named by position_names
velocities      (n, v) likewise
fixed_positions (m, f, 3) m and fixed_quaternions (m, f, 4) x, y, z, w of all frames in their parents, once
                for each time they changed
fixed_index     (n,) which of the m holds
about           JSON: version, how the world was set up, its time step
"""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard.errors import ConfigError
from roboyard.recording.columns import position_columns, velocity_columns
from roboyard.transforms import Array, from_wxyz, to_wxyz

if TYPE_CHECKING:
    from roboyard.sim import World

VERSION = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class StateLog:
    """A recorded motion."""

    time: Array
    """(n,) s"""
    positions: Array
    """(n, p)"""
    position_names: tuple[str, ...]
    position_units: tuple[str, ...]
    velocities: Array
    """(n, v)"""
    velocity_names: tuple[str, ...]
    velocity_units: tuple[str, ...]
    fixed_positions: Array
    fixed_quaternions: Array
    fixed_index: np.ndarray
    timestep: float
    """s of the world that was recorded"""
    setup: dict[str, Any] = field(default_factory=dict)
    """How to make the world again (see `roboyard.recording.set_up`); empty where only the caller knows."""

    def __len__(self) -> int:
        return len(self.time)

    def column(self, name: str) -> Array:
        """(n,) positions of one column, as "r1/torso_joint1".

        Raises:
            ConfigError: there is none of this name.
        """
        from roboyard.errors import unknown_name

        if name not in self.position_names:
            raise ConfigError(unknown_name("column", name, self.position_names))
        return self.positions[:, self.position_names.index(name)]

    def check_fits(self, world: World) -> None:
        """See that a world has the bodies and joints of this log.

        Raises:
            ConfigError: it has others; the message names one.
        """
        mine, there = self.position_names, position_columns(world).names
        if mine != there:
            missing = [name for name in mine if name not in there]
            extra = [name for name in there if name not in mine]
            told = (
                f"it lacks {missing[0]!r}"
                if missing
                else f"it also has {extra[0]!r}"
                if extra
                else "in another order"
            )
            raise ConfigError(f"the log is of another world: {told}")
        if self.fixed_positions.shape[1] != world.model.nbody:
            count = self.fixed_positions.shape[1]
            raise ConfigError(f"the log is of another world: it has {count} frames, here {world.model.nbody}")

    def restore(self, world: World, k: int) -> None:
        """Put moment k into a world that `check_fits`: the very numbers that were recorded."""
        places, speeds = position_columns(world).places, velocity_columns(world).places
        model, data = world.model, world.data
        data.qpos[places] = self.positions[k]
        data.qvel[speeds] = self.velocities[k]
        data.time = self.time[k]
        version = int(self.fixed_index[k])
        model.body_pos[:] = self.fixed_positions[version]
        model.body_quat[:] = to_wxyz(self.fixed_quaternions[version])
        world.mark_moved()

    def save(self, path: str | Path) -> Path:
        """Write the archive; returns its path, which ends in .npz."""
        target = Path(path)
        if target.suffix != ".npz":
            raise ConfigError(f"a state log is a .npz file; got {str(path)!r}")
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
    """Read a state log.

    Raises:
        ConfigError: the file is missing, is no state log, or contradicts itself.
    """
    source = Path(path)
    if not source.is_file():
        raise ConfigError(f"there is no state log {str(path)!r}")
    try:
        with np.load(source, allow_pickle=False) as archive:
            data = {name: archive[name] for name in archive.files}
        about = json.loads(str(data["about"]))
        version = about["version"]
        if version != VERSION:
            raise ConfigError(f"{source.name}: a log of version {version}; this Roboyard reads {VERSION}")
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
        raise ConfigError(f"{source.name} is no state log: it has no {error}") from None
    except (ValueError, TypeError, OSError, EOFError, zipfile.BadZipFile) as error:
        told = " ".join(str(error).split())
        if "pickle" in told:  # NumPy's words for what is no archive, with an unsafe remedy
            told = "give the .npz file that `roboyard drive --log` or Recorder.log().save() wrote"
        raise ConfigError(f"{source.name} is no state log: {told}") from None
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
        raise ConfigError(f"{source.name} contradicts itself: its arrays do not fit one another")
    return log


class Recorder:
    """Takes moments of one world; bodies must not come or go meanwhile."""

    def __init__(self, world: World, *, setup: dict[str, Any] | None = None) -> None:
        """Begin; `setup` (JSON-able) says how to make the world again."""
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
        return len(self._times)

    def take(self) -> None:
        """Append the present moment.

        Raises:
            ConfigError: bodies were added or removed since the recording began.
        """
        world = self._world
        if tuple(world.body_by_id) != self._signature:
            raise ConfigError("bodies were added or removed during the recording; begin a new one")
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
        """Everything so far.

        Raises:
            ConfigError: nothing was taken.
        """
        if not self._times:
            raise ConfigError("nothing was recorded")
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
