"""R1 in the flat: it gets about, doors give way to it, and the whole is quicker than real time."""

from __future__ import annotations

import importlib.util
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from roboyard.recording import Stage, set_up
from roboyard.sensors import CameraSensor, Sensors, link_names

EXAMPLE = Path(__file__).parents[2] / "examples" / "r1_at_home.py"


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("r1_at_home", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def stage() -> Stage:
    return set_up({"scene": "home", "robot": "r1"})


def test_r1_goes_from_the_kitchen_to_the_living_room(stage: Stage, example: ModuleType) -> None:
    assert example.go(stage, stage.scene.rooms["kitchen"], 0.0)
    assert stage.scene.world.rays([(0.7, -1.3, 1.0)], [(2.0, -1.3, 1.0)]).hit.any(), (
        "R1 stands in the kitchen"
    )
    assert example.go(stage, stage.scene.rooms["living room"], np.pi)
    assert np.allclose(example.base_pose(stage)[0], stage.scene.rooms["living room"], atol=0.07)


def test_r1_pushes_the_bedroom_door_open_and_a_wall_stops_it(stage: Stage, example: ModuleType) -> None:
    hinge = stage.scene.joints["bedroom_door/hinge"]
    assert example.go(stage, (-1.725, -0.35), np.pi / 2)
    assert hinge.position < 0.02
    assert example.go(stage, (-1.725, 1.75), np.pi / 2)
    assert hinge.position > 1.0
    assert not example.go(stage, (-1.725, 4.5), np.pi / 2, seconds=3.0)
    assert example.base_pose(stage)[0][1] < 3.6


def test_r1_at_home_is_quicker_than_real_time(stage: Stage) -> None:
    robot, world = stage.robot, stage.scene.world
    draw = np.random.default_rng(0)

    def run(seconds: float, sensors: Sensors | None) -> float:
        begin, until = time.perf_counter(), world.time + seconds
        while world.time < until:
            robot.apply_action(0.05 * draw.uniform(-1, 1, robot.action_dim))
            world.step(robot.steps_per_control)
            if sensors is not None:
                sensors.observe()
        return seconds / (time.perf_counter() - begin)

    run(1.0, None)
    assert run(5.0, None) > 5.0
    sensors = Sensors(world)
    camera = CameraSensor(robot.body.link("eyes"), rate=30, backend="software")
    name = sensors.add(camera)
    seen = link_names(world, sensors.observe()[name]["seg"])
    assert any(owner.startswith("walls/") for owner in seen.values())
    assert run(3.0, sensors) > 1.0
