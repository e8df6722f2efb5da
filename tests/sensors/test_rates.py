"""Sensor sets: names and observation rates."""

from __future__ import annotations

import pytest

from roboyard.errors import RoboyardError
from roboyard.sensors import Imu, Lidar, Sensors
from roboyard.sensors.base import Observation
from roboyard.sim import Body, World


class Clock(Imu):
    """A sensor that records the time of each observation."""

    def observe(self) -> Observation:
        return {"time": self.world.time}


def test_names_count_by_link_and_kind(world: World, mast: Body) -> None:
    sensors = Sensors(world)
    names = [sensors.add(Imu(mast.link("head"))) for _ in range(2)]
    names.append(sensors.add(Lidar(mast.link("head"))))
    names.append(sensors.add(Lidar(mast.link("ear")), "front"))
    assert names == ["mast:head:IMU:0", "mast:head:IMU:1", "mast:head:Lidar:0", "front"]
    assert sensors.names == tuple(names)
    with pytest.raises(RoboyardError, match="named 'front' already"):
        sensors.add(Imu(mast.link("head")), "front")
    with pytest.raises(RoboyardError, match=r"no sensor named 'fron'; did you mean 'front'\?"):
        sensors.remove("fron")
    sensors.remove("front")
    assert "front" not in sensors.observe()


@pytest.mark.parametrize(
    ("rate", "expected"), [(30.0, 30), (240.0, 240), (100.0, 100), (7.0, 7), (None, 240)]
)
def test_each_sensor_observes_at_its_own_rate(
    world: World, mast: Body, rate: float | None, expected: int
) -> None:
    sensors = Sensors(world)
    name = sensors.add(Clock(mast.link("head"), rate=rate))
    times = set()
    for _ in range(240):
        times.add(sensors.observe()[name]["time"])
        world.step()
    assert len(times) == expected


def test_reset_to_an_earlier_time_observes_again(world: World, mast: Body) -> None:
    sensors = Sensors(world)
    name = sensors.add(Clock(mast.link("head"), rate=1.0))
    start = world.save_state()
    world.step(100)
    assert sensors.observe()[name]["time"] > 0.4
    world.restore_state(start)
    assert sensors.observe()[name]["time"] == 0.0
    world.step(10)
    assert sensors.observe()[name]["time"] == 0.0
    assert sensors.observe(fresh=True)[name]["time"] > 0.0


def test_rates_and_worlds_are_checked(world: World, mast: Body) -> None:
    with pytest.raises(RoboyardError, match="rate must be above 0 Hz, got -1"):
        Imu(mast.link("head"), rate=-1)
    with pytest.raises(RoboyardError, match="is in another world"):
        Sensors(World()).add(Imu(mast.link("head")))
