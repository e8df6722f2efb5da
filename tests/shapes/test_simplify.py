"""Coarser copies of dense meshes."""

from __future__ import annotations

import numpy as np

from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.simplify import DENSE, clustered, for_small_pictures


def globe(rings: int, radius: float = 0.5) -> TriangleMesh:
    """A sphere of 4 rings² quads, every face a colour of its own."""
    polar, turn = np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2 * np.pi, 4 * rings, endpoint=False)
    p, t = (grid.ravel() for grid in np.meshgrid(polar, turn, indexing="ij"))
    vertices = radius * np.stack([np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)], axis=1)
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(rings), np.arange(4 * rings), indexing="ij"))
    a, b = 4 * rings * i + j, 4 * rings * i + (j + 1) % (4 * rings)
    c, d = a + 4 * rings, b + 4 * rings
    faces = np.concatenate([np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)])
    colors = np.arange(4 * len(faces), dtype=np.int64).reshape(-1, 4) % 251
    return TriangleMesh(
        vertices=read_only(vertices, np.float64),
        faces=read_only(faces, np.int32),
        colors=read_only(colors, np.uint8),
    )


def volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_simplified_meshes_keep_their_form_with_fewer_faces() -> None:
    dense = globe(120)
    coarse = clustered(dense, 40)
    assert len(coarse.faces) < 0.2 * len(dense.faces)
    assert np.abs(np.linalg.norm(coarse.vertices, axis=1) - 0.5).max() < np.sqrt(3) / 40
    assert abs(volume(coarse) / (4 / 3 * np.pi * 0.5**3) - 1.0) < 0.01
    assert np.allclose(coarse.bounds, dense.bounds, atol=1 / 40)


def test_every_face_keeps_a_colour_of_the_merged_faces() -> None:
    dense = globe(60)
    coarse = clustered(dense, 30)
    assert dense.colors is not None and coarse.colors is not None
    assert len(coarse.colors) == len(coarse.faces)
    assert {tuple(color) for color in coarse.colors} <= {tuple(color) for color in dense.colors}


def test_the_sides_of_a_thin_sheet_both_stay_and_seams_of_a_texture_do_not_close() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    vertices = read_only(np.concatenate([corners, corners + np.array([0, 0, 1e-4])]), np.float64)
    sheet = TriangleMesh(
        vertices=vertices, faces=read_only(np.array([[0, 2, 1], [3, 4, 5], [3, 4, 5]]), np.int32)
    )
    assert len(clustered(sheet, 100).vertices) == 3 and len(clustered(sheet, 100).faces) == 2
    uv = read_only(np.repeat(np.array([[0.0, 0.0], [0.9, 0.9]]), 3, axis=0), np.float64)
    seamed = TriangleMesh(vertices=vertices, faces=sheet.faces, uv=uv)
    assert len(clustered(seamed, 100).vertices) == 6


def test_small_meshes_are_unchanged_and_dense_ones_cached() -> None:
    box, dense = primitives.box(1.0, 1.0, 1.0), globe(120)
    assert for_small_pictures(box) is box
    assert len(dense.faces) > DENSE and for_small_pictures(dense) is for_small_pictures(dense)
