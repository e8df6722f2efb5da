"""Mesh files as trimesh reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from roboyard.shapes import primitives
from roboyard.shapes.load import load_mesh
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.mesh_files import write_obj, write_stl


def test_stl_holds_the_same_solid(tmp_path: Path) -> None:
    mesh = primitives.cylinder(0.2, 0.7)
    write_stl(mesh, tmp_path / "a.stl")
    read = trimesh.load_mesh(tmp_path / "a.stl")
    assert len(read.faces) == len(mesh.faces)
    assert read.is_watertight
    source = trimesh.Trimesh(mesh.vertices, mesh.faces)
    assert read.volume == pytest.approx(source.volume, rel=1e-5)
    assert np.allclose(read.bounds, mesh.bounds, atol=1e-6)


@pytest.mark.parametrize("uv", [True, False])
@pytest.mark.parametrize("normals", [True, False])
def test_obj_reads_back_to_the_last_bit_of_single_precision(tmp_path: Path, uv: bool, normals: bool) -> None:
    source = primitives.sphere(0.1)
    mesh = TriangleMesh(
        vertices=source.vertices * 1.2345678901,
        faces=source.faces,
        normals=source.normals if normals else None,
        uv=source.uv if uv else None,
    )
    write_obj(mesh, tmp_path / "a.obj")
    read = load_mesh(tmp_path / "a.obj")
    corners, expected = read.vertices[read.faces], mesh.vertices[mesh.faces]
    assert np.array_equal(corners.astype(np.float32), expected.astype(np.float32))
    assert (read.normals is None) == (mesh.normals is None)
    if mesh.normals is not None and read.normals is not None:
        assert np.allclose(read.normals[read.faces], mesh.normals[mesh.faces], atol=1e-6)
    if mesh.uv is not None:
        lines = (tmp_path / "a.obj").read_text().splitlines()
        texture = np.array([line.split()[1:] for line in lines if line.startswith("vt ")], dtype=float)
        slots = [[int(c.split("/")[1]) for c in line.split()[1:]] for line in lines if line.startswith("f ")]
        assert np.allclose(texture[np.array(slots) - 1], mesh.uv[mesh.faces], atol=1e-8)


def test_obj_longer_than_a_block(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    vertices = rng.uniform(-1, 1, (30_000, 3))
    faces = rng.integers(0, 30_000, (45_000, 3)).astype(np.int32)
    write_obj(TriangleMesh(vertices=vertices, faces=faces), tmp_path / "a.obj")
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert [sum(line.startswith(tag) for line in lines) for tag in ("v ", "f ")] == [30_000, 45_000]
    assert lines[-1] == "f " + " ".join(str(v + 1) for v in faces[-1])


def test_obj_keeps_the_colour_of_each_face_and_the_texture(tmp_path: Path) -> None:
    source = primitives.box(0.1, 0.2, 0.3)
    colors = np.tile(np.array([[255, 0, 0, 255], [0, 51, 255, 255]], dtype=np.uint8), (6, 1))
    write_obj(
        TriangleMesh(vertices=source.vertices, faces=source.faces, colors=colors),
        tmp_path / "new" / "a.obj",
        materials=True,
    )
    read = load_mesh(tmp_path / "new" / "a.obj")
    assert read.colors is not None
    written = {tuple(map(tuple, corners)): tuple(c) for corners, c in zip(
        np.round(source.vertices[source.faces], 6), colors, strict=True)}  # fmt: skip
    for corners, color in zip(np.round(read.vertices[read.faces], 6), read.colors, strict=True):
        assert written[tuple(map(tuple, corners))] == tuple(color)
    texture = np.zeros((2, 2, 3), dtype=np.uint8)
    textured = TriangleMesh(vertices=source.vertices, faces=source.faces, uv=source.uv, texture=texture)
    write_obj(textured, tmp_path / "b.obj", materials=True)
    assert "map_Kd b.png" in (tmp_path / "b.mtl").read_text()
    assert (tmp_path / "b.png").is_file()
