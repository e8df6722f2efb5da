"""The fast reader of plain OBJ files against the one that reads line by line."""

from __future__ import annotations

import random

import numpy as np
import pytest

from roboyard.shapes.load import clear_cache, load_mesh
from roboyard.shapes.readers import read_obj
from roboyard.shapes.readers.plain_obj import read_plain
from roboyard.shapes.readers.read_obj import _positions, _sort_lines, _table, _triangles

FILE = b"""# a file with everything
mtllib a.mtl
o thing
v 0 0 0
v 1.5 -2.25e-3 +3
v 1e2 .5 5.
v -0.000001 123456789.012345 7E-5
v 1 2 3
vt 0 0
vt 0.25 1 0
vn 0 0 1
g part
usemtl red
s off
f 1 2 3
f 1/1 2/2 3/1 4/2
f 1//1 2//1 3//1
  f 1/1/1 2/2/1 4/1/1 5/2/1 3/1/1
l 1 2
f 1 2
usemtl  blue\x20
f 3 4 5
"""


def line_by_line(data: bytes) -> tuple[object, ...]:
    lines = _sort_lines(data)
    positions, colors = _positions(lines.positions)
    triangles, owners = _triangles(lines)
    rest = lines.face_material, lines.materials, lines.libraries
    return positions, _table(lines.uvs, 2), _table(lines.normals, 3), triangles, owners, *rest, colors


def agrees(data: bytes) -> bool:
    """Whether both read the same; False where the fast reader leaves the file to the other."""
    found = read_plain(data)
    if found is None:
        return False
    positions, uvs, normals, triangles, owners, face_material, materials, libraries, colors = line_by_line(
        data
    )
    np.testing.assert_array_equal(found.positions, positions)
    np.testing.assert_array_equal(found.uvs, uvs)
    np.testing.assert_array_equal(found.normals, normals)
    np.testing.assert_array_equal(found.triangles, triangles)
    np.testing.assert_array_equal(found.face_of_triangle, owners)
    np.testing.assert_array_equal(found.face_material, face_material)
    assert (found.materials, found.libraries) == (materials, libraries)
    assert (found.colors is None) == (colors is None)
    if colors is not None:
        np.testing.assert_array_equal(found.colors, colors)
    return True


@pytest.mark.parametrize("ending", [b"\n", b"\r\n"])
def test_everything_in_a_file(ending: bytes) -> None:
    assert agrees(FILE.replace(b"\n", ending))
    assert agrees(FILE.replace(b"\n", ending).rstrip())
    assert agrees(b"")


def test_colours_of_all_vertices() -> None:
    colored = b"v 0 0 0 0.5 0.25 1\nv 1 0 0 1 0 0.125  \nv 0 1 0 0 0 1\nf 1 2 3\n"
    assert agrees(colored)
    assert agrees(colored.replace(b"\n", b"\r\n"))
    for left in (b"v 2 2 2\n", b"v 2 2 2 0.5\n", b"v 2 2 2 1 1 1 1\n"):
        assert read_plain(colored + left) is None
        assert read_plain(left + colored) is None


def test_numbers_are_exact() -> None:
    made = random.Random(1)
    texts = [f"{made.uniform(-10, 10):.{made.randrange(1, 14)}f}" for _ in range(3000)]
    texts += [f"{made.uniform(-1, 1):.{made.randrange(1, 14)}e}" for _ in range(3000)]
    rows = [" ".join(texts[k : k + 3]) for k in range(0, len(texts), 3)]
    data = "".join(f"v {row}\n" for row in rows).encode()
    found = read_plain(data)
    assert found is not None
    np.testing.assert_array_equal(found.positions.ravel(), [float(text) for text in texts])


@pytest.mark.parametrize(
    "line",
    [b"v 1 2", b"v 1 2 3 0.5 0.5 0.5", b"v nan 0 0", b"v 1 2 0x3", b"v\t1 2 3", b"f -1 -2 -3", b"f 1 2 x",
     b"f 1/ 2/ 3/x", b"f 0 1 2", b"vp 1 2", b"v 1.234567890123456789 0 0", b"v 1e400 0 0", b"f 1 2 \\",
     b"o a\\", b"v 1 2 3\rv 4 5 6", b"f"],
)  # fmt: skip
def test_other_files_are_left_to_the_reader_of_lines(line: bytes) -> None:
    assert read_plain(FILE + line + b"\n") is None


def test_damaged_files_are_read_alike_or_left() -> None:
    made = random.Random(7)
    alphabet = b"0123456789.-+eE/ \n\r#fvnt\\ul\t"
    read = 0
    for _ in range(3000):
        data = bytearray(FILE)
        for _ in range(made.randrange(1, 5)):
            place = made.randrange(len(data))
            if made.random() < 0.3:
                del data[place : place + made.randrange(1, 12)]
            else:
                data[place : place + made.randrange(2)] = bytes([made.choice(alphabet)])
        try:
            read += agrees(bytes(data))
        except ValueError:  # the reader of lines refuses what the fast one would have to
            assert read_plain(bytes(data)) is None
    assert read > 300


def test_large_files_are_read_fast_and_alike(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    (tmp_path / "a.obj").write_bytes(FILE)
    meshes = []
    for answer in (True, False):
        monkeypatch.setattr(read_obj, "is_worth_it", lambda _data, answer=answer: answer)
        clear_cache()
        meshes.append(load_mesh(tmp_path / "a.obj"))
    clear_cache()
    for name in ("vertices", "faces", "normals", "colors"):
        np.testing.assert_array_equal(getattr(meshes[0], name), getattr(meshes[1], name))


def test_many_materials_take_linear_time() -> None:
    """Each of 100,000 faces has a material line before it; a quadratic reader would take minutes."""
    lines = "".join(f"usemtl m{k % 7}\nf 1 2 3\n" for k in range(100_000))
    found = read_plain(b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + lines.encode())
    assert found is not None
    np.testing.assert_array_equal(found.face_material, 1 + np.arange(100_000) % 7)
