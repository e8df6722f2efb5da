"""Convex hulls on disk: the same numbers come back, and a damaged file counts as absent."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build import hull_store, mesh_assets
from roboyard.sim.build.hull_store import load_group, load_hull, store_group, store_hull

KEY = bytes(range(16))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keep hulls in a folder of the test."""
    monkeypatch.setattr(hull_store, "_folder", lambda: tmp_path / "hulls")
    return tmp_path / "hulls"


def test_a_hull_comes_back_as_it_was() -> None:
    rng = np.random.default_rng(0)
    vertices, faces = rng.normal(size=(40, 3)), rng.integers(0, 40, (70, 3)).astype(np.int32)
    assert load_hull(KEY) is None
    store_hull(KEY, vertices, faces)
    found = load_hull(KEY)
    assert found is not None
    np.testing.assert_array_equal(found[0], vertices)
    np.testing.assert_array_equal(found[1], faces)
    found[0][0] = 7.0  # a copy that may be changed
    assert load_hull(KEY)[0][0, 0] == vertices[0, 0]  # type: ignore[index]


@pytest.mark.parametrize("damage", ["cut", "changed", "empty", "longer"])
def test_a_damaged_file_counts_as_absent(folder: Path, damage: str) -> None:
    store_hull(KEY, np.eye(3), np.array([[0, 1, 2]]))
    (file,) = folder.iterdir()
    content = file.read_bytes()
    changed = bytes([content[20] ^ 1])
    file.write_bytes(
        {
            "cut": content[:-5],
            "changed": content[:20] + changed + content[21:],
            "empty": b"",
            "longer": content + b"x",
        }[damage]
    )
    assert load_hull(KEY) is None


def test_no_place_to_write_keeps_nothing(folder: Path) -> None:
    folder.write_text("a file where the folder should be")
    store_hull(KEY, np.eye(3), np.array([[0, 1, 2]]))
    assert load_hull(KEY) is None


def test_large_hulls_are_not_kept() -> None:
    store_hull(KEY, np.zeros((hull_store.MOST_VERTICES + 1, 3)), np.zeros((1, 3), dtype=np.int32))
    assert load_hull(KEY) is None


def test_the_oldest_hulls_go_where_there_are_many(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hull_store, "MOST_FILES", 8)
    scans = list[Path]()

    def scandir(path: Path) -> Iterator[os.DirEntry[str]]:
        scans.append(path)
        return scanned(path)

    scanned = os.scandir
    monkeypatch.setattr(os, "scandir", scandir)
    keys = [bytes([k]) * 16 for k in range(20)]
    for age, key in enumerate(keys):
        store_hull(key, np.eye(3), np.array([[0, 1, 2]]))
        os.utime(folder / f"{key.hex()}.hull", ns=(age, age))
    there = [load_hull(key) is not None for key in keys]
    assert 6 <= sum(there) <= 8
    assert there == sorted(there), "the last ones"
    assert 1 <= scans.count(folder) <= 8, "not by each hull"


def test_a_mesh_has_the_same_hull_from_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = primitives.sphere(0.3)
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    first = mesh_assets.convex_hull(mesh)
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    monkeypatch.setattr(mesh_assets, "_hull", lambda points: pytest.fail("the hull was computed again"))
    second = mesh_assets.convex_hull(mesh)
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


def _some_meshes(count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(count)
    sizes = [(4 + k, 6 + 2 * k) for k in range(count)]
    return [(rng.normal(size=(n, 3)), rng.integers(0, n, (m, 3)).astype(np.int32)) for n, m in sizes]


@pytest.mark.parametrize("count", [0, 1, 7])
def test_meshes_kept_together_come_back_as_they_were(count: int) -> None:
    meshes = _some_meshes(count)
    assert load_group(KEY) is None
    store_group(KEY, meshes)
    found = load_group(KEY)
    assert found is not None
    assert len(found) == count
    for (vertices, faces), (others, triangles) in zip(meshes, found, strict=True):
        np.testing.assert_array_equal(vertices, others)
        np.testing.assert_array_equal(faces, triangles)
        assert (others.dtype, triangles.dtype) == (np.float64, np.int32)


@pytest.mark.parametrize("length", [0, 10, 40, 100, -1])
def test_damaged_meshes_count_as_absent(folder: Path, length: int) -> None:
    store_group(KEY, _some_meshes(3))
    (file,) = folder.iterdir()
    content = file.read_bytes()
    file.write_bytes(content[:length] if length >= 0 else content + b"x")
    assert load_group(KEY) is None


def test_large_meshes_are_not_kept_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hull_store, "MOST_GROUP_BYTES", 300)
    store_group(KEY, _some_meshes(3))
    assert load_group(KEY) is None


def test_hulls_built_together_come_from_one_file(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    meshes = [(primitives.sphere(0.1 + 0.1 * k), True) for k in range(3)]
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    group = mesh_assets.HullGroup(meshes, 0)
    first = [mesh_assets.convex_hull(mesh) for mesh, _ in meshes]
    group.store()
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    monkeypatch.setattr(mesh_assets, "load_hull", lambda key: pytest.fail("another file was opened"))
    mesh_assets.HullGroup(meshes, 0)
    for (mesh, _), hull in zip(meshes, first, strict=True):
        for array, other in zip(hull, mesh_assets.convex_hull(mesh), strict=True):
            np.testing.assert_array_equal(array, other)
    assert sum(file.suffix == ".meshes" for file in folder.iterdir()) == 1


def test_hulls_are_kept_together_only_once_all_are_there(
    monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    meshes = [(primitives.sphere(0.1 + 0.1 * k), True) for k in range(2)]
    group = mesh_assets.HullGroup(meshes, 0)
    mesh_assets.convex_hull(meshes[0][0])
    group.store()
    assert not list(folder.glob("*.meshes"))


def test_prisms_are_not_kept(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """They are found faster than a file is read, and programs make others each time."""
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    points = np.array([(x, y, z) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)) for z in (0.0, 0.5)])
    meshes = [
        (TriangleMesh(vertices=points * k, faces=(np.arange(24, dtype=np.int32) % 8).reshape(8, 3)), True)
        for k in (1, 2)
    ]
    group = mesh_assets.HullGroup(meshes, 0)
    for mesh, _ in meshes:
        mesh_assets.convex_hull(mesh)
    group.store()
    assert not folder.exists()
