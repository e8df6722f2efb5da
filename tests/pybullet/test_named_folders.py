"""Files in one folder that name meshes in another: found where the script has named that folder before."""

from __future__ import annotations

from pathlib import Path

import pytest

import roboyard.pybullet as p

TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
URDF = """<robot name="part"><link name="part"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="{mesh}"/></geometry></visual>
<collision><geometry><mesh filename="{mesh}"/></geometry></collision></link></robot>"""


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    """A folder with a mesh and a file of its own that does not need it."""
    folder = tmp_path / "program" / "version" / "parts"
    folder.mkdir(parents=True)
    (folder / "part.obj").write_text(TETRAHEDRON)
    (folder / "plate.urdf").write_text(URDF.format(mesh="part.obj"))
    return folder


def _written_elsewhere(tmp_path: Path, assets: Path) -> str:
    """Write a file that names the mesh by its absolute path into a folder of another tree."""
    folder = tmp_path / "temporary"
    folder.mkdir(exist_ok=True)
    file = folder / "written.urdf"
    file.write_text(URDF.format(mesh=assets / "part.obj"))
    return str(file)


def test_a_written_file_may_name_meshes_beside_files_that_were_loaded(
    client: int, tmp_path: Path, assets: Path
) -> None:
    p.loadURDF(str(assets / "plate.urdf"))
    body = p.loadURDF(_written_elsewhere(tmp_path, assets))
    ((_, _, kind, _, file, *_),) = p.getVisualShapeData(body)
    assert (kind, file) == (p.GEOM_MESH, str(assets / "part.obj").encode())
    assert p.getAABB(body)[1][0] > 0.05


def test_a_written_file_may_name_meshes_in_every_folder_that_was_searched(
    client: int, tmp_path: Path, assets: Path
) -> None:
    p.setAdditionalSearchPath(str(assets))
    p.setAdditionalSearchPath(str(tmp_path / "temporary"))
    body = p.loadURDF(_written_elsewhere(tmp_path, assets))
    assert len(p.getVisualShapeData(body)) == 1


def test_folders_that_the_script_has_not_named_stay_closed(
    client: int, tmp_path: Path, assets: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    body = p.loadURDF(_written_elsewhere(tmp_path, assets))
    assert p.getVisualShapeData(body) == ()
    monkeypatch.setenv("HOME", str(tmp_path))  # naming the home would open all of the user's files
    p.setAdditionalSearchPath(str(tmp_path))
    p.setAdditionalSearchPath(str(tmp_path / "temporary"))
    p.setPhysicsEngineParameter(enableFileCaching=0)
    body = p.loadURDF(_written_elsewhere(tmp_path, assets))
    assert p.getVisualShapeData(body) == ()
