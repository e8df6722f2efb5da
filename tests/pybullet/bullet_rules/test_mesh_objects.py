"""Objects of OBJ files: compiled loops find those that a loop over the lines finds, and files say so."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.pybullet.bullet_rules import mesh_objects
from roboyard.shapes.readers import plain_obj

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
