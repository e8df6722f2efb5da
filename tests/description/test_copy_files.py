"""Copies of meshes and images: plain names, each file once, and references that hold in the new folder."""

import json
from pathlib import Path

import pytest
import trimesh

from roboyard.description.files.copy_files import FileCopier, plain_name


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("arm.stl", "arm.stl"),
        ("my part (1).STL", "my_part__1_.STL"),
        ("Käfer.obj", "Kafer.obj"),
        ("手.dae", "_.dae"),
        ("a.b.c.obj", "a.b.c.obj"),
        (".hidden", "hidden"),
        ("folder/sub\\part.stl", "part.stl"),
        ("...", "mesh"),
        ("x.st l", "x.stl"),
    ],
)
def test_plain_names_are_ascii_and_keep_their_suffix(name: str, plain: str) -> None:
    assert plain_name(name) == plain
    assert plain_name(plain) == plain


def mesh_at(file: Path, size: float = 1.0) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    trimesh.creation.box((size, size, size)).export(file)
    return file


def test_a_mesh_is_copied_byte_for_byte_and_once(tmp_path: Path) -> None:
    source = mesh_at(tmp_path / "from" / "my part.stl")
    copier = FileCopier(folder=tmp_path / "to")
    assert copier.mesh(source) == "meshes/my_part.stl"
    source.write_bytes(b"changed later")
    assert copier.mesh(source) == "meshes/my_part.stl"
    copied = trimesh.load_mesh(tmp_path / "to" / "meshes" / "my_part.stl")
    assert copied.volume == pytest.approx(1.0)
    assert copier.staged == {source: "meshes/my_part.stl"}


def test_files_of_one_name_get_numbers_also_where_case_alone_differs(tmp_path: Path) -> None:
    sources = [mesh_at(tmp_path / folder / name, size) for folder, name, size in
               (("a", "part.stl", 1), ("b", "part.stl", 2), ("c", "PART.stl", 3))]  # fmt: skip
    copier = FileCopier(folder=tmp_path / "to")
    copies = [copier.mesh(source) for source in sources]
    assert copies == ["meshes/part.stl", "meshes/part_1.stl", "meshes/PART_2.stl"]
    sizes = [trimesh.load_mesh(tmp_path / "to" / copy).extents[0] for copy in copies]
    assert sizes == pytest.approx([1, 2, 3])


def test_names_stay_on_request(tmp_path: Path) -> None:
    source = mesh_at(tmp_path / "from" / "my part.stl")
    assert FileCopier(folder=tmp_path / "to", plain=False).mesh(source) == "meshes/my part.stl"


def test_the_name_of_a_missing_file_is_not_given_to_a_copy(tmp_path: Path) -> None:
    source = mesh_at(tmp_path / "from" / "part.stl")
    copier = FileCopier(folder=tmp_path / "to", reserved=frozenset({"part.stl"}))
    assert copier.mesh(source) == "meshes/part_1.stl"


def test_images_and_meshes_have_folders_of_their_own(tmp_path: Path) -> None:
    image = tmp_path / "from" / "wood grain.png"
    image.parent.mkdir()
    image.write_bytes(b"\x89PNG")
    copier = FileCopier(folder=tmp_path / "to")
    assert copier.image(image) == "textures/wood_grain.png"
    assert (tmp_path / "to" / "textures" / "wood_grain.png").read_bytes() == b"\x89PNG"


def test_an_obj_is_copied_with_its_library_and_images_under_bare_names(tmp_path: Path) -> None:
    home = tmp_path / "from"
    (home / "my textures").mkdir(parents=True)
    (home / "my textures" / "wood (1).png").write_bytes(b"image")
    (home / "lib.mtl").write_text("newmtl wood\nKd 1 1 1\nmap_Kd my textures/wood (1).png\n")
    (home / "arm.obj").write_text("# arm\nmtllib lib.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wood\nf 1 2 3\n")
    copy = FileCopier(folder=tmp_path / "to").mesh(home / "arm.obj")
    assert copy == "meshes/arm/arm.obj"
    folder = tmp_path / "to" / "meshes" / "arm"
    assert sorted(file.name for file in folder.iterdir()) == ["arm.obj", "lib.mtl", "wood__1_.png"]
    assert (folder / "arm.obj").read_text() == (home / "arm.obj").read_text()
    assert "map_Kd wood__1_.png\n" in (folder / "lib.mtl").read_text()
    assert (folder / "wood__1_.png").read_bytes() == b"image"


def test_a_dae_names_its_images_bare_and_keeps_references_by_id(tmp_path: Path) -> None:
    home = tmp_path / "from"
    (home / "tex").mkdir(parents=True)
    (home / "tex" / "a.png").write_bytes(b"image")
    (home / "arm.dae").write_text(
        "<COLLADA><library_images><image id='one'><init_from>tex/a.png</init_from></image></library_images>"
        "<newparam><surface><init_from>one</init_from></surface></newparam></COLLADA>"
    )
    copy = FileCopier(folder=tmp_path / "to").mesh(home / "arm.dae")
    text = (tmp_path / "to" / copy).read_text()
    assert "<init_from>a.png</init_from>" in text
    assert "<init_from>one</init_from>" in text


def test_a_gltf_names_its_buffers_bare(tmp_path: Path) -> None:
    home = tmp_path / "from"
    (home / "bin").mkdir(parents=True)
    (home / "bin" / "data 1.bin").write_bytes(bytes(12))
    scene = {"asset": {"version": "2.0"}, "buffers": [{"uri": "bin/data%201.bin", "byteLength": 12}]}
    (home / "arm.gltf").write_text(json.dumps(scene))
    copy = tmp_path / "to" / FileCopier(folder=tmp_path / "to").mesh(home / "arm.gltf")
    (buffer,) = json.loads(copy.read_text())["buffers"]
    assert buffer == {"uri": "data_1.bin", "byteLength": 12}
    assert (copy.parent / "data_1.bin").read_bytes() == bytes(12)


def test_two_images_of_one_name_stay_apart(tmp_path: Path) -> None:
    home = tmp_path / "from"
    for folder in ("a", "b"):
        (home / folder).mkdir(parents=True)
        (home / folder / "skin.png").write_text(folder)
    (home / "m.mtl").write_text("newmtl x\nmap_Kd a/skin.png\nnewmtl y\nmap_Kd b/skin.png\n")
    (home / "m.obj").write_text("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    copy = FileCopier(folder=tmp_path / "to").mesh(home / "m.obj")
    folder = (tmp_path / "to" / copy).parent
    named = [line.split()[1] for line in (folder / "m.mtl").read_text().splitlines() if "map_Kd" in line]
    assert [(folder / name).read_text() for name in named] == ["a", "b"]
