"""The fileIOPlugin: mounts of folders and zip files, with the results of PyBullet 3.2.7."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import pytest

import roboyard.pybullet as p

PART = (
    '<robot name="part"><link name="a"><collision><geometry><mesh filename="meshes/tetra.obj"/></geometry>'
    "</collision></link></robot>"
)
TETRA = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.fixture
def packed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A zip file of a URDF and its mesh; the working folder is another one."""
    with ZipFile(tmp_path / "parts.zip", "w") as file:
        file.writestr("part/part.urdf", PART)
        file.writestr("part/meshes/tetra.obj", TETRA)
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "parts.zip"


def _mount(plugin: int, kind: int, place: object) -> int:
    return p.executePluginCommand(plugin, textArgument=str(place), intArgs=[p.AddFileIOAction, kind])


def test_files_of_a_mounted_zip_are_found_with_their_meshes(client: int, packed: Path) -> None:
    plugin = p.loadPlugin("fileIOPlugin")
    with pytest.raises(p.error):
        p.loadURDF("part/part.urdf")
    slot = _mount(plugin, p.ZipFileIO, packed)
    body = p.loadURDF("part/part.urdf")
    low, high = p.getAABB(body)
    assert low == pytest.approx([0, 0, 0], abs=0.01) and high == pytest.approx([1, 1, 1], abs=0.01)
    p.setAdditionalSearchPath("part")
    assert p.loadURDF("part.urdf") == body + 1
    assert p.executePluginCommand(plugin, intArgs=[p.RemoveFileIOAction, slot]) == slot
    with pytest.raises(p.error):
        p.loadURDF("part/part.urdf")


def test_a_mounted_prefix_stands_before_names(client: int, packed: Path) -> None:
    folder = packed.parent / "more"
    folder.mkdir()
    (folder / "one.urdf").write_text('<robot name="one"><link name="a"/></robot>')
    plugin = p.loadPlugin("fileIOPlugin")
    assert _mount(plugin, p.PosixFileIO, f"{folder}/") == 1
    assert p.loadURDF("one.urdf") == 0


def test_slots_and_failures_are_pybullets(client: int, packed: Path) -> None:
    plugin = p.loadPlugin("fileIOPlugin")
    assert plugin == p.loadPlugin("fileIOPlugin") == 3
    assert [_mount(plugin, p.ZipFileIO, place) for place in (packed, packed, "missing.zip", "")] == [
        1,
        1,
        2,
        -1,
    ]
    assert _mount(plugin, p.CNSFileIO, "a") == _mount(plugin, 7, "a") == -1
    for numbers in ([p.AddFileIOAction], [], [7, 7], [p.AddFileIOAction, 1, 1]):
        assert p.executePluginCommand(plugin, intArgs=numbers) == -1
    assert p.executePluginCommand(plugin, intArgs=[p.RemoveFileIOAction, 99]) == 99
    p.unloadPlugin(plugin)
    assert _mount(plugin, p.ZipFileIO, packed) == -1


def test_a_zip_file_opens_nothing_else_and_is_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from roboyard.pybullet.state import file_mounts

    (tmp_path / "secret").write_text("x")
    with ZipFile(tmp_path / "a.zip", "w") as file:
        file.writestr("../../secret", "inside")
        file.writestr("part", "inside")
    mounts = file_mounts.FileMounts()
    mounts.add(p.ZipFileIO, str(tmp_path / "a.zip"))
    found = mounts.find("part")
    assert found is not None
    up = "/".join([".."] * len(found.parts))
    for name in ("../../secret", f"{up}{tmp_path}/secret"):
        assert mounts.find(name) is None
    mounts.close()
    monkeypatch.setattr(file_mounts, "_MAX_BYTES", 1000)
    with ZipFile(tmp_path / "bomb.zip", "w", 8) as file:
        file.writestr("part", bytes(5000))
    mounts = file_mounts.FileMounts()
    mounts.add(p.ZipFileIO, str(tmp_path / "bomb.zip"))
    assert mounts.find("part") is None
    assert "not unpacked" in capsys.readouterr().err
    mounts.close()
