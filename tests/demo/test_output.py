"""The output folder is written completely or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roboyard.demo.output import MARK, check_target, whole_folder
from roboyard.errors import ConfigError


def write_demo(folder: Path, names: tuple[str, ...]) -> None:
    with whole_folder(folder) as work:
        for name in names:
            (work / name).write_text(name, encoding="utf-8")
        (work / "summary.json").write_text(
            json.dumps({"made_by": MARK, "files": list(names)}), encoding="utf-8"
        )


def test_a_new_folder_appears_with_its_parents(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b"
    write_demo(target, ("one", "two"))
    assert sorted(p.name for p in target.iterdir()) == ["one", "summary.json", "two"]
    assert [p.name for p in target.parent.iterdir()] == ["b"]


def test_an_error_leaves_nothing_behind(tmp_path: Path) -> None:
    def fail() -> None:
        with whole_folder(tmp_path / "a" / "b") as work:
            (work / "half").write_text("x", encoding="utf-8")
            raise RuntimeError("in the middle")

    with pytest.raises(RuntimeError, match="in the middle"):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_demo_is_replaced_and_other_files_stay(tmp_path: Path) -> None:
    write_demo(tmp_path / "d", ("one", "old"))
    (tmp_path / "d" / "mine").write_text("keep", encoding="utf-8")
    check_target(tmp_path / "d", overwrite=False)
    write_demo(tmp_path / "d", ("one", "new"))
    assert sorted(p.name for p in (tmp_path / "d").iterdir()) == ["mine", "new", "one", "summary.json"]


def test_a_folder_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years", encoding="utf-8")
    with pytest.raises(ConfigError, match="--overwrite"):
        check_target(tmp_path, overwrite=False)
    check_target(tmp_path, overwrite=True)
    with pytest.raises(ConfigError, match="not a folder but a file"):
        check_target(tmp_path / "thesis.txt", overwrite=True)


def test_a_summary_that_names_paths_outside_removes_nothing_there(tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.write_text("stay", encoding="utf-8")
    target = tmp_path / "d"
    target.mkdir()
    listing = {"made_by": MARK, "files": ["../outside", str(outside)]}
    (target / "summary.json").write_text(json.dumps(listing), encoding="utf-8")
    write_demo(target, ("one",))
    assert outside.read_text(encoding="utf-8") == "stay"


def test_a_folder_that_cannot_be_written_is_an_error_before_the_demo_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(dir: Path) -> None:
        raise PermissionError(13, "Permission denied", str(dir))

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    with pytest.raises(ConfigError, match=f"cannot write to {tmp_path} .Permission denied"):
        check_target(tmp_path / "a" / "b", overwrite=False)
