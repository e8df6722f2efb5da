"""Wavefront OBJ: indices, materials, textures."""

import numpy as np
import pytest
from PIL import Image

from roboyard.shapes.load import clear_cache, load_mesh

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.fixture(autouse=True)
def empty_cache():
    clear_cache()


def load(tmp_path, text, **files):
    folder = tmp_path / "meshes"
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        (folder / name.replace("_", ".")).write_text(content)
    (folder / "a.obj").write_text(text)
    return load_mesh(folder / "a.obj")


def image(file, color, size=(4, 2)):
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGBA", size, color).save(file)


@pytest.mark.parametrize(
    "face",
    [
        "f 1 2 3 4",
        "f -4 -3 -2 -1",
        "f 1/1 2/2 3/3 4/4",
        "f 1//1 2//1 3//1 4//1",
        "f 1/1/1 2/2/1 3/3/1 4/4/1",
        "f 1/1/1 2//1 3/3 4",
        "f\t1\t2\t3\t4",
        "f 1 2 \\\n 3 4",
        "  f 1 2 3 4  # a comment",
    ],
)
def test_face_syntaxes(tmp_path, face):
    extra = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n"
    mesh = load(tmp_path, SQUARE + extra + face + "\n")
    corners = mesh.vertices[mesh.faces]
    np.testing.assert_array_equal(corners[0], [[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    np.testing.assert_array_equal(corners[1], [[0, 0, 0], [1, 1, 0], [0, 1, 0]])
    if face.startswith(("f 1//1", "f 1/1/1 2/2/1")):
        np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (len(mesh.vertices), 1)))
    else:
        assert mesh.normals is None


def test_negative_indices_are_relative_to_their_line(tmp_path):
    mesh = load(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[1]], [[5, 0, 0], [6, 0, 0], [5, 1, 0]])


def test_vertices_split_where_normals_differ(tmp_path):
    text = "vn 0 0 1\nvn 0 1 0\n" + SQUARE + "f 1//1 2//1 3//1\nf 1//2 3//2 4//2\n"
    mesh = load(tmp_path, text)
    assert len(mesh.vertices) == 6
    np.testing.assert_array_equal(mesh.normals[mesh.faces[0]], [[0, 0, 1]] * 3)
    np.testing.assert_array_equal(mesh.normals[mesh.faces[1]], [[0, 1, 0]] * 3)


def test_missing_normals_are_derived_beside_given_ones(tmp_path):
    text = "vn 1 0 0\n" + SQUARE + "usemtl a\nf 1//1 2//1 3//1\nusemtl b\nf 1 3 4\n"
    mesh = load(tmp_path, text)
    np.testing.assert_array_equal(mesh.normals[mesh.faces[0]], [[1, 0, 0]] * 3)
    np.testing.assert_array_equal(mesh.normals[mesh.faces[1]], [[0, 0, 1]] * 3)


def test_missing_normals_and_coordinates_are_ignored(tmp_path):
    mesh = load(tmp_path, SQUARE + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/9/9 3/9/9 4/9/9\n")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces[1]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert mesh.normals is None and mesh.uv is None


def test_material_colours_become_face_colours(tmp_path):
    text = "mtllib a.mtl\n" + SQUARE + "f 1 2 3\nusemtl red one\nf 1 3 4\nusemtl glass\nf 1 2 4\n"
    mtl = "newmtl red one\nKd 1 0 0\nnewmtl glass\nKd 0 0.5 1\nTr 0.75\n"
    mesh = load(tmp_path, text, a_mtl=mtl)
    assert mesh.colors.tolist() == [[255, 255, 255, 255], [255, 0, 0, 255], [0, 128, 255, 64]]


def test_vertex_colours_are_averaged(tmp_path):
    mesh = load(tmp_path, "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0.6 0\nf 1 2 3\n")
    assert mesh.colors.tolist() == [[255, 51, 0, 255]]


def test_texture_with_coordinates(tmp_path):
    image(tmp_path / "meshes" / "wood.png", (10, 20, 30, 255))
    text = "mtllib a.mtl\n" + SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl wood\nf 1/1 2/2 3/3 4/4\n"
    mesh = load(tmp_path, text, a_mtl="newmtl wood\nKd 0 0 0\nmap_Kd -s 1 1 1 wood.png\n")
    assert mesh.texture.shape == (2, 4, 4)
    assert mesh.texture[0, 0].tolist() == [10, 20, 30, 255]
    assert mesh.colors is None
    np.testing.assert_array_equal(mesh.uv, mesh.vertices[:, :2])


def sample(mesh, face: int) -> list[int]:
    """Colour of the texture at the middle of a face, times the face's own."""
    u, v = mesh.uv[mesh.faces[face]].mean(axis=0)
    height, width = mesh.texture.shape[:2]
    texel = mesh.texture[int((1 - v) * height), int(u * width)].astype(int)
    own = np.array([255] * 4) if mesh.colors is None else mesh.colors[face].astype(int)
    return (texel * own // 255).tolist()


def test_several_textures_and_plain_colours_share_one_image(tmp_path):
    image(tmp_path / "meshes" / "red.png", (255, 0, 0, 255), (8, 8))
    image(tmp_path / "meshes" / "green.png", (0, 255, 0, 255), (4, 16))
    text = (
        "mtllib a.mtl\n"
        + SQUARE
        + "vt 0 0\nvt 1 0\nvt 1 1\nusemtl red\nf 1/1 2/2 3/3\nusemtl green\nf 1/1 3/2 4/3\n"
        + "usemtl blue\nf 1 2 4\nusemtl red\nvt 5.1 7\nvt 5.9 7\nvt 5.9 7.8\nf 2/4 3/5 4/6\n"
    )
    mtl = "newmtl red\nmap_Kd red.png\nnewmtl green\nmap_Kd green.png\nnewmtl blue\nKd 0 0 1\n"
    mesh = load(tmp_path, text, a_mtl=mtl)
    colors = [tuple(sample(mesh, face)) for face in range(4)]
    assert sorted(colors) == sorted([(255, 0, 0, 255)] * 2 + [(0, 255, 0, 255), (0, 0, 255, 255)])
    assert mesh.uv.min() >= 0
    assert mesh.uv.max() <= 1


@pytest.mark.parametrize(
    "name",
    ["../../outside/secret.png", "../secret.png", "link.png", "gone.png", "broken.png", "C:\\x\\gone.png"],
)
def test_missing_or_broken_textures_drop_only_the_texture(tmp_path, name):
    image(tmp_path / "outside" / "secret.png", (1, 2, 3, 255))
    image(tmp_path / "robot" / "secret.png", (1, 2, 3, 255))
    folder = tmp_path / "robot" / "parts"
    folder.mkdir()
    (folder / "link.png").symlink_to(tmp_path / "outside" / "secret.png")
    (folder / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n broken")
    (folder / "a.mtl").write_text(f"newmtl m\nKd 1 0 0\nmap_Kd {name}\n")
    (folder / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + "vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n")
    mesh = load_mesh(folder / "a.obj")
    assert mesh.texture is None
    assert mesh.colors.tolist() == [[255, 0, 0, 255]]


@pytest.mark.parametrize(
    ("folder", "name"), [("meshes/visual", "../../textures/wood.png"), ("models", "../images/wood.png")]
)
def test_textures_of_the_package_are_found(tmp_path, folder, name):
    folder = tmp_path / "pkg" / folder
    folder.mkdir(parents=True)
    image((folder / name).resolve(), (1, 2, 3, 255))
    (folder / "a.mtl").write_text(f"newmtl m\nmap_Kd {name}\n")
    (folder / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + "vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n")
    assert load_mesh(folder / "a.obj").texture[0, 0].tolist() == [1, 2, 3, 255]


def test_large_textures_are_reduced(tmp_path):
    image(tmp_path / "meshes" / "wide.png", (9, 9, 9, 255), (5000, 10))
    text = "mtllib a.mtl\n" + SQUARE + "vt 0 0\nusemtl m\nf 1/1 2/1 3/1\n"
    mesh = load(tmp_path, text, a_mtl="newmtl m\nmap_Kd wide.png\n")
    assert mesh.texture.shape[1] == 4096


def test_meshes_share_images_and_material_libraries(tmp_path):
    Image.new("RGB", (2, 2), (9, 9, 9)).save(tmp_path / "wood.png")
    (tmp_path / "a.mtl").write_text("newmtl wood\nmap_Kd wood.png\n")
    text = "mtllib a.mtl\n" + SQUARE + "vt 0 0\nvt 1 0\nvt 1 1\nusemtl wood\nf 1/1 2/2 3/3\n"
    meshes = []
    for name in ("one.obj", "two.obj"):
        (tmp_path / name).write_text(text)
        meshes.append(load_mesh(tmp_path / name))
    assert meshes[0].texture is not None
    assert meshes[0].texture is meshes[1].texture
    assert not meshes[0].texture.flags.writeable
    (tmp_path / "a.mtl").write_text("newmtl wood\nKd 1 0 0\nmap_Kd wood.png\nd 0.5\n")
    (tmp_path / "three.obj").write_text(text)
    assert load_mesh(tmp_path / "three.obj").colors is not None, "a changed library is read again"


def counted(monkeypatch):
    """Return a list that grows by a file's name whenever an OBJ is read."""
    from roboyard.shapes.readers import read_obj

    names, original = [], read_obj.read_obj

    def read(data, file):
        names.append(file.name)
        return original(data, file)

    monkeypatch.setattr(read_obj, "read_obj", read)
    return names


def test_a_copy_is_not_read_again(tmp_path, monkeypatch):
    names = counted(monkeypatch)
    for name in ("a", "b"):
        (tmp_path / f"{name}.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0.123\nf 1 2 3\n")
    (tmp_path / "c.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0.124\nf 1 2 3\n")
    first = load_mesh(tmp_path / "a.obj")
    assert load_mesh(tmp_path / "b.obj") is first
    assert load_mesh(tmp_path / "c.obj").vertices[2, 2] == 0.124
    assert names == ["a.obj", "c.obj"]


def test_a_copy_beside_other_materials_is_read(tmp_path, monkeypatch):
    names = counted(monkeypatch)
    colors = {"a": "1 0 0", "b": "1 0 0", "c": "0 1 0", "d": None}
    meshes = {}
    for name, color in colors.items():
        folder = tmp_path / name
        folder.mkdir()
        (folder / "part.obj").write_text(
            "mtllib looks.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0.125\nusemtl paint\nf 1 2 3\n"
        )
        if color is not None:
            (folder / "looks.mtl").write_text(f"newmtl paint\nKd {color}\n")
        meshes[name] = load_mesh(folder / "part.obj")
    assert meshes["b"] is meshes["a"] and len(names) == 3
    assert [meshes[name].colors[0, :2].tolist() for name in "abc"] == [[255, 0], [255, 0], [0, 255]]
    assert meshes["d"].colors is None


def test_a_copy_beside_another_picture_is_read(tmp_path):
    meshes = []
    for name, shade in (("a", 10), ("b", 10), ("c", 200)):
        folder = tmp_path / name
        folder.mkdir()
        Image.fromarray(np.full((2, 2, 3), shade, dtype=np.uint8)).save(folder / "skin.png")
        (folder / "looks.mtl").write_text("newmtl paint\nmap_Kd skin.png\n")
        (folder / "part.obj").write_text(
            "mtllib looks.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0.126\nvt 0 0\nvt 1 0\nvt 0 1\n"
            "usemtl paint\nf 1/1 2/2 3/3\n"
        )
        meshes.append(load_mesh(folder / "part.obj"))
    assert meshes[1] is meshes[0]
    assert [int(mesh.texture[0, 0, 0]) for mesh in meshes] == [10, 10, 200]
