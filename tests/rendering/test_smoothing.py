from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from roboyard.rendering.smoothing import (
    CREASE_COSINE,
    closed_faces,
    creased_normals,
    face_forward,
    join_corners,
    number_parts,
)
from roboyard.rendering.textures import lets_light_through, pack
from roboyard.shapes import primitives


def face_normals(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def joined(mesh):
    return join_corners(mesh.vertices, mesh.faces)


def test_join_corners_merges_coincident_vertices_only():
    box = primitives.box()
    vertices, faces = joined(box)
    assert len(vertices) == 8
    assert np.array_equal(vertices[faces], box.vertices[box.faces])


@pytest.mark.parametrize(
    "mesh", [primitives.box(), primitives.sphere(), primitives.cylinder(), primitives.capsule()]
)
def test_solids_are_closed_and_face_outward(mesh):
    vertices, faces = joined(mesh)
    assert closed_faces(vertices, faces).all()
    assert not closed_faces(vertices, faces[:, ::-1]).any()  # inside out
    assert not closed_faces(vertices, faces[1:]).any()  # a hole


@pytest.mark.parametrize("edges", [0, 1, 30, 60, 400])
def test_parts_are_those_of_scipy(edges):
    start, stop = np.random.default_rng(edges).integers(0, 80, (2, edges))
    graph = coo_matrix((np.ones(edges), (start, stop)), shape=(80, 80))
    count, expected = connected_components(graph, directed=False)
    part = np.empty(80, dtype=np.int64)
    assert number_parts(start, stop, part) == count
    np.testing.assert_array_equal(part, expected)


def test_closed_faces_are_found_part_by_part():
    a, b = joined(primitives.box()), joined(primitives.plane())
    vertices = np.concatenate([a[0], b[0] + 5.0])
    faces = np.concatenate([a[1], b[1] + len(a[0])])
    assert closed_faces(vertices, faces).tolist() == [True] * 12 + [False] * 2


@pytest.mark.parametrize("hole", [False, True])
def test_parts_with_a_vertex_of_very_many_edges_are_closed_or_not(hole):
    rim = [(np.cos(a), np.sin(a), 0.0) for a in np.linspace(0, 2 * np.pi, 400, endpoint=False)]
    vertices = np.array([(0, 0, 1), (0, 0, -1), *rim])
    after = np.roll(np.arange(400), -1) + 2
    top = np.column_stack([np.zeros(400, int), np.arange(400) + 2, after])
    bottom = np.column_stack([np.ones(400, int), after, np.arange(400) + 2])
    faces = np.concatenate([top, bottom])[1 if hole else 0 :]
    assert (closed_faces(vertices, faces) == (not hole)).all()


def test_computed_normals_match_a_plain_loop():
    rng = np.random.default_rng(1)
    vertices, faces = joined(primitives.sphere(1.0, 10))
    vertices = vertices + rng.normal(0, 0.08, vertices.shape)
    normals = face_normals(vertices, faces)
    got = creased_normals(vertices, faces)
    for face in range(len(faces)):
        for corner in range(3):
            total = np.zeros(3)
            for other in range(len(faces)):
                for k in range(3):
                    if (
                        faces[other, k] != faces[face, corner]
                        or normals[face] @ normals[other] < CREASE_COSINE
                    ):
                        continue
                    p, a, b = (vertices[faces[other, (k + j) % 3]] for j in range(3))
                    cosine = (a - p) @ (b - p) / np.linalg.norm(a - p) / np.linalg.norm(b - p)
                    total += np.arccos(cosine) * normals[other]
            assert got[face, corner] == pytest.approx(total / np.linalg.norm(total), abs=1e-5)


def test_given_normals_are_turned_to_the_front():
    rng = np.random.default_rng(2)
    vertices, faces = joined(primitives.sphere(1.0, 10))
    given = rng.normal(size=(50, 3))
    places = rng.integers(0, 50, faces.shape)
    out = np.empty((len(faces), 3, 3), dtype=np.float32)
    faces = faces.astype(np.int64)
    assert face_forward(given, places, vertices, faces, out) == 1
    expected = given[places] / np.linalg.norm(given[places], axis=2, keepdims=True)
    side = np.sign(np.einsum("ijk,ik->ij", expected, face_normals(vertices, faces)))
    np.testing.assert_allclose(out, expected * side[..., None], atol=1e-7)
    for wrong in (np.nan, 0.0):
        given[places[3, 1]] = wrong
        assert face_forward(given, places, vertices, faces, out) == 0


def test_a_box_keeps_flat_sides():
    vertices, faces = joined(primitives.box())
    assert np.allclose(creased_normals(vertices, faces), face_normals(vertices, faces)[:, None])


def test_halving_takes_means_and_drops_odd_rims():
    image = np.zeros((3, 2, 4), dtype=np.uint8)
    image[:, :, 0] = [[10, 20], [30, 40], [50, 70]]
    flat, table = pack([image])
    assert flat[6] == 25
    assert table[0, 0].tolist() == [0, 2, 3]
    assert table[0, 1].tolist() == [6, 1, 1]
    assert (table[0, 2:] == table[0, 1]).all()
    assert len(flat) == 7


def test_a_level_is_the_rounded_mean_of_four_pixels() -> None:
    rng = np.random.default_rng(4)
    for height, width in product((1, 2, 3, 8, 17), repeat=2):
        h, w = max(height // 2, 1), max(width // 2, 1)
        bright = np.full((height, width, 4), 255, np.uint8)
        for image in (rng.integers(0, 256, bright.shape).astype(np.uint8), bright):
            rows, columns = (
                np.minimum([2 * np.arange(n), 2 * np.arange(n) + 1], m - 1)
                for n, m in ((h, height), (w, width))
            )
            four = [image[np.ix_(row, column)].astype(int) for row in rows for column in columns]
            other = np.full((2, 2, 4), 7, np.uint8)
            flat, table = pack([other, image])
            start, *size = table[1, min(1, max(height, width) - 1)].tolist()
            assert size == [w, h]
            level = flat[start : start + w * h].view(np.uint8).reshape(h, w, 4)
            np.testing.assert_array_equal(level, (sum(four) + 2) // 4)


def test_only_used_texels_count_as_transparent():
    image = np.full((8, 8, 4), 255, dtype=np.uint8)
    image[:4, :, 3] = 0  # the upper half
    below = np.array([[[0.1, 0.1], [0.9, 0.1], [0.5, 0.4]]])
    assert not lets_light_through(image, below)
    assert lets_light_through(image, below + np.array([0.0, 0.5]))
