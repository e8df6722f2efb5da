"""Robots in full worlds recorded as datasets: driven by plans, skills and keys, and repeated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pq: Any = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("imageio_ffmpeg")

from roboyard import World, add_robot  # noqa: E402
from roboyard.assets import asset_path  # noqa: E402
from roboyard.cli import main  # noqa: E402
from roboyard.envs.datasets import RobotRecorder  # noqa: E402
from roboyard.errors import ConfigError, RoboyardError  # noqa: E402
from roboyard.planning import Follower, planner_for  # noqa: E402
from roboyard.recording import set_up  # noqa: E402
from roboyard.teleop import drive  # noqa: E402

POSITION = {
    "name": "JointController",
    "motor_type": "position",
    "use_delta_commands": False,
    "command_output_limits": None,
}


def read(folder: Path) -> dict[str, list[Any]]:
    return pq.read_table(folder / "data" / "chunk-000" / "file-000.parquet").to_pydict()


def arm() -> Any:
    world = World()
    world.add_plane()
    robot = add_robot(world, str(asset_path("arm7")))
    robot.joint_positions = [0.0, 0.6, 0.0, -1.2, 0.0, 0.8, 0.0]
    robot.reload_controllers({"arm_0": POSITION}, action_normalize=False)
    return robot


def test_the_steps_of_a_follower_are_recorded_and_repeat(tmp_path: Path) -> None:
    robot = arm()
    start = robot.world.save_state()
    follower = Follower(planner_for(robot).planner(), robot.joint_positions)
    goal = robot.joint_positions + np.array([0.4, -0.2, 0.3, 0.2, 0.0, 0.1, 0.0])
    states = []
    with RobotRecorder(tmp_path / "set", robot, text="follow", cameras={}) as recorder:
        for _ in range(20):
            states.append(robot.joint_positions)
            robot.apply_action(follower.step(goal, 1.0 / robot.control_freq).q)
            robot.world.step(robot.steps_per_control)
            recorder()
        recorder.end_episode(success=True)
    table = read(tmp_path / "set")
    assert np.array_equal(np.float32(table["observation.state"]), np.float32(states))
    assert table["next.done"] == [False] * 19 + [True]
    assert table["next.success"] == [False] * 19 + [True]
    names = json.loads((tmp_path / "set" / "meta" / "info.json").read_text())["features"]["action"]["names"]
    assert names == list(robot.joint_names)
    # the commands lead the joints: with the recorded ones as goals the arm goes the same way
    robot.world.restore_state(start)
    robot.reset()
    robot.world.restore_state(start)
    for action in table["action"]:
        robot.apply_action(action)
        robot.world.step(robot.steps_per_control)
    assert np.abs(np.array(table["action"][-1]) - goal).max() < 0.15
    np.testing.assert_allclose(robot.joint_positions, states[-1], atol=0.06)


def test_episodes_end_where_time_goes_back(tmp_path: Path) -> None:
    stage = set_up({"scene": "empty", "robot": "rover"})
    keys = iter([["i"]] * 6 + [["r"]] + [["i"]] * 5 + [["escape"]])
    assert stage.robot is not None
    with RobotRecorder(tmp_path / "set", stage.robot, text="forwards", cameras={}) as recorder:
        count = drive(stage, "teleop", keys=lambda: next(keys), watch=recorder)
    assert count == 12
    table = read(tmp_path / "set")
    assert table["episode_index"] == [0] * 6 + [1] * 5  # less the step with the reset, whose start is unknown
    first = np.array(table["observation.state"])
    assert first.shape == (11, len(stage.robot.joint_names) + 7)
    assert first[5, -7] > first[0, -7] and abs(first[6, -7] - first[0, -7]) < 0.05
    assert np.abs(table["action"]).max() > 0.1


def test_the_command_writes_a_dataset_with_a_film(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    folder = tmp_path / "drives"
    words = ["drive", "rover", "--scene", "empty", "--control-mode", "random", "--seed", "1"]
    assert main([*words, "--short-exec", "--dataset", str(folder), "--text", "around"]) == 0
    assert f"wrote {folder}" in capsys.readouterr().out
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert info["total_frames"] == 100 and info["fps"] == 30
    assert info["features"]["observation.images.scene"]["shape"] == [240, 320, 3]
    assert json.loads((folder / "meta" / "roboyard.json").read_text())["setup"]["robot"] == "rover"
    assert main([*words, "--dataset", str(folder), "--short-exec"]) != 0
    assert "exists" in capsys.readouterr().err


def test_wrong_rates_and_errors_leave_nothing(tmp_path: Path) -> None:
    robot = arm()
    with pytest.raises(ConfigError, match="every"):
        RobotRecorder(tmp_path / "a", robot, text="x", every=0)
    with pytest.raises(ConfigError, match="fps"):
        RobotRecorder(tmp_path / "a", robot, text="x", every=7)
    with pytest.raises(RoboyardError), RobotRecorder(tmp_path / "a", robot, text="x", cameras={}) as recorder:
        robot.world.step(robot.steps_per_control)
        recorder()
        robot.apply_action([0.0])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_skills_are_recorded(tmp_path: Path) -> None:
    from roboyard.skills import Skills

    stage = set_up({"scene": "tabletop", "robot": "r1"})
    assert stage.robot is not None
    with RobotRecorder(tmp_path / "set", stage.robot, text="take the can", cameras={}, every=3) as recorder:
        skills = Skills(stage.robot, stage.scene, watch=recorder)
        done = skills.navigate_to("can") and skills.grasp("can")
        recorder.end_episode(success=bool(done))
    table = read(tmp_path / "set")
    assert done and table["next.success"][-1] and len(table["index"]) > 20
    assert np.isfinite(table["action"]).all()
