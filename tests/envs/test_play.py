"""Policies that are run: episodes, films, and the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.envs as envs
from roboyard.cli import main
from roboyard.envs.play import play
from roboyard.envs.policy import Policy
from roboyard.errors import ConfigError


def towards_the_goal() -> Policy:
    """The tip moves along the last three numbers of the observation, the way to the goal."""
    weight = np.zeros((3, 17))
    weight[:, 14:] = 20.0 * np.eye(3)
    return Policy(
        task="roboyard/Reach-v0", options={"control": "tip", "limit": 40}, layers=((weight, np.zeros(3)),)
    )


def test_episodes_and_a_film(tmp_path: Path) -> None:
    from PIL import Image

    found = list(play(towards_the_goal(), steps=100, record=tmp_path / "a.gif"))
    assert [(e.number, e.steps, e.end) for e in found] == [
        (1, 40, "limit"),
        (2, 40, "limit"),
        (3, 20, "stopped"),
    ]
    assert sum(bool(e.success) for e in found) >= 2
    film: Any = Image.open(tmp_path / "a.gif")
    assert film.n_frames >= 40


def test_a_policy_of_another_task_is_an_error() -> None:
    policy = Policy(task="roboyard/Reach-v0", layers=((np.zeros((3, 5)), np.zeros(3)),))
    with pytest.raises(ConfigError, match="5 inputs and 3 outputs"):
        next(play(policy))


def test_the_command_runs_a_policy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "reach.json"
    towards_the_goal().save(file)
    assert main(["drive", "--policy", str(file), "--short-exec"]) == 0
    shown = capsys.readouterr().out
    assert "episode 2: 40 steps" in shown and "goal reached" in shown
    assert main(["drive", "r1", "--policy", str(file)]) != 0
    assert main(["drive", "--policy", str(tmp_path / "none.json")]) != 0
    assert "none.json" in capsys.readouterr().err


def test_a_robot_outside_the_policys_folder_is_not_opened(tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    towards_the_goal().save(file)
    for robot in ("../robot.urdf", "/etc/robot.urdf"):
        content = json.loads(file.read_text())
        content["options"]["robot"] = robot
        (tmp_path / "q.json").write_text(json.dumps(content))
        with pytest.raises(ConfigError, match="not in the policy's folder"):
            envs.load_policy(tmp_path / "q.json")
