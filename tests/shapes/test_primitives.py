from __future__ import annotations

import numpy as np
import pytest
import trimesh

from roboyard.shapes import primitives


def solid(mesh):
    out = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True, merge_norm=True, merge_tex=True)
    out.merge_vertices(merge_norm=True, merge_tex=True)
    return out


@pytest.mark.parametrize(
    ("mesh", "volume", "extents"),
    [
        (primitives.box(0.1, 0.2, 0.3), 8 * 0.006, (0.2, 0.4, 0.6)),
        (primitives.sphere(0.4, 128), 4 / 3 * np.pi * 0.4**3, (0.8, 0.8, 0.8)),
        (primitives.cylinder(0.2, 0.7, 128), np.pi * 0.04 * 0.7, (0.4, 0.4, 0.7)),
        (primitives.capsule(0.2, 0.5, 128), np.pi * 0.04 * 0.5 + 4 / 3 * np.pi * 0.008, (0.4, 0.4, 0.9)),
    ],
)
def test_solids_are_closed_and_have_their_volume(mesh, volume, extents):
    body = solid(mesh)
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.volume == pytest.approx(volume, rel=5e-3)
    assert body.extents == pytest.approx(extents, rel=2e-3)


@pytest.mark.parametrize(
    "mesh",
    [primitives.box(), primitives.sphere(), primitives.cylinder(), primitives.capsule(), primitives.plane()],
)
def test_normals_are_unit_and_look_outward(mesh):
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    for k in range(3):
        assert (np.einsum("ij,ij->i", face, mesh.normals[mesh.faces[:, k]]) > 0).all()
    assert mesh.uv.shape == (len(mesh.vertices), 2)


def test_equal_arguments_share_one_mesh_that_cannot_be_written():
    assert primitives.sphere(0.25) is primitives.sphere(0.25)
    with pytest.raises(ValueError, match="read-only"):
        primitives.box().vertices[0, 0] = 3.0


def test_heightfield_positions_match_its_grid():
    heights = np.array([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    mesh = primitives.heightfield(heights, 4.0, 1.0)
    assert mesh.vertices[0].tolist() == [-2.0, -0.5, 0.0]
    assert mesh.vertices[5].tolist() == [2.0, 0.5, 5.0]
    assert len(mesh.faces) == 4
    slope = np.array([-0.5, -3.0, 1.0])
    assert mesh.normals[0] == pytest.approx(slope / np.linalg.norm(slope))
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_invalid_sizes_raise():
    with pytest.raises(ValueError, match="radius must be positive"):
        primitives.sphere(0.0)
    with pytest.raises(ValueError, match="length must be positive"):
        primitives.cylinder(1.0, float("nan"))
    with pytest.raises(ValueError, match="grid"):
        primitives.heightfield([[1.0]], 1.0, 1.0)
