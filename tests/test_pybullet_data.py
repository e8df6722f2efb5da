"""The folder of PyBullet's data: bundled files, an installed `pybullet_data`, and errors without it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import roboyard.pybullet as p
from roboyard import pybullet_data
from roboyard.pybullet_data import merged


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A `pybullet_data` of four files, found like an installed one; the cache is in the test's folder."""
    data = tmp_path / "site" / "pybullet_data"
    for name, text in {
        "__init__.py": "",
        "plane.urdf": "theirs",
        "husky/husky.urdf": "theirs",
        "duck_vhacd.urdf": '<robot name="duck"><link name="body"/></robot>',
        "laikago/parts/leg.urdf": '<robot name="leg"><link name="upper"/></robot>',
    }.items():
        (data / name).parent.mkdir(parents=True, exist_ok=True)
        (data / name).write_text(text)
    monkeypatch.syspath_prepend(str(data.parent))
    monkeypatch.setattr(merged, "_cache_folders", lambda: (tmp_path / "cache",))
    pybullet_data.getDataPath.cache_clear()
    yield data
    pybullet_data.getDataPath.cache_clear()


def test_without_an_installed_package_the_bundled_files_are_the_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.path", [])
    assert merged.installed_data() is None


def test_files_of_both_are_in_one_folder(installed: Path) -> None:
    folder = Path(pybullet_data.getDataPath())
    assert "<robot" in (folder / "plane.urdf").read_text()  # ours is PyBullet's equal
    assert (folder / "husky/husky.urdf").read_text() == "theirs"  # ours is a stand-in
    assert (folder / "husky/meshes").is_dir() and (folder / "rover/rover.urdf").is_file()
    assert "leg" in (folder / "laikago/parts/leg.urdf").read_text()
    assert not (folder / "__init__.py").exists()
    client = p.connect(p.DIRECT)
    p.setAdditionalSearchPath(str(folder))
    assert p.loadURDF("duck_vhacd.urdf") == 0 and p.loadURDF("plane.urdf") == 1
    p.disconnect(client)


def test_an_original_in_a_folder_of_both_finds_its_own_meshes(client: int, installed: Path) -> None:
    (installed / "husky/husky.urdf").write_text(
        '<robot name="r"><link name="a"><collision><geometry><mesh filename="package://parts/t.obj"/></geometry>'
        "</collision></link></robot>"
    )
    (installed / "husky/parts").mkdir()
    (installed / "husky/parts/t.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    body = p.loadURDF(f"{pybullet_data.getDataPath()}/husky/husky.urdf")
    assert p.getAABB(body)[1] == pytest.approx([1, 1, 1], abs=0.01)


def test_the_folder_is_made_once_and_again_after_a_change(installed: Path) -> None:
    first = merged.merged_folder(Path(pybullet_data.getDataPath()), installed)
    made = first.stat().st_ino
    assert merged.merged_folder(Path(pybullet_data.getDataPath()), installed).stat().st_ino == made
    (installed / "bunny.obj").write_text("v 0 0 0")
    os.utime(installed, ns=(1, 1))
    pybullet_data.getDataPath.cache_clear()
    again = Path(pybullet_data.getDataPath())
    assert again != first and (again / "bunny.obj").is_file()


def test_hard_links_serve_where_symbolic_ones_are_forbidden(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def forbidden(*_: object, **__: object) -> None:
        raise OSError("a required privilege is not held by the client")

    monkeypatch.setattr(Path, "symlink_to", forbidden)
    ours = installed.parents[1] / "ours"
    (ours / "own").mkdir(parents=True)
    (ours / "own" / "part.urdf").write_text("ours")
    folder = merged.merged_folder(ours, installed)
    assert (folder / "laikago/parts/leg.urdf").samefile(installed / "laikago/parts/leg.urdf")
    assert (folder / "own/part.urdf").read_text() == "ours"


def test_ours_alone_serves_where_nothing_can_be_written(
    installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = installed.parent / "file"
    blocked.write_text("")
    monkeypatch.setattr(merged, "_cache_folders", lambda: (blocked / "cache",))
    assert merged.merged_folder(installed.parent, installed) == installed.parent


@pytest.mark.parametrize(
    ("has_package", "text"),
    [(False, "pip install pybullet"), (True, "neither Roboyard nor the installed pybullet_data")],
)
def test_the_error_of_a_missing_file_names_the_package(
    client: int, installed: Path, monkeypatch: pytest.MonkeyPatch, has_package: bool, text: str
) -> None:
    if not has_package:
        monkeypatch.setattr(merged, "installed_data", lambda: None)
    p.setAdditionalSearchPath(pybullet_data.getDataPath())
    with pytest.raises(p.error, match=f"{text}.*'mini_cheetah/mini_cheetah.urdf'"):
        p.loadURDF("mini_cheetah/mini_cheetah.urdf")
    with pytest.raises(p.error, match="check the name"):
        p.loadURDF("no_such_robot.urdf")


@pytest.fixture
def client():
    number = p.connect(p.DIRECT)
    yield number
    p.disconnect(number)
