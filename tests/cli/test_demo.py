"""The command `roboyard demo`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roboyard.assets import asset_path
from roboyard.cli import main
from roboyard.demo.load import find_source

BALL = """<robot name="ball"><link name="ball"><inertial><mass value="1"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
<visual><geometry><sphere radius="0.1"/></geometry></visual>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"""

BAD = {
    "broken XML": '<robot name="r"><link name="a"',
    "two roots": '<robot name="r"><link name="a"/><link name="b"/></robot>',
    "loop": """<robot name="r"><link name="a"/><link name="b"/>
      <joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>
      <joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint></robot>""",
    "missing mesh": """<robot name="r"><link name="a"><visual><geometry><mesh filename="no/such.stl"/>
      </geometry></visual></link></robot>""",
    "zero axis": """<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">
      <parent link="a"/><child link="b"/><axis xyz="0 0 0"/></joint></robot>""",
    "not a number": """<robot name="r"><link name="a"><inertial><mass value="nan"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link></robot>""",
}


@pytest.mark.parametrize("fault", list(BAD))
def test_errors_name_the_robot_file_and_nothing_is_written(
    fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bad.urdf"
    file.write_text(BAD[fault], encoding="utf-8")
    assert main(["demo", str(file), "--out", str(tmp_path / "out")]) == 1
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("roboyard: error: ")]
    assert lines
    assert "bad.urdf" in lines[0]
    assert not any("Traceback" in line or "unexpected" in line for line in lines)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.urdf"]


def test_a_robot_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", str(tmp_path / "none.urdf"), "--out", str(tmp_path / "out")]) == 1
    assert "none.urdf" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_something_else_is_refused_before_any_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.txt").write_text("years", encoding="utf-8")
    assert main(["demo", "--out", str(tmp_path)]) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize("word", ["name", "=path", "name=no/such/folder"])
def test_a_wrong_package_option(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--package", word]) == 1
    assert capsys.readouterr().err.startswith("roboyard: error: --package")


def test_json_is_the_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "ball.urdf"
    file.write_text(BALL, encoding="utf-8")
    out = tmp_path / "out"
    assert main(["demo", str(file), "--out", str(out), "--short", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary == json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert summary["robot"] == "ball"
    assert summary["joints"] == {}
    assert summary["mass"] == 1.0
    # a ball of 10 cm dropped on the floor comes to rest with its centre 10 cm above it
    assert summary["places"]["ball"][2] == pytest.approx(0.1, abs=0.002)


@pytest.mark.slow
def test_the_bundled_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--short", "--out", str(tmp_path / "demo")]) == 0
    out = capsys.readouterr().out
    assert "times real time" in out
    assert "Fixed in a copy" in out
    summary = json.loads((tmp_path / "demo" / "summary.json").read_text(encoding="utf-8"))
    assert summary["robot"] == "r1"
    assert not summary["stance"]["fell_when_dropped"]
    assert not summary["stance"]["fell_when_moved"]
    assert {fix["code"] for fix in summary["repairs"]} >= {"inertial-missing", "mesh-file-name"}
    assert all("moved" in joint or "follows" in joint["not_moved"] for joint in summary["joints"].values())


def test_a_bundled_robot_by_its_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "cartpole", "--out", str(tmp_path / "out"), "--short", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert (summary["robot"], summary["source"]) == ("cartpole", "bundled cartpole")


def test_a_robot_of_the_data_folder_precedes_a_bundled_one_of_the_same_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = tmp_path / "mine" / "models" / "rover"
    (model / "urdf").mkdir(parents=True)
    (model / "urdf" / "rover.urdf").write_text(BALL, encoding="utf-8")
    definition = (
        asset_path("rover/rover.yaml").read_text(encoding="utf-8").replace("urdf_path", "# urdf_path")
    )
    (model / "rover.yaml").write_text(definition, encoding="utf-8")
    monkeypatch.setenv("ROBOYARD_DATA", str(tmp_path))
    assert find_source("rover") == (model / "urdf" / "rover.urdf", "rover")
    assert find_source("arm7") == (asset_path("arm7"), "bundled arm7")


def test_an_unknown_name_lists_the_nearest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "cartpol", "--out", str(tmp_path / "out")]) == 1
    assert "cartpole" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
