"""Many sensors, each observing at its own rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboyard.errors import RoboyardError, unknown_name
from roboyard.sensors.base import Observation, Sensor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from roboyard.sim import World

SLACK = 1e-9
"""s: rounding of the clock."""


class Sensors:
    """Sensors of one world by name. `observe` after each step: what is due looks again, the rest stays."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._sensors: dict[str, Sensor] = {}
        self._latest: dict[str, Observation] = {}
        self._next: dict[str, float] = {}
        self._seen_time = world.time

    @property
    def names(self) -> tuple[str, ...]:
        """In the order they were added."""
        return tuple(self._sensors)

    def __getitem__(self, name: str) -> Sensor:
        if name not in self._sensors:
            raise RoboyardError(unknown_name("sensor", name, self._sensors))
        return self._sensors[name]

    def add(self, sensor: Sensor, name: str | None = None) -> str:
        """Add a sensor; returns its name, "<robot>:<link>:<kind>:<count>" unless given.

        Raises:
            RoboyardError: the name is taken, or the sensor is in another world.
        """
        if sensor.world is not self._world:
            raise RoboyardError(f"{sensor.kind} on {sensor.link.name!r} is in another world")
        if name is None:
            stem = f"{sensor.link.body.name}:{sensor.link.name}:{sensor.kind}:"
            name = next(
                f"{stem}{k}" for k in range(len(self._sensors) + 1) if f"{stem}{k}" not in self._sensors
            )
        elif name in self._sensors:
            raise RoboyardError(f"there is a sensor named {name!r} already")
        self._sensors[name] = sensor
        return name

    def remove(self, name: str) -> None:
        """Take a sensor out."""
        self[name]
        for table in (self._sensors, self._latest, self._next):
            table.pop(name, None)

    def observe(self, *, fresh: bool = False) -> Mapping[str, Observation]:
        """Latest observation of every sensor by name; those that are due look again first.

        Sensors of rate f observe in each of the intervals of 1/f that began when the first observation was
        made. Going back in time makes everything due.

        Args:
            fresh: everything looks again, due or not.
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
