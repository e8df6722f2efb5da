"""Loading meshes: what every format has in common."""

import numpy as np
import pytest
import trimesh

from roboyard.errors import MeshError
from roboyard.shapes import load_mesh, scaled
from roboyard.shapes.load import clear_cache
from roboyard.shapes.readers.plain_obj import read_plain
from roboyard.shapes.readers.read_stl import merge_equal


@pytest.fixture(autouse=True)
def empty_cache():
    clear_cache()


def surface_area(mesh) -> float:
    corners = mesh.vertices[mesh.faces]
    return (
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
        / 2
    )


def volume(mesh) -> float:
    """Signed volume: positive where faces are counter-clockwise seen from outside."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "glb", "dae", "stl_ascii"])
def test_every_format_gives_the_same_shape(tmp_path, suffix):
    box = trimesh.creation.box((0.2, 0.4, 0.6))
    box.apply_translation((1, 2, 3))
    file = tmp_path / f"box.{suffix.partition('_')[0]}"
    data = box.export(file_type=suffix)
    file.write_bytes(data.encode() if isinstance(data, str) else data)
    mesh = load_mesh(file)
    assert mesh.faces.shape == (12, 3)
    np.testing.assert_allclose(mesh.bounds, [[0.9, 1.8, 2.7], [1.1, 2.2, 3.3]], atol=1e-6)
    assert volume(mesh) == pytest.approx(0.048, rel=1e-5)
    assert surface_area(mesh) == pytest.approx(2 * (0.08 + 0.12 + 0.24), rel=1e-5)


def test_arrays_are_contiguous_read_only_and_typed(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box().export(file)
    mesh = load_mesh(file)
    assert mesh.vertices.dtype == np.float64
    assert mesh.faces.dtype == np.int32
    for array in (mesh.vertices, mesh.faces):
        assert array.flags.c_contiguous
        assert not array.flags.writeable
    assert mesh.vertices.shape == (8, 3)  # equal corners are one vertex


def test_a_file_is_read_once_until_it_changes(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box().export(file)
    first = load_mesh(file)
    assert load_mesh(str(file)) is first
    trimesh.creation.icosphere(subdivisions=1).export(file)
    assert len(load_mesh(file).faces) == 80


@pytest.mark.parametrize("scale", [(2, 3, 4), (-2, 3, 4), (-2, -3, 4), (-1, -1, -1)])
def test_scaled_meshes_face_outwards(tmp_path, scale):
    file = tmp_path / "cone.glb"
    trimesh.creation.icosphere(subdivisions=2).export(file)
    mesh = load_mesh(file)
    bigger = scaled(mesh, scale)
    np.testing.assert_allclose(bigger.vertices, mesh.vertices * scale)
    assert volume(bigger) == pytest.approx(abs(np.prod(scale)) * volume(mesh))
    assert bigger.vertices.flags.writeable is False


def test_scaled_normals_stay_normal(tmp_path):
    file = tmp_path / "a.obj"
    tilted = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 0]])
    normal = np.cross(tilted[1], tilted[2]) / np.sqrt(2)
    file.write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in tilted)
        + "vn {} {} {}\n".format(*normal)
        + "f 1//1 2//1 3//1\n"
    )
    mesh = scaled(load_mesh(file), (3, 1, -2))
    edges = mesh.vertices[mesh.faces[0]]
    for edge in (edges[1] - edges[0], edges[2] - edges[0]):
        np.testing.assert_allclose(mesh.normals @ edge, 0, atol=1e-12)
    facing = np.cross(edges[1] - edges[0], edges[2] - edges[0])
    assert (mesh.normals @ facing > 0).all()


def test_scale_of_one_shares_the_mesh_and_zero_raises(tmp_path):
    file = tmp_path / "box.stl"
    trimesh.creation.box().export(file)
    mesh = load_mesh(file)
    assert scaled(mesh, (1, 1, 1)) is mesh
    for wrong in ((1, 0, 1), (1, float("nan"), 1)):
        with pytest.raises(ValueError, match="scale must have finite factors"):
            scaled(mesh, wrong)


def test_unused_vertices_are_skipped(tmp_path):
    file = tmp_path / "a.obj"
    file.write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 2 3 4\n")
    mesh = load_mesh(file)
    assert len(mesh.vertices) == 3
    np.testing.assert_array_equal(mesh.bounds, [[0, 0, 0], [1, 1, 0]])


def test_missing_folder_and_unknown_format(tmp_path):
    with pytest.raises(MeshError, match=r"gone\.stl: no such mesh file"):
        load_mesh(tmp_path / "gone.stl")
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(MeshError, match=r"is a folder; give a mesh file"):
        load_mesh(tmp_path / "folder.stl")
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    with pytest.raises(
        MeshError, match=r"part\.step: unknown mesh format '\.step'; convert it to one of \.obj,"
    ):
        load_mesh(tmp_path / "part.step")


HOSTILE = {
    "empty.stl": (b"", "the file is empty"),
    "blank.dae": (b" \n", "the file is empty"),
    "pointer.stl": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
    "huge.stl": (
        b" " * 80 + b"\xff\xff\xff\xff" + b"\1" * 500,
        "counts 4294967295 triangles, but it has 10",
    ),
    "short.stl": (b"x" * 40, "shorter than an STL header"),
    "none.stl": (b"solid none\nendsolid none\n", "no triangles"),
    "zero.stl": (b" " * 80 + bytes(4), "no triangles"),
    "cut.stl": (
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n" + b" " * 60,
        "0 facets, but 2 vertices; the file is truncated",
    ),
    "word.stl": (
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 z\nvertex 1 0 0\nvertex 1 1 0\nendloop\n"
        b"endfacet\nendsolid\n",
        "not a readable STL file",
    ),
    "points.obj": (b"v 0 0 0\nv 1 0 0\n", "no triangles"),
    "beyond.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a face refers to vertex 4, but there are 3"),
    "back.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -9\n", "is before the first vertex"),
    "nought.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "a face refers to vertex 0, but there are 3"),
    "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "1 vertices are not finite numbers"),
    "short.obj": (b"v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a vertex has fewer than three numbers"),
    "overflow.obj": (b"v 0 0 0\nf 1 99999999999999999999 1\n", "not a readable OBJ file"),
    "broken.dae": (b"<COLLADA><asset>", "not a readable DAE file"),
    "other.dae": (b"<svg/>", "the root element is <svg>, not <COLLADA>"),
    "bomb.dae": (
        b'<!DOCTYPE C [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><COLLADA>&b;</COLLADA>',
        "a DOCTYPE .* is not accepted",
    ),
    "nothing.dae": (b"<COLLADA/>", "no triangles"),
    "huge.ply": (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n",
        "counts 4000000000 of vertex, more than its size",
    ),
    "wrong.ply": (b"not a ply file", "no PLY header"),
    "wrong.glb": (b"glTF\2\0\0\0" + b"\xff" * 40, "not a readable GLB file"),
    "huge.gltf": (
        b'{"asset": {"version": "2.0"}, "accessors": [{"count": 4000000000, "type": "VEC3"}]}',
        "declares 12000000000 numbers",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_raise_with_their_name(tmp_path, name):
    data, message = HOSTILE[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(MeshError, match=message) as caught:
        load_mesh(tmp_path / name)
    assert str(caught.value).startswith(f"{name}: ")
    assert "\n" not in str(caught.value)
    assert caught.value.file == tmp_path / name


def test_binary_stl_that_begins_with_solid(tmp_path):
    file = tmp_path / "box.stl"
    data = bytearray(trimesh.creation.box().export(file_type="stl"))
    data[:80] = b"solid facet made by a careless exporter".ljust(80)
    file.write_bytes(bytes(data))
    assert len(load_mesh(file).faces) == 12


def test_a_large_obj_loads_fast(tmp_path):
    import time

    sphere = trimesh.creation.icosphere(subdivisions=6)  # 81,920 triangles
    file = tmp_path / "sphere.obj"
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in sphere.vertices]
    lines += [f"vn {x:.4f} {y:.4f} {z:.4f}" for x, y, z in sphere.vertices]
    lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in sphere.faces + 1]
    file.write_text("\n".join(lines))
    read_plain(b"v 0 0 0\n")  # compiles the loop, once
    start = time.process_time()
    mesh = load_mesh(file)
    assert time.process_time() - start < 2.0
    assert mesh.faces.shape == (81920, 3)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-12)


def test_equal_corners_of_stl_files_are_one_vertex_in_order_of_first_use() -> None:
    rng = np.random.default_rng(5)
    points = (rng.integers(-3, 4, (3000, 3)) / 3).astype(np.float32)
    points[::7, 0] = -0.0
    vertices, places = merge_equal(points)
    assert np.array_equal(vertices[places], points)
    assert len(vertices) == len(np.unique(points + 0.0, axis=0))
    firsts = np.unique(places, return_index=True)[1]
    assert np.array_equal(firsts, np.sort(firsts))
