"""Files that an import writes hold no folder of the machine that made them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from roboyard import import_robot
from roboyard.importer.machine_paths import portable_texts
from roboyard.viewer.inspector.robot_source import package_source

TRIANGLES = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
LINK = """<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01"
 iyz="0" izz="0.01"/></inertial><visual><geometry><mesh filename="{mesh}"/></geometry></visual></link>"""


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    """A robot that names meshes by the machine's paths: one that exists, and two that do not."""
    folder = tmp_path / "alices disk" / "arm_description"
    (folder / "urdf").mkdir(parents=True)
    (folder / "meshes").mkdir()
    (folder / "meshes" / "base.obj").write_text(TRIANGLES)
    meshes = {
        "base": folder / "meshes" / "base.obj",
        "gone": folder / "meshes" / "gone.obj",
        "home": Path.home() / "nowhere.obj",
    }
    links = "".join(LINK.format(name=name, mesh=mesh) for name, mesh in meshes.items())
    joints = "".join(
        f'<joint name="to_{name}" type="revolute"><parent link="base"/><child link="{name}"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="9" velocity="2"/></joint>'
        for name in ("gone", "home")
    )
    file = folder / "urdf" / "arm.urdf"
    file.write_text(f'<robot name="arm">{links}{joints}</robot>')
    return file


def test_no_written_file_names_a_folder_of_the_machine(robot: Path, tmp_path: Path) -> None:
    config = robot.with_name("arm.yaml")
    config.write_text("urdf_path: arm.urdf\nname: arm\n")
    out = tmp_path / "data"
    result = import_robot(config, out=out, missing_meshes="warn", validate=False)
    held = [str(tmp_path), "alices disk", str(Path.home()), str(Path(__file__).parents[2])]
    files = [file for file in out.rglob("*") if file.is_file()]
    assert len(files) > 10
    named = {file.name: text for file in files for text in held if text.encode() in file.read_bytes()}
    assert named == {}
    log = json.loads((result.folder / "import_log.json").read_text())
    assert log["source"]["urdf"] == "./arm.urdf"
    assert log["configuration"] == "arm.yaml"
    assert "../meshes/gone.obj" in (result.folder / "import_log.json").read_text()


def test_the_inspector_finds_the_configuration_in_the_working_folder(
    robot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (package / "import_log.json").write_text(json.dumps({"configuration": "arm.yaml"}))
    monkeypatch.chdir(tmp_path)
    assert package_source(package, "arm").config is None
    Path("arm.yaml").write_text("urdf_path: arm.urdf\nname: another\n")
    assert package_source(package, "arm").config is None
    Path("arm.yaml").write_text("urdf_path: arm.urdf\nname: arm\n")
    assert package_source(package, "arm").config == Path("arm.yaml")


def test_folders_are_replaced_as_wholes_and_the_longest_first(tmp_path: Path) -> None:
    urdf, build = tmp_path / "src" / "urdf" / "r.urdf", tmp_path / "data" / "set" / ".import-r-1" / "object"
    texts = portable_texts(urdf, build, {"arms": tmp_path / "src" / "arms"})
    assert texts(str(urdf)) == "./r.urdf"
    assert (
        texts(f"mesh {tmp_path}/src/arms/a.obj, {tmp_path}/src/armsx")
        == "mesh package://arms/a.obj, ../armsx"
    )
    assert texts(f"{tmp_path}/src/urdf2/b '{tmp_path}/src/urdf'") == "../urdf2/b '.'"
    assert texts({f"{build}/urdf": [f"{build}/mjcf/r.xml", 1.5, None]}) == {
        "./urdf": ["./mjcf/r.xml", 1.5, None]
    }
    assert texts("1/2 of a/b, http://x.org/tmp") == "1/2 of a/b, http://x.org/tmp"
