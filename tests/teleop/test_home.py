"""R1 in the scene home: it drives about and opens doors, faster than real time."""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from roboyard.recording import SceneSetup, set_up
from roboyard.scenes.flat.plan import ACROSS, EAST, KITCHEN, SOUTH, WEST
from roboyard.sensors import CameraSensor, Sensors, link_names

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def example() -> Iterator[ModuleType]:
    sys.path.insert(0, str(EXAMPLES))
    try:
        yield importlib.import_module("r1_at_home")
    finally:
        sys.path.remove(str(EXAMPLES))


@pytest.fixture
def scene_setup() -> SceneSetup:
    return set_up({"scene": "home", "robot": "r1"})


@pytest.fixture(scope="module")
def played(example: ModuleType) -> tuple[SceneSetup, Any]:
    scene_setup = set_up({"scene": "home", "robot": "r1"})
    world, robot = scene_setup.scene.world, scene_setup.robot
    moving = np.concatenate([robot.body.mujoco_ids, scene_setup.scene.body("mug").mujoco_ids])
    last = world.frames()[0][moving].copy()

    def watch(_: str) -> None:
        now = world.frames()[0][moving]
        assert np.abs(now - last).max() < 3.0 * robot.steps_per_control * world.timestep, "a jump"
        last[:] = now

    return scene_setup, example.play(scene_setup, watch)


def test_r1_goes_from_the_kitchen_to_the_living_room(played: tuple[SceneSetup, Any]) -> None:
    places = played[1].places
    for part in ("kitchen", "drawer", "mug"):
        assert KITCHEN < places[part][0] < EAST and places[part][1] < ACROSS, part
    x, y = places["living room"]
    assert WEST < x < KITCHEN and SOUTH < y < ACROSS


def test_r1_opens_a_drawer_and_a_door_by_their_handles(played: tuple[SceneSetup, Any]) -> None:
    assert played[1].drawer > 0.10
    assert played[1].door > np.radians(45)


def test_r1_picks_the_mug_and_carries_it_by_friction(played: tuple[SceneSetup, Any]) -> None:
    scene_setup, result = played
    assert min(result.lifted) > 0.10
    assert result.carried < 0.05
    assert not scene_setup.scene.world.constraints.all, "nothing is welded"
    contacts = scene_setup.scene.world.contacts(scene_setup.scene.body("mug"))
    assert {c.link_b.name for c in contacts} >= {"left_gripper_link1", "left_gripper_link2"}
    assert {c.body_b for c in contacts} == {scene_setup.robot.body}


def test_r1_pushes_the_bedroom_door_open_and_a_wall_stops_it(
    scene_setup: SceneSetup, example: ModuleType
) -> None:
    hinge = scene_setup.scene.joints["bedroom_door/hinge"]
    actor = example.Actor(scene_setup)
    assert actor.go((-1.725, -0.35, np.pi / 2))
    assert hinge.position < 0.02
    assert actor.go((-1.725, 1.75, np.pi / 2))
    assert hinge.position > 1.0
    assert not actor.go((-1.725, 4.5, np.pi / 2), seconds=3.0)
    assert actor.base[1] < 3.6


def test_r1_at_home_is_quicker_than_real_time(scene_setup: SceneSetup) -> None:
    robot, world = scene_setup.robot, scene_setup.scene.world
    draw = np.random.default_rng(0)

    def run(seconds: float, sensors: Sensors | None) -> float:
        begin, until = time.process_time(), world.time + seconds
        while world.time < until:
            robot.apply_action(0.05 * draw.uniform(-1, 1, robot.action_dim))
            world.step(robot.steps_per_control)
            if sensors is not None:
                sensors.observe()
        return seconds / (time.process_time() - begin)

    run(1.0, None)
    assert run(5.0, None) > 5.0
    sensors = Sensors(world)
    camera = CameraSensor(robot.body.link("eyes"), rate=30, backend="software")
    name = sensors.add(camera)
    seen = link_names(world, sensors.observe()[name]["seg"])
    assert any(owner.startswith("walls/") for owner in seen.values())
    assert run(3.0, sensors) > 1.0
