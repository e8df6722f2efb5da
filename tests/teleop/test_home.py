"""R1 in the scene home: it pushes doors open, faster than real time."""

from __future__ import annotations

import time

import numpy as np
import pytest

from roboyard.recording import SceneSetup, set_up
from roboyard.sensors import CameraSensor, Sensors, link_names


@pytest.fixture
def scene_setup() -> SceneSetup:
    return set_up({"scene": "home", "robot": "r1"})


def test_r1_pushes_the_bedroom_door_open_and_a_wall_stops_it(scene_setup: SceneSetup) -> None:
    hinge = scene_setup.scene.joints["bedroom_door/hinge"]
    robot, world = scene_setup.robot, scene_setup.scene.world
    assert robot is not None
    robot.set_pose((-1.725, -0.35, 0.0), (0.0, 0.0, np.sin(np.pi / 4), np.cos(np.pi / 4)))
    assert hinge.position < 0.02
    for _ in range(round(7.0 * robot.control_freq)):
        robot.apply_action({"base": np.array([0.4, 0.0, 0.0])})  # 0.6 m/s ahead, to the north
        world.step(robot.steps_per_control)
    assert hinge.position > 1.0
    assert 1.5 < robot.position[1] < 3.5, "the northern wall is at 3.6 m"


def test_r1_at_home_is_quicker_than_real_time(scene_setup: SceneSetup) -> None:
    robot, world = scene_setup.robot, scene_setup.scene.world
    assert robot is not None
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
