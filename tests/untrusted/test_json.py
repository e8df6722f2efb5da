"""JSON of strangers: read within bounds, and refused with one kind of error."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import pytest

from roboyard.envs.policy import load_policy
from roboyard.errors import ConfigError
from roboyard.planning import load_problems
from roboyard.untrusted.json_reading import MAX_VALUES, parse_json, read_json

HOSTILE = {
    "nested lists": b"[" * 200_000 + b"]" * 200_000,
    "nested objects": b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
    "a number of 10000 digits": b'{"joints": ' + b"9" * 10_000 + b"}",
    "many lists": b"[" + b"[]," * MAX_VALUES + b"[]]",
    "no UTF-8": b"\xff\xfe\x00{}",
    "half a text": b'{"a": "',
    "nothing": b"",
}


def test_values_come_as_from_python(tmp_path: Path) -> None:
    value = {"a": [1, 2.5, None, True, "\u00fc, [x]"], "b": {}}
    for encoding in ("utf-8", "utf-16", "utf-32"):
        assert parse_json(json.dumps(value, ensure_ascii=False).encode(encoding)) == value
    (tmp_path / "a.json").write_text(json.dumps(value))
    assert read_json(tmp_path / "a.json", 100) == value
    with pytest.raises(OSError, match="too large"):
        read_json(tmp_path / "a.json", 10)


@pytest.mark.parametrize("name", list(HOSTILE))
def test_hostile_texts_are_value_errors_at_once(name: str) -> None:
    begin = time.process_time()
    with pytest.raises(ValueError):
        parse_json(HOSTILE[name])
    assert time.process_time() - begin < 2


@pytest.mark.parametrize("load", [load_policy, load_problems])
@pytest.mark.parametrize("name", list(HOSTILE))
def test_policies_and_problems_refuse_them_in_a_line(tmp_path: Path, load, name: str) -> None:
    (tmp_path / "x.json").write_bytes(HOSTILE[name])
    with pytest.raises(ConfigError) as error:
        load(tmp_path / "x.json")
    assert str(error.value).startswith("x.json")
    assert len(str(error.value)) < 400
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("load", [load_policy, load_problems])
def test_pipes_folders_and_missing_files_are_refused(tmp_path: Path, load) -> None:
    os.mkfifo(tmp_path / "pipe")
    for file in (tmp_path / "pipe", tmp_path, tmp_path / "missing", Path("/dev/zero")):
        with pytest.raises(ConfigError, match=file.name):
            load(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": ["a", 3]}, r"joints\[1\] is 3; give a joint's name"),
        ({"problems": [7]}, r"problems\[0\] is 7; it must be an object"),
        ({"limits": [1]}, r'"limits" is \[1\]; it must be an object'),
        ({"limits": {"velocity": [1, float("nan")]}}, "limits: velocity is .*nan.*; give 2 finite numbers"),
        ({"limits": {"jerk": "fast"}}, "limits: jerk is 'fast'; give a finite number"),
        ({"hold": {"c": None}}, "hold: c is None; give a finite number"),
        ({"time_limit": float("inf")}, "time_limit is inf; give a finite number"),
        (
            {"obstacles": [{"type": "sphere", "radius": float("inf")}]},
            "radius is inf; give a positive number",
        ),
        ({"obstacles": list(range(100_000))}, r"obstacles\[0\] is 0; it must be an object"),
        ({"obstacles": "x" * 100_000}, "obstacles is 'x.*; it must be a list"),
    ],
)
def test_problem_files_name_the_entry(tmp_path: Path, change: dict[str, object], message: str) -> None:
    good = {
        "urdf": "a.urdf",
        "joints": ["a", "b"],
        "problems": [{"start": [0, 0], "goal": {"joints": [1, 1]}}],
    }
    (tmp_path / "x.json").write_text(json.dumps(good))
    assert load_problems(tmp_path / "x.json").joints == ("a", "b")
    (tmp_path / "x.json").write_text(json.dumps({**good, **change}))
    with pytest.raises(ConfigError, match=message) as error:
        load_problems(tmp_path / "x.json")
    assert len(str(error.value)) < 400
