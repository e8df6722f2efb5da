"""The tree of triangles: complete, with boxes that hold their triangles, and seams known as such."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.triangle_tree import LEAF_SIZE, triangle_tree


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> TriangleMesh:
    return TriangleMesh(vertices=read_only(vertices, np.float64), faces=read_only(faces, np.int32))


@pytest.mark.parametrize("count", [1, 2, 5, 64, 1000])
def test_each_node_holds_all_triangles_below_it(count: int) -> None:
    rng = np.random.default_rng(count)
    corners = rng.normal(size=(count, 1, 3)) + 0.1 * rng.normal(size=(count, 3, 3))
    tree = triangle_tree(_mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)))
    np.testing.assert_array_equal(
        np.sort(tree.corners.reshape(count, -1), axis=0), np.sort(corners.reshape(count, -1), axis=0)
    )
    leaves = len(tree.first) - 1
    assert np.diff(tree.first).max() <= LEAF_SIZE and np.diff(tree.first).min() >= 1
    for leaf in range(leaves):
        inside = tree.corners[tree.first[leaf] : tree.first[leaf + 1]].reshape(-1, 3)
        node = leaves - 1 + leaf
        while True:
            assert (inside >= tree.lower[node]).all() and (inside <= tree.upper[node]).all()
            if node == 0:
                break
            node = (node - 1) // 2


@pytest.mark.parametrize(
    ("degrees", "is_seam"), [(0, True), (20, True), (-20, True), (45, False), (90, False)]
)
@pytest.mark.parametrize("is_turned", [False, True])
def test_edges_with_a_kink_are_no_seams(degrees: float, is_seam: bool, is_turned: bool) -> None:
    """Two triangles on the edge from (0, 0, 0) to (0, 1, 0), one of them turned up; the winding is either."""
    angle = np.deg2rad(degrees)
    vertices = np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0], [np.cos(angle), 0, np.sin(angle)]])
    faces = np.array([[0, 1, 2], [0, 1, 3] if is_turned else [1, 0, 3]])
    tree = triangle_tree(_mesh(vertices, faces))
    assert tree.smooth.sum() == (2 if is_seam else 0)


def test_triangles_without_area_are_omitted() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]])
    assert len(triangle_tree(_mesh(vertices, np.array([[0, 1, 3], [0, 1, 2]])))) == 1
