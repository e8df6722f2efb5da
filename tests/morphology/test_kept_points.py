"""Points of shapes that are kept on disk: those that the meshes give, without reading them again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from roboyard.description import Box, Collision, Mesh, Pose
from roboyard.description.geometry import shape_meshes
from roboyard.morphology import kept_points as module
from roboyard.morphology.kept_points import kept_points
from roboyard.shapes import primitives
from roboyard.shapes.mesh_files import write_obj
from roboyard.transforms import Array


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROBOYARD_CACHE", str(tmp_path / "cache"))


class Counted:
    """All vertices of shapes, and how often they were asked for."""

    def __init__(self, *shapes: Collision) -> None:
        self.shapes, self.times = shapes, 0

    def __call__(self) -> Array:
        self.times += 1
        return np.concatenate([mesh.vertices for mesh in shape_meshes(self.shapes)])

    def kept(self, what: str = "all") -> Array:
        return kept_points(what, self.shapes, self)


def box_file(path: Path, half: float = 0.1) -> Path:
    write_obj(primitives.box(half, half, half), path)
    return path


def shape(path: Path, scale: tuple[float, float, float] = (1.0, 1.0, 1.0), z: float = 0.0) -> Collision:
    geometry = Mesh(uri=path.name, path=path, scale=scale)
    return Collision(geometry=geometry, origin=Pose(position=(0.0, 0.0, z)))


def test_points_are_made_once(tmp_path: Path) -> None:
    shapes = Counted(shape(box_file(tmp_path / "a.obj")), Collision(geometry=Box(size=(1.0, 1.0, 1.0))))
    first, again = shapes.kept(), shapes.kept()
    assert shapes.times == 1
    np.testing.assert_array_equal(first, again)
    shapes.kept("others")
    assert shapes.times == 2


def test_a_copy_of_the_file_has_the_same_points(tmp_path: Path) -> None:
    Counted(shape(box_file(tmp_path / "a.obj"))).kept()
    copy = Counted(shape(box_file(tmp_path / "folder" / "b.obj")))
    assert np.abs(copy.kept()).max() == pytest.approx(0.1)
    assert copy.times == 0


def test_another_content_scale_or_place_gives_other_points(tmp_path: Path) -> None:
    Counted(shape(box_file(tmp_path / "a.obj"))).kept()
    others = (
        (shape(box_file(tmp_path / "b.obj", 0.2)), 0.2),
        (shape(tmp_path / "a.obj", scale=(1.0, 3.0, 1.0)), 0.3),
        (shape(tmp_path / "a.obj", z=0.4), 0.5),
    )
    for other, most in others:
        counted = Counted(other)
        assert np.abs(counted.kept()).max() == pytest.approx(most)
        assert counted.times == 1


def test_shapes_without_a_mesh_file_are_not_kept(tmp_path: Path) -> None:
    data = Mesh(uri="", path=None, data=primitives.box(0.1, 0.1, 0.1))
    for geometry in (Box(size=(1.0, 1.0, 1.0)), data):
        counted = Counted(Collision(geometry=geometry))
        counted.kept()
        counted.kept()
        assert counted.times == 2
    assert not (tmp_path / "cache" / "points").exists()


def test_files_whose_vertices_are_elsewhere_are_not_kept() -> None:
    assert ".gltf" not in module.WHOLE
