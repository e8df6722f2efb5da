"""Robots by the names of the package `robot_descriptions`, and robots of a folder."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from roboyard.assets import asset_path
from roboyard.cli import main
from roboyard.description.files.robot_files import robot_files
from roboyard.errors import ConfigError
from roboyard.robots.public_names import find_public_robot, public_names

URDF = '<robot name="{name}"><link name="base"/></robot>'
XACRO = (
    '<robot name="x" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arg name="kind" default="none"/>'
    '<xacro:macro name="arm"><link name="{}"/></xacro:macro>{}</robot>'
)


@pytest.fixture
def known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package as `robot_descriptions` is: a list of modules, each of which fetches and names its files."""
    package = tmp_path / "site" / "robot_descriptions"
    package.mkdir(parents=True)
    names = [f"{name}_description" for name in ("dog", "dog_mj", "arm", "hand_mj", "lost")]
    (package / "__init__.py").write_text(f"DESCRIPTIONS = dict.fromkeys({names!r})\n")
    cache = tmp_path / "cache" / "dog_package"
    cache.mkdir(parents=True)
    (cache / "dog.urdf").write_text(URDF.format(name="dog"))
    (cache / "arm.urdf.xacro").write_text(XACRO.format("${1}", '<link name="$(arg kind)"/>'))
    (cache / "hand.xml").write_text(
        '<mujoco><worldbody><body name="palm"><geom size="1"/></body></worldbody></mujoco>'
    )
    head = f"print('fetching')\nPACKAGE_PATH = {str(cache)!r}\n"
    files = {
        "dog": f"URDF_PATH = {str(cache / 'dog.urdf')!r}",
        "dog_mj": f"MJCF_PATH = {str(cache / 'hand.xml')!r}",
        "arm": f"XACRO_PATH = {str(cache / 'arm.urdf.xacro')!r}\nXACRO_ARGS = {{'kind': 'seven'}}",
        "hand_mj": f"MJCF_PATH = {str(cache / 'hand.xml')!r}",
        "lost": "raise OSError('no network')",
    }
    for name, text in files.items():
        (package / f"{name}_description.py").write_text(f"{head}{text}\n")
    for name in [name for name in sys.modules if name.partition(".")[0] == "robot_descriptions"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(str(package.parent))
    yield cache
    for name in [name for name in sys.modules if name.partition(".")[0] == "robot_descriptions"]:
        del sys.modules[name]


def test_names_are_short_or_those_of_modules(known: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert set(public_names()) == {"dog", "dog_mj", "arm", "hand_mj", "lost"}
    for name in ("dog", "dog_description", "Dog"):
        found = find_public_robot(name)
        assert found is not None
        assert found.file == known / "dog.urdf"
        assert found.packages == {"dog_package": known}
    hand = find_public_robot("hand")
    assert hand is not None
    assert hand.file.name == "hand.xml"
    assert find_public_robot("cat") is None
    assert capsys.readouterr().out == ""


def test_a_robot_that_cannot_be_fetched_says_why(known: Path) -> None:
    with pytest.raises(ConfigError, match="no network"):
        find_public_robot("lost")


def test_commands_take_public_names_with_their_arguments(
    known: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["audit", "arm", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["facts"]["links"] == 1
    main(["audit", "arm", "--xacro-arg", "kind:=six"])
    assert main(["audit", "cat"]) == 1
    assert "no file or robot named 'cat'" in capsys.readouterr().err


def test_an_import_is_named_as_the_robot_was(
    known: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (known / "dog.urdf").write_text(asset_path("cube").read_text())
    assert main(["import", "dog", "--out", str(tmp_path / "data"), "--no-validate", "--no-report"]) == 0
    assert (tmp_path / "data" / "omnigibson-robot-assets" / "objects" / "robot" / "dog").is_dir()


def test_without_the_package_no_name_is_public(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboyard.robots.public_names.find_spec", lambda name: None)
    assert public_names() == {}
    assert find_public_robot("go2") is None


@pytest.fixture
def collection(tmp_path: Path) -> Path:
    """Two robots, and files that only look like some."""
    folder = tmp_path / "robots"
    (folder / "a" / "urdf").mkdir(parents=True)
    (folder / "a" / "urdf" / "a.urdf").write_text(URDF.format(name="a"))
    (folder / "a" / "package.xml").write_text("<package/>")
    (folder / "a" / "urdf" / "parts.xacro").write_text(XACRO.format("l", ""))
    (folder / "b.urdf.xacro").write_text(XACRO.format("l", "<xacro:arm/>"))
    (folder / "scene.xml").write_text("<mujoco><worldbody><body/></worldbody></mujoco>")
    (folder / "empty.sdf").write_text('<sdf version="1.6"><world/></sdf>')
    (folder / ".hidden").mkdir()
    (folder / ".hidden" / "c.urdf").write_text(URDF.format(name="c"))
    return folder


def test_robots_of_a_folder(collection: Path) -> None:
    found = [file.relative_to(collection).as_posix() for file in robot_files(collection)]
    assert found == ["a/urdf/a.urdf", "b.urdf.xacro"]


def test_a_xacro_file_of_includes_alone_is_a_robot_where_it_has_a_name(tmp_path: Path) -> None:
    head = '<robot {} xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'
    include = '<xacro:include filename="body_macro.xacro"/>'
    macro = '<xacro:macro name="body" params=""><link name="a"/></xacro:macro>'
    (tmp_path / "whole.urdf.xacro").write_text(head.format('name="whole"', include))
    (tmp_path / "old.urdf.xacro").write_text(head.format('name="old"', include.replace("xacro:", "")))
    (tmp_path / "nameless.xacro").write_text(head.format("", include))
    (tmp_path / "macro.xacro").write_text(head.format('name="part"', include + macro))
    (tmp_path / "groups.srdf.xacro").write_text(head.format('name="whole"', include))
    assert [file.name for file in robot_files(tmp_path)] == ["old.urdf.xacro", "whole.urdf.xacro"]


def test_a_folder_with_several_robots_lists_them(
    collection: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: False))
    assert main(["audit", str(collection)]) == 1
    err = capsys.readouterr().err
    assert "there are 2 robots in this folder" in err
    assert str(collection / "b.urdf.xacro") in err
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(isatty=lambda: True))
    monkeypatch.setattr("builtins.input", lambda prompt: "2")
    main(["audit", str(collection), "--json"])
    assert "b.urdf.xacro" in capsys.readouterr().out


def test_a_folder_with_one_robot_is_that_robot(
    collection: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["audit", str(collection / "a"), "--json"]) in (0, 1)
    assert json.loads(capsys.readouterr().out)["robot"] == "a"
    assert main(["audit", str(collection / "a" / "urdf" / "..")]) in (0, 1)
    (tmp_path / "none").mkdir()
    assert main(["audit", str(tmp_path / "none")]) == 1
    assert "no robot file" in capsys.readouterr().err
