"""The cleaned URDF, read back and by other readers."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from roboyard.description import Heightfield, Mesh, Visual, load_description
from roboyard.description.robot_model import RobotModel
from roboyard.errors import DescriptionError
from roboyard.export import urdf
from roboyard.shapes.load import load_mesh


@pytest.mark.parametrize("name", ["r1", "husky", "arm7"])
def test_everything_it_names_lies_beside_it(
    bundled: Callable[[str], RobotModel], tmp_path: Path, name: str
) -> None:
    robot = bundled(name)
    written = urdf.write(robot, tmp_path / "urdf")
    assert written.files[0] == tmp_path / "urdf" / f"{name}.urdf"
    assert not written.notes
    for reference in ET.parse(written.files[0]).iter():
        uri = reference.get("filename")
        if reference.tag in ("mesh", "texture") and uri is not None:
            assert not Path(uri).is_absolute() and "://" not in uri
            assert (tmp_path / "urdf" / uri).is_file()
            assert all(c.isascii() and c not in " ()" for c in uri)


def test_the_robot_is_the_same_but_for_file_names(
    bundled: Callable[[str], RobotModel], tmp_path: Path
) -> None:
    robot = bundled("r1")
    urdf.write(robot, tmp_path)
    read = load_description(tmp_path / "r1.urdf")
    for old, new in zip(robot.description.links, read.links, strict=True):
        assert (old.name, old.contact) == (new.name, new.contact)
        if old.inertial is not None and new.inertial is not None:
            assert old.inertial.mass == new.inertial.mass
            assert old.inertial.inertia == new.inertial.inertia
        for a, b in zip((*old.visuals, *old.collisions), (*new.visuals, *new.collisions), strict=True):
            if isinstance(a.geometry, Mesh) and isinstance(b.geometry, Mesh):
                assert a.geometry.scale == b.geometry.scale
                assert a.geometry.path and b.geometry.path
                assert np.array_equal(
                    load_mesh(a.geometry.path).vertices, load_mesh(b.geometry.path).vertices
                )
            else:
                assert a.geometry == b.geometry
    for old, new in zip(robot.description.joints, read.joints, strict=True):
        assert replace(old, source=new.source) == new


def test_textures_come_along(bundled: Callable[[str], RobotModel], tmp_path: Path) -> None:
    robot = bundled("r1")
    urdf.write(robot, tmp_path)
    read = load_description(tmp_path / "r1.urdf")
    textured = 0
    for old, new in zip(robot.description.links, read.links, strict=True):
        for a, b in zip(old.visuals, new.visuals, strict=True):
            if isinstance(a.geometry, Mesh) and isinstance(b.geometry, Mesh):
                assert a.geometry.path and b.geometry.path
                before, after = load_mesh(a.geometry.path), load_mesh(b.geometry.path)
                assert (before.texture is None) == (after.texture is None)
                textured += before.texture is not None
    assert textured


def test_a_mesh_used_twice_is_copied_once(bundled: Callable[[str], RobotModel], tmp_path: Path) -> None:
    written = urdf.write(bundled("husky"), tmp_path)
    assert len(list((tmp_path / "meshes").rglob("tyre*"))) == 1
    assert len(set(written.files)) == len(written.files)


def test_meshes_made_in_memory_become_files(robot: RobotModel, tmp_path: Path) -> None:
    written = urdf.write(robot, tmp_path)
    assert ["colours" in note for note in written.notes] == [True]
    read = load_description(tmp_path / "everything.urdf")
    mesh = read.link_by_name["arm.1"].visuals[0].geometry
    assert isinstance(mesh, Mesh) and mesh.path is not None
    assert np.allclose(load_mesh(mesh.path).bounds, [[-0.1, -0.05, -0.05], [0.1, 0.05, 0.05]])
    # the same mesh thrice, one file
    assert len(list((tmp_path / "meshes").iterdir())) == 1


def test_files_that_lie_in_the_folder_stay(bundled: Callable[[str], RobotModel], tmp_path: Path) -> None:
    robot = bundled("arm7")
    urdf.write(robot, tmp_path)
    before = sorted(p.name for p in (tmp_path / "meshes").iterdir())
    again = replace(robot, description=load_description(tmp_path / "arm7.urdf"))
    urdf.write(again, tmp_path)
    assert sorted(p.name for p in (tmp_path / "meshes").iterdir()) == before


def test_a_lost_mesh_is_noted(robot: RobotModel, tmp_path: Path) -> None:
    lost = Visual(geometry=Mesh(uri="package://gone/a.stl", path=None))
    base = replace(robot.description.links[0], visuals=(lost,))
    description = replace(robot.description, links=(base, *robot.description.links[1:]))
    written = urdf.write(replace(robot, description=description), tmp_path)
    assert any("package://gone/a.stl" in note for note in written.notes)


def test_a_heightfield_is_refused(robot: RobotModel, tmp_path: Path) -> None:
    terrain = Visual(geometry=Heightfield(heights=np.zeros((2, 2)), cell=(1.0, 1.0)))
    base = replace(robot.description.links[0], visuals=(terrain,))
    description = replace(robot.description, links=(base, *robot.description.links[1:]))
    with pytest.raises(DescriptionError, match="heightfield"):
        urdf.write(replace(robot, description=description), tmp_path)
