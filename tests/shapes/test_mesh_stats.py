"""Statistics of mesh files: values, caching by content, and no stale entries."""

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from roboyard.errors import MeshError
from roboyard.shapes.mesh_stats import mesh_stats


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("ROBOYARD_CACHE", str(folder))
    return folder / "mesh-stats"


def write_stl(file: Path, mesh: trimesh.Trimesh) -> Path:
    records = np.zeros(len(mesh.faces), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    records["v"] = mesh.triangles
    file.write_bytes(b" " * 80 + struct.pack("<I", len(records)) + records.tobytes())
    return file


def test_statistics_of_a_concave_closed_mesh(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(0.1, 0.2, 0.3)
    found = mesh_stats(write_stl(tmp_path / "ring.stl", ring))
    assert found.is_closed
    assert not found.is_flat
    assert found.triangles == len(ring.faces)
    assert found.volume == pytest.approx(ring.volume, rel=1e-5)
    assert found.hull_volume == pytest.approx(ring.convex_hull.volume, rel=1e-5)
    np.testing.assert_allclose(found.bounds, ring.bounds, atol=1e-6)
    assert found.solid == "closed mesh"


def test_second_call_uses_the_cache(tmp_path: Path, cache: Path, monkeypatch) -> None:
    file = write_stl(tmp_path / "box.stl", trimesh.creation.box((1, 2, 3)))
    first = mesh_stats(file)
    assert len(list(cache.iterdir())) == 1
    monkeypatch.setattr("roboyard.shapes.load.load_mesh", None)  # would raise
    copy = tmp_path / "other name.stl"
    copy.write_bytes(file.read_bytes())
    second = mesh_stats(copy)
    for name in ("triangles", "volume", "hull_volume", "is_closed", "solid", "mass", "content", "names"):
        assert getattr(first, name) == getattr(second, name)
    for name in ("bounds", "hull", "center", "inertia"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_changed_content_is_read_again(tmp_path: Path) -> None:
    file = write_stl(tmp_path / "box.stl", trimesh.creation.box((1, 2, 3)))
    assert mesh_stats(file).volume == pytest.approx(6)
    write_stl(file, trimesh.creation.box((1, 1, 1)).subdivide())
    assert mesh_stats(file).volume == pytest.approx(1)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 not a zip", None])
def test_damaged_or_unwritable_cache_is_no_error(tmp_path: Path, cache: Path, damage) -> None:
    file = write_stl(tmp_path / "box.stl", trimesh.creation.box((1, 2, 3)))
    if damage is None:
        cache.parent.mkdir(exist_ok=True)
        cache.write_text("a file where the folder should be")
    else:
        mesh_stats(file)
        for kept in cache.iterdir():
            kept.write_bytes(damage)
    assert mesh_stats(file).volume == pytest.approx(6)


def test_scaled_properties_are_those_of_the_scaled_mesh(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(0.1, 0.2, 0.3)
    ring.apply_translation((0.1, 0.2, 0.3))
    found = mesh_stats(write_stl(tmp_path / "ring.stl", ring)).scaled_properties((2.0, -0.5, 3.0))
    ring.apply_scale((2.0, -0.5, 3.0))
    assert found.mass == pytest.approx(abs(ring.volume), rel=1e-5)
    np.testing.assert_allclose(found.center, ring.center_mass, atol=1e-5)
    np.testing.assert_allclose(found.inertia, ring.moment_inertia, rtol=1e-4, atol=1e-7)


def test_invalid_meshes_raise(tmp_path: Path) -> None:
    (tmp_path / "x.step").write_text("ISO")
    (tmp_path / "x.stl").write_text("")
    for name in ("x.step", "x.stl", "gone.stl"):
        with pytest.raises(MeshError, match=name):
            mesh_stats(tmp_path / name)
