"""Mesh files that hold no triangles, and elements that are not URDF, as PyBullet 3.2.7 has them."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

import roboyard.pybullet as p

_POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:4cac\nsize 12345\n"
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
    (kept / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    (robot / "linked").symlink_to(kept)
    number = _robot(robot, "collision", "linked/a.obj", None)
    assert p.getAABB(number) == ((-0.001, -0.001, 0.999), (0.001, 0.001, 1.001))
    (record,) = caplog.records
    assert "'linked/a.obj' is outside the robot's folders" in record.getMessage()
    p.setAdditionalSearchPath(str(kept))
    number = _robot(robot, "collision", "linked/a.obj", None)
    assert p.getAABB(number)[1] == pytest.approx((1.003, 1.003, 2.003), abs=1e-6)  # as in PyBullet 3.2.7
    assert len(caplog.records) == 1
