"""Signals over the recorded time, against the numbers that the world had."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from roboyard import World
from roboyard.assets import asset_path
from roboyard.sensors import CameraSensor, Imu

pytest.importorskip("viser")
from roboyard.viewer.scene.snapshot import gather_links, take
from roboyard.viewer.timeline.moments import Moments
from roboyard.viewer.timeline.signals import (
    EFFORT,
    FORCE,
    KINDS,
    POSITION,
    SENSOR,
    VELOCITY,
    lines,
    names_of,
)


def recorded(world: World, moments: Moments, steps: int, **read: Any) -> dict[str, list[float]]:
    """Step a world, record each step, and return what the functions return after each."""
    values: dict[str, list[float]] = {name: [] for name in read}
    links = gather_links(world)
    for _ in range(steps):
        world.step()
        assert moments.record(world, take(world, world.model, links))
        for name, of in read.items():
            values[name].append(float(of()))
    return values


def test_positions_velocities_efforts_and_targets() -> None:
    world, moments = World(timestep=0.005), Moments(period=0.0)
    arm = world.add_urdf(asset_path("arm7"), fixed_base=True)
    one, two, three = arm.joint("joint2"), arm.joint("joint4"), arm.joint("joint6")
    one.drive_position(0.4)
    two.drive_velocity(0.3)
    three.disable_drive()
    values = recorded(
        world,
        moments,
        40,
        position=lambda: one.position,
        velocity=lambda: two.velocity,
        effort=lambda: one.applied_effort,
    )
    kept = moments.all()
    assert "arm7/joint2" in names_of(POSITION, kept)
    measured, target = lines(POSITION, "arm7/joint2", kept)
    assert (measured.label, target.label) == ("position (rad)", "target (rad)")
    np.testing.assert_array_equal(measured.values, values["position"])
    np.testing.assert_array_equal(target.values, np.full(40, 0.4))
    measured, target = lines(VELOCITY, "arm7/joint4", kept)
    np.testing.assert_array_equal(measured.values, values["velocity"])
    np.testing.assert_array_equal(target.values, np.full(40, 0.3))
    (effort,) = lines(EFFORT, "arm7/joint2", kept)
    assert effort.label == "effort (N m)"
    np.testing.assert_array_equal(effort.values, values["effort"])
    assert np.ptp(effort.values) > 0.1
    # a drive has a target only where its gain follows it
    assert len(lines(POSITION, "arm7/joint4", kept)) == 1
    assert len(lines(POSITION, "arm7/joint6", kept)) == len(lines(VELOCITY, "arm7/joint6", kept)) == 1


def test_the_contact_force_is_the_weight_at_rest() -> None:
    world, moments = World(), Moments()
    world.add_plane()
    world.add_box((0.2, 0.2, 0.2), position=(0.0, 0.0, 0.3), mass=2.0, name="box")
    links = gather_links(world)
    for _ in range(300):
        world.step()
        moments.record(world, take(world, world.model, links))
    kept = moments.all()
    (name,) = names_of(FORCE, kept)
    assert name.startswith("/box/")
    (force,) = lines(FORCE, name, kept)
    assert force.values[0] == 0.0  # it falls
    assert force.values[-1] == pytest.approx(2.0 * 9.81, rel=0.01)


def test_sensors_are_recorded_and_change_no_simulation() -> None:
    def fall(*, is_recorded: bool) -> tuple[np.ndarray, tuple[Any, ...]]:
        world, moments = World(), Moments()
        world.add_plane()
        box = world.add_box((0.2, 0.2, 0.2), position=(0.0, 0.0, 0.3), mass=2.0, name="box")
        links = gather_links(world)
        moments.sensors["imu"] = Imu(box.links[0])
        for _ in range(200):
            world.step()
            if is_recorded:
                moments.record(world, take(world, world.model, links))
        return world.data.qpos.copy(), moments.all()

    alone, _ = fall(is_recorded=False)
    watched, kept = fall(is_recorded=True)
    np.testing.assert_array_equal(alone, watched)
    assert "imu/acceleration[2]" in names_of(SENSOR, kept)
    (up,) = lines(SENSOR, "imu/acceleration[2]", kept)
    assert up.values[0] == pytest.approx(0.0, abs=1e-6)  # free fall
    assert up.values[-1] == pytest.approx(9.81, rel=0.01)


def test_pictures_are_not_recorded() -> None:
    world, moments = World(), Moments()
    box = world.add_box((0.2, 0.2, 0.2), name="box")
    moments.sensors["camera"] = CameraSensor(box.links[0], width=8, height=8)
    recorded(world, moments, 1)
    assert names_of(SENSOR, moments.all()) == ()


def test_a_body_added_later_has_no_values_before() -> None:
    world, moments = World(), Moments(period=0.0)
    world.add_box((0.2, 0.2, 0.2), name="one")
    recorded(world, moments, 3)
    two = world.add_box((0.2, 0.2, 0.2), position=(1.0, 0.0, 2.0), name="two")
    values = recorded(world, moments, 3, height=lambda: two.position[2])
    (height,) = lines(POSITION, "two/base.z", moments.all())
    assert np.isnan(height.values[:3]).all()
    np.testing.assert_array_equal(height.values[3:], values["height"])
    assert lines(POSITION, "three/base.z", moments.all()) == ()


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_recorded_has_no_names(kind: str) -> None:
    assert names_of(kind, ()) == ()
    assert lines(kind, "x[0]", ()) == ()
