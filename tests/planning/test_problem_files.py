"""The file of problems: every kind of obstacle and goal, results in the documented form, wrong entries."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from roboyard import cli
from roboyard.errors import ConfigError
from roboyard.planning import load_problems

ARM = """<robot name="two">
 <link name="base"/>
 <joint name="j1" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
 <link name="upper"><collision><origin xyz="0.25 0 0" rpy="0 1.5708 0"/>
  <geometry><cylinder radius="0.03" length="0.5"/></geometry></collision></link>
 <joint name="j2" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0.08"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="1"/></joint>
 <link name="lower"><collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.05 0.05"/></geometry>
  </collision></link>
 <joint name="finger" type="prismatic"><parent link="lower"/><child link="tip"/><origin xyz="0.4 0 0"/>
  <axis xyz="1 0 0"/><limit lower="0" upper="0.1" velocity="1" effort="1"/></joint>
 <link name="tip"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
</robot>"""

TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def problem_file(folder: Path, **changes: object) -> Path:
    (folder / "arm.urdf").write_text(ARM)
    (folder / "part.obj").write_text(TETRAHEDRON)
    data: dict[str, object] = {
        "urdf": "arm.urdf",
        "joints": ["j2", "j1"],
        "hold": {"finger": 0.05},
        "time_limit": 2.0,
        "limits": {"velocity": [1.5, 1.0], "acceleration": [8, 6], "jerk": [200, 100]},
        "obstacles": [
            {"name": "o0", "type": "box", "size": [0.1, 0.1, 0.5], "position": [0.6, 0, 0]},
            {"type": "sphere", "radius": 0.05, "position": [0, 0.7, 0]},
            {"type": "cylinder", "radius": 0.05, "length": 0.4, "position": [-0.6, 0.5, 0]},
            {"type": "capsule", "radius": 0.05, "length": 0.4, "position": [-0.6, -0.5, 0]},
            {"type": "mesh", "file": "part.obj", "position": [0.0, -0.9, 0], "quaternion": [0, 0, 1, 1]},
        ],
        "problems": [
            {"name": "joints", "start": [0, -0.6], "goal": {"joints": [0, 0.6]}},
            {"name": "pose", "start": [0, -0.6], "goal": {"link": "tip", "position": [0.5, 0.5, 0.08]}},
            {
                "name": "poses",
                "start": [0, -0.6],
                "goal": {"poses": [{"link": "tip", "position": [0.5, 0.5, 0.08]}]},
            },
            {"name": "inside", "start": [0, 0], "goal": {"joints": [0, 0.6]}},
        ],
    }
    data.update(changes)
    path = folder / "arm.json"
    path.write_text(json.dumps(data))
    return path


def test_the_command_writes_a_row_for_each_problem(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "rows.jsonl"
    assert cli.main(["plan", "--problems", str(problem_file(tmp_path)), "--out", str(out)]) == 0
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert [row["name"] for row in rows] == ["joints", "pose", "poses", "inside"]
    assert [row["outcome"] for row in rows] == ["solved"] * 3 + ["start in collision"]
    assert '"o0"' in rows[3]["reason"]
    assert rows[3]["trajectory"] is None
    for row in rows[:3]:
        t, q, v, a = (np.array(row["trajectory"][key]) for key in ("t", "q", "v", "a"))
        assert q.shape == v.shape == a.shape == (len(t), 2)
        np.testing.assert_allclose(q[0], [0, -0.6], atol=1e-9)
        assert (np.abs(v) <= np.array([1.5, 1.0]) * (1 + 1e-6)).all()
        assert (np.abs(a) <= np.array([8, 6]) * (1 + 1e-6)).all()
        jerk = np.diff(a, axis=0) / np.maximum(np.diff(t), 1e-9)[:, None]
        assert (np.abs(jerk) <= np.array([200, 100]) * (1 + 1e-5)).all()
        assert row["planning_seconds"] > 0
        assert row["timing_seconds"] > 0
    for row in rows[1:3]:
        elbow, shoulder = row["path"][-1]
        tip = 0.5 * np.array([np.cos(shoulder), np.sin(shoulder)]) + 0.45 * np.array(
            [np.cos(shoulder + elbow), np.sin(shoulder + elbow)]
        )
        np.testing.assert_allclose(tip, [0.5, 0.5], atol=2e-4)
    assert "3 solved, 1 start in collision" in capsys.readouterr().out


WRONG = {
    "urdf": ({"urdf": "no.urdf"}, "no.urdf"),
    "joints": ({"joints": "j1"}, "joints"),
    "type": ({"obstacles": [{"type": "cone", "radius": 1}]}, "cone"),
    "radius": ({"obstacles": [{"type": "sphere", "radius": -1}]}, "radius is -1"),
    "size": ({"obstacles": [{"type": "box", "size": [1, 2]}]}, "size"),
    "mesh": ({"obstacles": [{"type": "mesh", "file": "no.obj"}]}, "no.obj"),
    "start": ({"problems": [{"start": [0], "goal": {"joints": [0, 0]}}]}, "start"),
    "goal": ({"problems": [{"start": [0, 0], "goal": [0, 0]}]}, "goal"),
    "limit": ({"limits": {"speed": [1, 1]}}, "speed"),
    "joint": ({"joints": ["j1", "elbow"]}, "elbow"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_entries_are_named(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    changes, word = WRONG[name]
    path = problem_file(tmp_path, **changes)
    assert cli.main(["plan", "--problems", str(path), "--out", str(tmp_path / "o.jsonl")]) == 1
    error = capsys.readouterr().err
    assert word in error
    assert "unexpected" not in error


def test_a_file_that_is_not_json(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text('{"urdf": }')
    with pytest.raises(ConfigError, match=r"a\.json:1"):
        load_problems(path)
