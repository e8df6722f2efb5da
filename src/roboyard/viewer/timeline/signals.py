"""Signals over the recorded time: lines for a plot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from roboyard.transforms import Array
from roboyard.viewer.timeline.moments import Frames, Moment

POSITION, VELOCITY, EFFORT = "joint position", "joint velocity", "effort"
FORCE, SENSOR = "contact force", "sensor"
KINDS = (POSITION, VELOCITY, EFFORT, FORCE, SENSOR)
"""Kinds of signals. Positions and velocities come with their targets, where the joint has a drive."""

Read = Callable[[Moment], float]
"""Returns one number of a recorded state; NaN: it has none."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Line:
    """One line of a plot."""

    label: str
    """Name with the unit."""
    values: Array
    """(n,) values; NaN where there is none."""


def names_of(kind: str, moments: Sequence[Moment]) -> tuple[str, ...]:
    """Return the names of the signals of one of `KINDS` in the newest of the recorded states."""
    if not moments:
        return ()
    newest = moments[-1]
    frames = newest.frames
    if kind == POSITION:
        return frames.position_columns.names
    if kind == VELOCITY:
        return frames.velocity_columns.names
    if kind == EFFORT:
        return frames.drives.names
    if kind == FORCE:
        links = newest.snapshot.links
        return tuple(path for path in links.rows if path not in _fixed_paths(newest))
    return tuple(
        f"{name}[{k}]" for name, values in newest.readings.sensors.items() for k in range(len(values))
    )


def lines(kind: str, name: str, moments: Sequence[Moment]) -> tuple[Line, ...]:
    """Return the lines of a signal over recorded states; none where no state has it.

    Args:
        kind: one of `KINDS`.
        name: one of `names_of`.
        moments: n states.
    """
    found: list[Line] = []
    for label, read in _readers(kind, name, moments):
        values = np.array([read(moment) for moment in moments], dtype=float)
        if np.isfinite(values).any():
            found.append(Line(label=label, values=values))
    return tuple(found)


def _readers(kind: str, name: str, moments: Sequence[Moment]) -> list[tuple[str, Read]]:
    if kind == SENSOR:
        return [(name, lambda moment: _sensor(moment, name))]
    if kind == FORCE:
        return [("force (N)", lambda moment: _force(moment, name))]
    if kind == EFFORT:
        at = _Places(name, lambda frames: (frames.drives.names, frames.drives.rows))
        unit = "N" if _unit(name, moments) == "m" else "N m"
        return [(f"effort ({unit})", lambda moment: at.of(moment, moment.readings.effort))]
    is_position = kind == POSITION
    columns = _Places(
        name,
        (lambda f: (f.position_columns.names, f.position_columns.places))
        if is_position
        else (lambda f: (f.velocity_columns.names, f.velocity_columns.places)),
    )
    unit = _column_unit(kind, name, moments)
    measured: Read = (
        (lambda moment: columns.of(moment, moment.snapshot.qpos))
        if is_position
        else (lambda moment: columns.of(moment, moment.qvel))
    )
    target = _Places(name, lambda f: (f.drives.names, f.drives.inputs + (0 if is_position else 1)))
    return [
        (f"{'position' if is_position else 'velocity'} ({unit})", measured),
        (f"target ({unit})", lambda moment: _target(moment, target, is_position=is_position)),
    ]


class _Places:
    """Index of a name in an array of each state; the index changes only with the bodies of the world."""

    def __init__(self, name: str, table: Callable[[Frames], tuple[tuple[str, ...], np.ndarray]]) -> None:
        self._name, self._table = name, table
        self._of: dict[int, int] = {}

    def place(self, moment: Moment) -> int:
        """Return the index; -1: there is none."""
        frames = moment.frames
        if id(frames) not in self._of:
            names, places = self._table(frames)
            found = names.index(self._name) if self._name in names else -1
            self._of[id(frames)] = int(places[found]) if found >= 0 else -1
        return self._of[id(frames)]

    def of(self, moment: Moment, values: Array) -> float:
        """Return the value of a state; NaN: it has none."""
        place = self.place(moment)
        return float(values[place]) if place >= 0 else np.nan


def _target(moment: Moment, target: _Places, *, is_position: bool) -> float:
    """Return a target; NaN where the drive follows none, its gain being zero."""
    value = target.of(moment, moment.readings.inputs)
    place = target.place(moment)
    if place < 0:
        return np.nan
    drives = moment.frames.drives
    index = int(np.flatnonzero(drives.inputs == place - (0 if is_position else 1))[0])
    stiffness, damping = moment.readings.gains[drives.rows[index]]
    follows = stiffness > 0 if is_position else damping > 0 and stiffness == 0
    return value if follows else np.nan


def _force(moment: Moment, path: str) -> float:
    """Return the size of the sum of the contact forces on a link (N)."""
    row = moment.snapshot.links.rows.get(path)
    if row is None:
        return np.nan
    at = np.flatnonzero(moment.readings.touched == row)
    return float(np.linalg.norm(moment.readings.contact_force[at[0]])) if len(at) else 0.0


def _sensor(moment: Moment, name: str) -> float:
    stem, _, index = name.removesuffix("]").rpartition("[")
    values = moment.readings.sensors.get(stem)
    return np.nan if values is None or int(index) >= len(values) else float(values[int(index)])


def _unit(name: str, moments: Sequence[Moment]) -> str:
    drives = moments[-1].frames.drives if moments else None
    return drives.units[drives.names.index(name)] if drives is not None and name in drives.names else ""


def _column_unit(kind: str, name: str, moments: Sequence[Moment]) -> str:
    if not moments:
        return ""
    frames = moments[-1].frames
    columns = frames.position_columns if kind == POSITION else frames.velocity_columns
    return columns.units[columns.names.index(name)] if name in columns.names else ""


def _fixed_paths(moment: Moment) -> set[str]:
    links = moment.snapshot.links
    return {links.paths[owner] for owner in links.fixed}
