"""A set of sensors, each observing at its own rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.errors import RoboyardError, unknown_name
from roboyard.sensors.base import Observation, Sensor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from roboyard.sim import World

SLACK = 1e-9
"""Tolerance of the comparison of times (s)."""


class Sensors:
    """Sensors of one world by name; `observe` after each step updates those that are due."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._sensors: dict[str, Sensor] = {}
        self._latest: dict[str, Observation] = {}
        self._next: dict[str, float] = {}
        self._seen_time = world.time

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order in which the sensors were added."""
        return tuple(self._sensors)

    def __getitem__(self, name: str) -> Sensor:
        if name not in self._sensors:
            raise RoboyardError(unknown_name("sensor", name, self._sensors))
        return self._sensors[name]

    def add(self, sensor: Sensor, name: str | None = None) -> str:
        """Add a sensor and return its name, "<robot>:<link>:<kind>:<count>" by default.

        Raises:
            RoboyardError: the name is taken, or the sensor is in another world.
        """
        if sensor.world is not self._world:
            raise RoboyardError(
                f"{sensor.kind} on {sensor.link.name!r} is in another world; add it to the sensors of its own"
            )
        if name is None:
            stem = f"{sensor.link.body.name}:{sensor.link.name}:{sensor.kind}:"
            name = next(
                f"{stem}{k}" for k in range(len(self._sensors) + 1) if f"{stem}{k}" not in self._sensors
            )
        elif name in self._sensors:
            raise RoboyardError(f"a sensor named {name!r} already exists; choose another name")
        self._sensors[name] = sensor
        return name

    def remove(self, name: str) -> None:
        """Remove a sensor.

        Raises:
            RoboyardError: no sensor has this name.
        """
        self[name]
        for table in (self._sensors, self._latest, self._next):
            table.pop(name, None)

    def observe(self, *, fresh: bool = False) -> Mapping[str, Observation]:
        """Return the latest observation of every sensor by name, after updating those that are due.

        A sensor of rate f observes once in each interval of 1/f, counted from its first observation. After a
        reset to an earlier time every sensor is due.

        Args:
            fresh: update every sensor, due or not.
        """
        now = self._world.time
        if now < self._seen_time - SLACK:
            self._next.clear()
        self._seen_time = now
        for name, sensor in self._sensors.items():
            due = self._next.get(name)
            if fresh or due is None or now >= due - SLACK:
                self._latest[name] = sensor.observe()
                if sensor.rate is not None:
                    period = 1.0 / sensor.rate
                    start = now if due is None else due
                    ahead = int((now - start + SLACK) / period) + 1 if now >= start - SLACK else 0
                    self._next[name] = start + ahead * period
        return dict(self._latest)
