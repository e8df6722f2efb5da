"""Every command takes its robot in the same way, and reports as JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from roboyard import cli
from roboyard.assets import asset_path
from roboyard.cli import help_text
from roboyard.rendering import Camera
from roboyard.teleop.film_camera import MIDDLE, keep_in_view


@pytest.fixture(autouse=True)
def own_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path / "data"))
    monkeypatch.chdir(tmp_path)


def run(words: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = cli.main(words.split())
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.mark.parametrize("command", ["audit", "repair --out fixed", "infer", "validate --gate settle"])
@pytest.mark.parametrize("robot", ["arm7", "FILE"])
def test_a_robot_is_a_name_or_a_file(command: str, robot: str, capsys: pytest.CaptureFixture[str]) -> None:
    name, *options = command.split()
    given = robot.replace("FILE", str(asset_path("arm7")))
    code, out, err = run(" ".join([name, given, *options]), capsys)
    assert code == 0, err
    assert "arm7" in out


@pytest.mark.parametrize(
    "command", ["audit", "repair --out fixed", "infer", "validate", "import", "drive", "plan"]
)
def test_an_unknown_name_is_answered_with_the_nearest(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    name, *options = command.split()
    options += ["--scene", "empty", "--control-mode", "random"] if name == "drive" else []
    options += ["--to", "0.4,0.3,0.5"] if name == "plan" else []
    code, out, err = run(" ".join([name, "armm7", *options]), capsys)
    assert (code, out) == (1, "")
    assert "did you mean 'arm7'" in err
    assert not list(Path().iterdir()), "something was written"


def test_a_robot_file_is_driven(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = f"drive {asset_path('rover')} --scene empty --pose 1,2 --control-mode random --short-exec --json"
    code, out, err = run(words, capsys)
    assert code == 0, err
    done = json.loads(out)
    assert (done["scene"], done["mode"], done["actions"], done["files"]) == ("empty", "random", 100, [])
    assert "imported" in err or "importing rover.urdf for this run" in err
    assert not list(tmp_path.iterdir()), "the import is temporary"


def test_an_import_is_driven_by_its_definition_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run(f"import {asset_path('rover')} --name mine --no-validate --no-report --out other", capsys)[0] == 0
    )
    (definition,) = tmp_path.glob("other/*/models/mine/mine.yaml")
    words = f"drive {definition} --scene empty --control-mode random --short-exec --log moved.npz"
    assert run(words, capsys)[0] == 0
    code, out, _ = run("replay moved.npz --json", capsys)
    assert code == 0
    summary = json.loads(out)
    assert summary["states"] == 100
    assert any(row["max"] - row["min"] > 0.01 for row in summary["moving"])


def test_a_folder_of_robots_is_asked_about_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = '<robot name="{0}"><link name="base"/></robot>'
    for name in ("one", "two"):
        (tmp_path / f"{name}.urdf").write_text(text.format(name))
    asked: list[str] = []

    def choose(question: str, options: list[str], default: str) -> str:
        asked.append(question)
        return "two.urdf"

    monkeypatch.setattr("roboyard.teleop.choices.has_terminal", lambda: True)
    monkeypatch.setattr("roboyard.teleop.choices.choose", choose)
    words = f"drive {tmp_path} --scene empty --control-mode random --short-exec"
    _, _, err = run(words, capsys)
    assert "importing two.urdf for this run" in err
    assert len(asked) == 1, asked


def test_a_log_needs_a_robot_that_stays(capsys: pytest.CaptureFixture[str]) -> None:
    words = f"drive {asset_path('arm7')} --scene empty --control-mode random --short-exec --log arm.npz"
    code, _, err = run(words, capsys)
    assert code == 1
    assert "import it first" in err


@pytest.mark.parametrize(
    ("words", "missing"),
    [
        ("drive", "Scene?"),
        ("drive --scene empty", "Robot?"),
        ("drive r1 --scene empty", "Control mode?"),
    ],
)
def test_nothing_is_asked_without_a_terminal(
    words: str, missing: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: False, fileno=lambda: -1))
    code, out, err = run(words, capsys)
    assert (code, out) == (1, "")
    assert f"no terminal to ask {missing!r} on" in err


@pytest.mark.parametrize("pose", ["here", "1", "1,2,3,4"])
def test_a_wrong_pose_is_one_line(pose: str, capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(f"drive rover --scene empty --control-mode random --short-exec --pose {pose}", capsys)
    assert code == 1
    assert "give X,Y or X,Y,YAW" in err


@pytest.mark.slow
def test_a_plan_is_json(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run("plan arm7 --to 0.4,0.3,0.5 --json", capsys)
    assert code == 0, err
    made = json.loads(out)
    assert made["outcome"] == "solved"
    assert np.asarray(made["path"]).shape[1] == 7
    assert [Path(file).stat().st_size > 1000 for file in made["files"]] == [True, True]


def test_versions_are_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert "mujoco" in json.loads(run("version --json", capsys)[1])


INTERACTIVE = {"view", "run", "serve"}
"""Commands that run until they are stopped, or whose output is a script's."""


def test_every_command_that_reports_has_json(capsys: pytest.CaptureFixture[str]) -> None:
    for name in cli.COMMANDS:
        if name not in INTERACTIVE:
            assert "--json" in run(f"{name} --help", capsys)[1], name


def test_every_command_of_a_robot_takes_it_as_argument(capsys: pytest.CaptureFixture[str]) -> None:
    listed = [name for names in help_text.GROUPS.values() for name in names]
    for name in set(listed) - {"robots", "replay", "run", "serve", "doctor", "version", "import-all"}:
        usage = run(f"{name} --help", capsys)[1].splitlines()[0]
        assert "ROBOT" in usage, usage


def test_a_film_keeps_the_robot_in_its_middle() -> None:
    camera = Camera.look_at((3.0, 0.0, 2.0), (0.0, 0.0, 0.0), width=320, height=240)
    assert keep_in_view(camera, (0.1, 0.1, 0.2)) is camera
    assert keep_in_view(camera, (9.0, 0.0, 2.0)) is camera, "behind the camera"
    for point in ((-4.0, 6.0, 0.0), (0.0, -3.0, 1.0), (2.0, 0.5, -3.0)):
        moved = keep_in_view(camera, point)
        clip = moved.projection @ moved.view @ np.append(point, 1.0)
        assert np.abs(clip[:2] / clip[3]).max() == pytest.approx(MIDDLE)
        assert np.array_equal(moved.view[:3, :3], camera.view[:3, :3]), "the camera has turned"
