"""Missing mesh files: visual shapes are omitted with a warning, collision shapes on request."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboyard.cli import main
from roboyard.description.files.beside import nearest_name
from roboyard.errors import DescriptionError
from roboyard.importer.build import build_package

INERTIA = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
BOX = '<geometry><box size="0.1 0.1 0.1"/></geometry>'
GONE = '<geometry><mesh filename="meshes/torso.std"/></geometry>'


def _file(folder: Path, shapes: str) -> Path:
    (folder / "meshes").mkdir()
    (folder / "meshes" / "torso.stl").write_bytes(b"solid\nendsolid\n")
    file = folder / "r.urdf"
    file.write_text(f'<robot name="r"><link name="body">{INERTIA}{shapes}</link></robot>', encoding="utf-8")
    return file


def test_a_missing_visual_mesh_is_a_warning_and_the_other_shapes_stay(tmp_path: Path):
    shapes = f"<visual>{BOX}</visual><visual>{GONE}</visual><collision>{BOX}</collision>"
    made = build_package(_file(tmp_path, shapes), out=tmp_path / "data")
    (body,) = (link for link in made.robot.description.links if link.name == "body")
    assert (len(body.visuals), len(body.collisions)) == (1, 1)
    (warning,) = (d for d in made.warnings if "meshes/torso.std" in d.message)
    assert warning.element == 'link "body"' and "did you mean 'torso.stl'" in warning.message


def test_a_missing_collision_mesh_is_asked_about(tmp_path: Path):
    file = _file(tmp_path, f"<visual>{BOX}</visual><collision>{BOX}</collision><collision>{GONE}</collision>")
    with pytest.raises(
        DescriptionError, match=r"torso\.std.*did you mean 'torso\.stl'.*--missing-meshes warn"
    ):
        build_package(file, out=tmp_path / "data")
    made = build_package(file, out=tmp_path / "data", missing_meshes="warn")
    assert [len(link.collisions) for link in made.robot.description.links if link.name == "body"] == [1]


def test_error_refuses_a_missing_visual_mesh_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = _file(tmp_path, f"<visual>{GONE}</visual><collision>{BOX}</collision>")
    options = ["--data", str(tmp_path / "data"), "--no-validate", "--no-report"]
    assert main(["import", str(file), *options, "--missing-meshes", "error"]) == 1
    assert "torso.std" in capsys.readouterr().err
    assert main(["import", str(file), *options]) == 0
    assert "warning:" in capsys.readouterr().out


def test_the_materials_of_a_missing_mesh_are_not_suggested_for_it(tmp_path: Path) -> None:
    for name in ("base_link.mtl", "base_links.txt"):
        (tmp_path / name).touch()
    assert nearest_name(tmp_path, "base_link.obj") is None
    assert nearest_name(tmp_path, "base_lnk.mtl") == "base_link.mtl"
    (tmp_path / "base_link.stl").touch()
    assert nearest_name(tmp_path, "base_link.obj") == "base_link.stl"
