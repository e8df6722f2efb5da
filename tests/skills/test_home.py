"""R1's work in the flat by skills alone: drawer, mug, door, table."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from roboyard.errors import RoboyardError
from roboyard.recording import SceneSetup, set_up
from roboyard.skills import Skills
from roboyard.skills.track_moves import tracks_here, whole_planner
from roboyard.skills.tracks import Drawn, Stage, stage_robot

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def example() -> Iterator[ModuleType]:
    sys.path.insert(0, str(EXAMPLES))
    try:
        yield importlib.import_module("r1_at_home")
    finally:
        sys.path.remove(str(EXAMPLES))


@pytest.fixture(scope="module")
def benchmark(example: ModuleType) -> ModuleType:
    spec = importlib.util.spec_from_file_location("home_benchmark", ROOT / "benchmarks" / "home.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def played(example: ModuleType, benchmark: ModuleType) -> tuple[SceneSetup, Any, list[float]]:
    """The work with robot, mug and drawer elsewhere; how high the mug was at its highest."""
    stage = set_up({"scene": "home", "robot": "r1"})
    benchmark.rearrange(stage, 4)
    world, robot, mug = stage.scene.world, stage.robot, stage.scene.body("mug")
    assert robot is not None
    moving = np.concatenate([robot.body.mujoco_ids, mug.mujoco_ids])
    last = world.frames()[0][moving].copy()
    heights: list[float] = []

    def watch(_: str) -> None:
        now = world.frames()[0][moving]
        assert np.abs(now - last).max() < 3.0 * robot.steps_per_control * world.timestep, "a jump"
        last[:] = now
        heights.append(float(mug.position[2]))
        assert not world.constraints.all, "nothing is welded"

    return stage, example.play(stage, watch, 4), heights


@pytest.mark.slow
def test_every_skill_succeeds_and_says_so(played: tuple[SceneSetup, Any, list[float]]) -> None:
    _, steps, _ = played
    assert all(steps), "\n".join(map(str, steps))
    assert [step.skill for step in steps] == [
        "navigate_to", "open", "grasp", "lift", "navigate_to", "open", "place",
    ]  # fmt: skip
    assert "open by" in str(steps[1])


@pytest.mark.slow
def test_the_world_is_as_the_skills_say(played: tuple[SceneSetup, Any, list[float]]) -> None:
    stage, _, heights = played
    scene = stage.scene
    assert scene.joints["kitchen_east/drawer_2"].position > 0.15
    assert scene.joints["bedroom_door/hinge"].position > np.radians(45)
    assert max(heights) > 0.74 + 0.10, "it was lifted from the table of 0.74 m"
    x, y, z = scene.body("mug").position
    assert abs(x + 2.9) < 0.55 and abs(y + 1.8) < 0.3 and z == pytest.approx(0.42, abs=0.01)


def test_a_straight_motion_goes_on_from_where_the_arm_is() -> None:
    stage = set_up({"scene": "home", "robot": "r1"})
    assert stage.robot is not None
    worker = Skills(stage.robot, stage.scene).worker
    for arm in worker.arm_names:
        planner, _ = whole_planner(worker, arm)
        stage_of = Stage(stage_robot(worker, planner, arm), planner.obstacles)
        drawn = Drawn(
            grips=np.array([[worker.grip_pose(arm)] * 2]),
            bases=np.array([[worker.base] * 2]),
            cost=np.zeros(1),
        )
        (track,) = tracks_here(worker, arm, drawn, worker.positions(worker.trunk_joints), stage_of)
        now = worker.positions(worker.arm_joints(arm))
        np.testing.assert_allclose(track.postures[:, -len(now) :], [now] * 2, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 8])
def test_the_mug_is_lifted_among_chairs_and_near_the_end_of_reach(
    example: ModuleType, benchmark: ModuleType, seed: int
) -> None:
    stage = set_up({"scene": "home", "robot": "r1"})
    benchmark.rearrange(stage, seed)
    assert stage.robot is not None
    skills = Skills(stage.robot, stage.scene, seed=seed)
    mug = stage.scene.body("mug")
    low = float(mug.position[2])
    assert skills.navigate_to("kitchen") and skills.open(example.DRAWER)
    assert skills.grasp("mug") and skills.lift("mug"), skills.log[-1].text
    assert skills.holds("mug") and float(mug.position[2]) > low + 0.1


def test_a_skill_that_fails_says_why_and_leaves_the_world_alone() -> None:
    stage = set_up({"scene": "home", "robot": "r1"})
    assert stage.robot is not None
    skills = Skills(stage.robot, stage.scene)
    sofa = np.array(stage.scene.body("sofa").position)
    result = skills.grasp("sofa")
    assert not result and "wider than" in result.text and result.attempts == 3
    assert "failed" in str(result)
    assert not skills.lift("mug") and "no gripper" in skills.log[-1].text
    assert not skills.place("mug", on="table")
    np.testing.assert_array_equal(stage.scene.body("sofa").position, sofa)
    assert not skills.holds("mug")
    for act in (
        lambda: skills.grasp("mugg"),
        lambda: skills.open("table/drawer"),
        lambda: skills.navigate_to("attic"),
    ):
        with pytest.raises(RoboyardError):
            act()
    with pytest.raises(RoboyardError, match="shape"):
        skills.follow_line([0, 0, 1])
