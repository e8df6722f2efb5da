"""Mesh files that hold no triangles, and elements that are not URDF, as PyBullet 3.2.7 has them."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

import roboyard.pybullet as p

_POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:4cac\nsize 12345\n"
_TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
_INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def _robot(folder: Path, shape: str, mesh: str, text: str | None) -> int:
    if text is not None:
        (folder / mesh).write_text(text)
    geometry = f'<geometry><mesh filename="{mesh}"/></geometry>'
    file = folder / "r.urdf"
    file.write_text(f'<robot name="r"><link name="a">{_INERTIAL}<{shape}>{geometry}</{shape}></link></robot>')
    return p.loadURDF(str(file), [0, 0, 1])


@pytest.mark.parametrize("mesh", ["a.obj", "a.stl", "a.dae"])
@pytest.mark.parametrize("text", [_POINTER, ""])
@pytest.mark.parametrize("shape", ["collision", "visual"])
def test_a_robot_with_a_mesh_that_is_not_there_loads_as_in_pybullet(
    client: int, tmp_path: Path, shape: str, text: str, mesh: str
) -> None:
    robot = _robot(tmp_path, shape, mesh, text)
    # the moments and box of a link without shapes, recorded with PyBullet 3.2.7 for each of these files
    assert p.getDynamicsInfo(robot, -1)[2] == pytest.approx([6.666666666666666e-07] * 3, rel=1e-12)
    assert p.getAABB(robot) == ((-0.001, -0.001, 0.999), (0.001, 0.001, 1.001))
    if shape == "visual":
        (row,) = p.getVisualShapeData(robot)
        assert row[:4] == (robot, -1, p.GEOM_MESH, (1.0, 1.0, 1.0))
    p.getCameraImage(16, 16)


@pytest.mark.parametrize("shape", ["collision", "visual"])
def test_a_binary_stl_file_with_a_blank_header_is_read(
    client: int, tmp_path: Path, shape: str, caplog: pytest.LogCaptureFixture
) -> None:
    triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0)
    top = struct.pack("<12fH", 1, 1, 1, 0, 0, 3, 2, 0, 0, 0, 1, 0, 0)
    (tmp_path / "a.stl").write_bytes(b" " * 80 + struct.pack("<I", 2) + triangle + top)
    robot = _robot(tmp_path, shape, "a.stl", None)
    p.getCameraImage(16, 16)
    assert not caplog.records
    if shape == "collision":
        assert p.getAABB(robot)[1] == pytest.approx((2.002, 1.002, 4.002), abs=1e-6)  # as in PyBullet 3.2.7


def test_a_mesh_that_comes_later_is_read(client: int, tmp_path: Path) -> None:
    _robot(tmp_path, "collision", "a.obj", _POINTER)
    cube = "".join(f"v {x} {y} {z}\n" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))
    corners = ("124", "143", "578", "586", "156", "162", "348", "387", "137", "175", "268", "284")
    faces = "".join(f"f {' '.join(corner)}\n" for corner in corners)
    robot = _robot(tmp_path, "collision", "a.obj", cube + faces)
    assert len(p.getCollisionShapeData(robot, -1)) == 1


def test_elements_of_xacro_are_skipped_like_unknown_ones(client: int, tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:include filename="other.xacro"/>'
        f'<link name="a">{_INERTIAL}<collision><geometry><box size="1 2 3"/></geometry></collision>'
        "</link></robot>"
    )
    robot = p.loadURDF(str(file))
    assert p.getBodyInfo(robot) == (b"a", b"r")
    assert p.getNumJoints(robot) == 0
    assert p.getCollisionShapeData(robot, -1)[0][2:4] == (p.GEOM_BOX, (1.0, 2.0, 3.0))


def test_a_mesh_outside_the_folders_of_its_robot_is_a_warning(
    client: int, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    kept, robot = tmp_path / "kept" / "here", tmp_path / "a" / "b" / "c" / "d" / "robot"
    kept.mkdir(parents=True)
    robot.mkdir(parents=True)
    (kept / "a.obj").write_text(_TETRAHEDRON)
    (robot / "linked").symlink_to(kept)
    number = _robot(robot, "collision", "linked/a.obj", None)
    assert p.getAABB(number) == ((-0.001, -0.001, 0.999), (0.001, 0.001, 1.001))
    (record,) = caplog.records
    assert "'linked/a.obj' is outside the robot's folders" in record.getMessage()
    p.setAdditionalSearchPath(str(kept))
    number = _robot(robot, "collision", "linked/a.obj", None)
    assert p.getAABB(number)[1] == pytest.approx((1.003, 1.003, 2.003), abs=1e-6)  # as in PyBullet 3.2.7
    assert len(caplog.records) == 1


@pytest.mark.parametrize("is_named_before", [False, True])
def test_a_mesh_in_the_working_directory_or_beside_code_is_read(
    client: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_named_before: bool
) -> None:
    kept, robot = tmp_path / "one" / "kept", tmp_path / "two" / "a" / "robot"
    kept.mkdir(parents=True)
    robot.mkdir(parents=True)
    (kept / "a.obj").write_text(_TETRAHEDRON)
    if is_named_before:
        assert p.getAABB(_robot(robot, "collision", str(kept / "a.obj"), None))[1][0] == 0.001
        monkeypatch.chdir(kept.parent)
    else:
        monkeypatch.syspath_prepend(kept)
    number = _robot(robot, "collision", str(kept / "a.obj"), None)
    assert p.getAABB(number)[1] == pytest.approx((1.003, 1.003, 2.003), abs=1e-6)  # as in PyBullet 3.2.7


def test_an_sdf_file_names_meshes_as_a_urdf_file_does(client: int, tmp_path: Path) -> None:
    for name in ("robot", "tray"):
        (tmp_path / name).mkdir()
    (tmp_path / "tray" / "m.obj").write_text(_TETRAHEDRON)
    inertia = "<ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz><izz>1</izz>"
    mesh = "<geometry><mesh><uri>../tray/m.obj</uri></mesh></geometry>"
    (tmp_path / "robot" / "a.sdf").write_text(
        f'<sdf version="1.6"><model name="m"><link name="b"><inertial><mass>1</mass>'
        f'<inertia>{inertia}</inertia></inertial><collision name="c">{mesh}</collision></link></model></sdf>'
    )
    (number,) = p.loadSDF(str(tmp_path / "robot" / "a.sdf"))
    assert p.getAABB(number)[1] == pytest.approx((1.003, 1.003, 1.003), abs=1e-6)  # as in PyBullet 3.2.7


@pytest.mark.parametrize(
    ("corners", "upper"),  # boxes recorded with PyBullet 3.2.7; warnings of NumPy are errors here
    [
        ("v 0 0 0\nv 0 0 0\nv 0 0 0\n", (0.002, 0.002, 0.002)),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\n", (2.002, 0.002, 0.002)),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", (1.002, 1.002, 0.002)),
    ],
)
def test_meshes_of_one_point_line_or_triangle_collide(
    client: int, tmp_path: Path, corners: str, upper: tuple[float, ...]
) -> None:
    (tmp_path / "a.obj").write_text(f"{corners}f 1 2 3\n")
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=str(tmp_path / "a.obj"))
    assert p.getAABB(p.createMultiBody(1, shape))[1] == pytest.approx(upper, abs=1e-6)


def test_a_mesh_that_is_scaled_by_zero_is_flat(client: int, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(_TETRAHEDRON)
    mesh = '<geometry><mesh filename="a.obj" scale="0.5 0.5 0.0"/></geometry>'
    for kind, upper in (("visual", (0.001, 0.001, 0.001)), ("collision", (0.503, 0.503, 0.003))):
        (tmp_path / "r.urdf").write_text(
            f'<robot name="r"><link name="a">{_INERTIAL}<{kind}>{mesh}</{kind}></link></robot>'
        )
        body = p.loadURDF(str(tmp_path / "r.urdf"))
        assert p.getAABB(body)[1] == pytest.approx(upper, abs=1e-6), kind  # as in PyBullet 3.2.7
    shape = p.createCollisionShape(p.GEOM_MESH, fileName=str(tmp_path / "a.obj"), meshScale=[0.5, 0.5, 0.0])
    assert p.getAABB(p.createMultiBody(1, shape))[1] == pytest.approx((0.502, 0.502, 0.002), abs=1e-6)


def test_triangles_have_a_margin_if_they_are_no_file(client: int, tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(_TETRAHEDRON)
    corners, indices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
    for margin, shape in (  # as in PyBullet 3.2.7
        (0.001, p.createCollisionShape(p.GEOM_MESH, vertices=corners, indices=indices)),
        (
            0.0,
            p.createCollisionShape(
                p.GEOM_MESH, fileName=str(tmp_path / "a.obj"), flags=p.GEOM_FORCE_CONCAVE_TRIMESH
            ),
        ),
    ):
        body = p.createMultiBody(0, shape)
        assert p.getDynamicsInfo(body, -1)[11] == margin
        assert p.getAABB(body)[1] == pytest.approx([1.0 + margin] * 3, abs=1e-6)
        p.changeDynamics(body, -1, collisionMargin=0.01)
        assert p.getDynamicsInfo(body, -1)[11] == 0.01
        assert p.getAABB(body)[1] == pytest.approx([1.01] * 3, abs=1e-6)


@pytest.mark.parametrize("text", ["yes", "no", "0", ""])
def test_a_mesh_is_concave_whatever_its_attribute_says(client: int, tmp_path: Path, text: str) -> None:
    (tmp_path / "a.obj").write_text(_TETRAHEDRON)
    (tmp_path / "r.urdf").write_text(
        f'<robot name="r"><link name="a"><collision concave="{text}"><geometry><mesh filename="a.obj"/>'
        "</geometry></collision></link></robot>"
    )
    assert p.getAABB(p.loadURDF(str(tmp_path / "r.urdf")))[1] == (1.0, 1.0, 1.0)  # as in PyBullet 3.2.7


def test_only_meshes_are_concave(client: int, tmp_path: Path) -> None:
    ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[2, 2, 0.1]))
    (tmp_path / "r.urdf").write_text(
        f'<robot name="r"><link name="a">{_INERTIAL}<collision concave="true"><geometry>'
        '<cylinder radius=".05" length=".3"/></geometry></collision></link></robot>'
    )
    body = p.loadURDF(str(tmp_path / "r.urdf"), [0, 0, 0.3], [0.1, 0.2, 0, 0.97])
    (point,) = p.getClosestPoints(ground, body, 0.3)
    assert point[8] == pytest.approx(0.042306, abs=2e-5)  # recorded with PyBullet 3.2.7


@pytest.mark.parametrize(
    ("uri", "folder"), [("file://models/cone/meshes/t.obj", "models/cone"), ("meshes/t.obj", "models/cone")]
)
def test_meshes_of_an_sdf_file_are_looked_for_above_it(
    client: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, uri: str, folder: str
) -> None:
    (tmp_path / "models/cone/meshes").mkdir(parents=True)
    (tmp_path / "models/cone/meshes/t.obj").write_text(_TETRAHEDRON)
    inertia = "<ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz><izz>1</izz>"
    mesh = f"<geometry><mesh><uri>{uri}</uri></mesh></geometry>"
    (tmp_path / folder / "model.sdf").write_text(
        f'<sdf version="1.6"><model name="m"><link name="l"><inertial><mass>1</mass>'
        f'<inertia>{inertia}</inertia></inertial><visual name="v">{mesh}</visual>'
        f'<collision name="c">{mesh}</collision></link></model></sdf>'
    )
    monkeypatch.chdir(tmp_path)
    (body,) = p.loadSDF("models/cone/model.sdf")
    assert p.getAABB(body)[1] == pytest.approx((1.003, 1.003, 1.003), abs=1e-6)  # as in PyBullet 3.2.7
    if uri.startswith("meshes"):
        assert p.getVisualShapeData(body)[0][4] == b"models/cone/meshes/t.obj"


@pytest.mark.parametrize(
    ("text", "mass"),  # as in PyBullet 3.2.7, which reads a number
    [("0", 2.0), ("1", 0.0), ("true", 2.0), (" 1 ", 0.0), ("2", 2.0), ("1.5", 0.0)],
)
def test_an_sdf_model_is_static_where_bullet_reads_one(
    client: int, tmp_path: Path, text: str, mass: float
) -> None:
    inertia = "<ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz><izz>1</izz>"
    (tmp_path / "m.sdf").write_text(
        f'<sdf version="1.6"><model name="m"><static>{text}</static><link name="l"><inertial><mass>2</mass>'
        f"<inertia>{inertia}</inertia></inertial></link></model></sdf>"
    )
    (body,) = p.loadSDF(str(tmp_path / "m.sdf"))
    assert p.getDynamicsInfo(body, -1)[0] == mass
