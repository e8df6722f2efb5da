"""Objects of OBJ files: compiled loops find those that a loop over the lines finds, and files say so."""

from __future__ import annotations

import os
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pytest

from roboyard.description.model import Mesh
from roboyard.pybullet.bullet_rules import mesh_objects
from roboyard.shapes.readers import plain_obj
from roboyard.sim.build import hull_store

CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0.1\nv 2.5e-1 -1 3\n"
FILES = {
    "two": f"{CORNERS}o a\nf 1 2 3\nf 1 3 4\no b\nf 2 3 4\n",
    "corners before each": f"o a\n{CORNERS}f 1 2 3\ng b\n{CORNERS}f 6 7 8\nf 8 9 10\n",
    "polygons": f"{CORNERS}o a\nf 1 2 3 4 5\no b\nf 2 3 4\nf 1/1/1 2/1/1 5/1/1 4/1/1\nvt 0 0\nvn 0 0 1\n",
    "empty ones": f"{CORNERS}o a\no b\nf 1 2 3\no c\no d\nf 2 3 4\no e\n",
    "faces before the first": f"{CORNERS}f 1 2 3\no a\nf 2 3 4\ng b\nf 1 2 5\n",
    "an unnamed group": f"{CORNERS}g\nf 1 2 3\ng\nf 2 3 4\n",
    "spaces and comments": f"# o x\n{CORNERS}  o a\nusemtl o\n f 1 2 3\ns off\n  g b\n\nf 2 3 4\n# f 1 2 3\n",
    "windows lines": f"{CORNERS}o a\nf 1 2 3\no b\nf 2 3 4\n".replace("\n", "\r\n"),
    "numbers from the end": f"{CORNERS}o a\nf -5 -4 -3\no b\nf 2 3 4\n",
    "points and lines": f"{CORNERS}o a\nf 1 2 3\nl 1 2\no b\nf 2 3\nf 2 3 4\n",
    "one": f"{CORNERS}o a\nf 1 2 3\n",
}
COUNTS = {"faces before the first": 3, "one": 0}


@pytest.mark.parametrize("name", FILES)
def test_compiled_loops_find_the_objects_of_a_loop_over_lines(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = FILES[name].encode()
    monkeypatch.setattr(plain_obj, "is_worth_it", lambda _: True)
    found = mesh_objects._split(data)
    monkeypatch.setattr(plain_obj, "is_worth_it", lambda _: False)
    expected = mesh_objects._split(data)
    assert len(found) == len(expected) == COUNTS.get(name, 2)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
        np.testing.assert_array_equal(one.faces, other.faces)


def test_coordinates_are_in_single_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_obj, "is_worth_it", lambda _: True)
    one, _ = mesh_objects._split(FILES["two"].encode())
    assert one.vertices[-1, 2] == float(np.float32(0.1)) != 0.1


@pytest.mark.parametrize("worth", [True, False])
def test_corners_that_are_not_there_raise(worth: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plain_obj, "is_worth_it", lambda _: worth)
    with pytest.raises(IndexError, match="face corners must be 0 to 4"):
        mesh_objects._split(f"{CORNERS}o a\nf 1 2 3\no b\nf 2 3 9\n".encode())


def _begin_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget what a program that starts again does not know."""
    monkeypatch.setattr(mesh_objects, "_read", OrderedDict())
    monkeypatch.setattr(mesh_objects, "_were_kept", set())


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the place of an OBJ file; objects are kept in a folder of the test."""
    monkeypatch.setattr(hull_store, "_folder", lambda: tmp_path / "kept")
    _begin_again(monkeypatch)
    return tmp_path / "objects.obj"


def _objects_of(file: Path) -> list[Mesh]:
    parts = mesh_objects.split_geometry(Mesh(uri=file.name, path=file))
    return [part for part in parts if isinstance(part, Mesh)]


@pytest.mark.parametrize("name", sorted(set(FILES) - {"one"}))
def test_a_program_that_starts_again_does_not_split_a_file(
    name: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_bytes(FILES[name].encode())
    assert not mesh_objects.is_known(file)
    first = _objects_of(file)
    assert not mesh_objects.is_known(file), "only the next program reads what was kept"
    _begin_again(monkeypatch)
    monkeypatch.setattr(mesh_objects, "_split", lambda _: pytest.fail("the file was split again"))
    assert mesh_objects.is_known(file)
    second = _objects_of(file)
    assert len(first) == len(second) == COUNTS.get(name, 2)
    for one, other in zip(first, second, strict=True):
        assert one.data is not None
        assert other.data is not None
        np.testing.assert_array_equal(one.data.vertices, other.data.vertices)
        np.testing.assert_array_equal(one.data.faces, other.data.faces)
        assert not other.data.vertices.flags.writeable


@pytest.mark.parametrize(
    "text",
    [
        f"mtllib colours.mtl\n{FILES['two']}",  # other files may be wrong, which is logged
        FILES["one"],
        f"{CORNERS}vn nan 0 0\no a\nf 1 2 3\no b\nf 2 3 4\nv nan 0 0\no c\nf 1 2 6\n",  # not readable
    ],
)
def test_other_files_are_not_kept(text: str, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file.write_text(text)
    _objects_of(file)
    _begin_again(monkeypatch)
    assert not mesh_objects.is_known(file)


def test_a_file_that_changes_is_not_the_one_that_was_kept(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file.write_text(FILES["two"])
    _objects_of(file)
    _begin_again(monkeypatch)
    assert mesh_objects.is_known(file)
    file.write_text(FILES["faces before the first"])
    os.utime(file, ns=(1, 1))
    assert not mesh_objects.is_known(file)
    assert len(_objects_of(file)) == 3
    file.unlink()
    assert not mesh_objects.is_known(file)
