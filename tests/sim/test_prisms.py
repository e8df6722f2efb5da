"""Hulls of prisms, compared with those that qhull finds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from roboyard.pybullet.bullet_rules.models import CYLINDER_SIDES, prism
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build import mesh_assets
from roboyard.sim.build.prisms import prism_faces


def _corners(polygon: np.ndarray, low: float, high: float) -> np.ndarray:
    sides = np.repeat(polygon, 2, axis=0)
    return np.column_stack([sides, np.tile([high, low], len(polygon))])


def _regular(count: int, radius: float) -> np.ndarray:
    angles = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def _volume(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("count", [3, 4, 7, 32, 101])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("upside_down", [False, True])
def test_faces_are_the_hull_and_point_outwards(count: int, turned: bool, upside_down: bool) -> None:
    polygon = _regular(count, 0.2) * [1.0, 1.7] + [0.3, -0.1]
    points = _corners(polygon[::-1] if turned else polygon, *((0.5, -0.1) if upside_down else (-0.1, 0.5)))
    faces = prism_faces(points)
    assert faces is not None and len(faces) == 4 * count - 4
    hull = ConvexHull(points)
    assert _volume(points, faces) == pytest.approx(hull.volume, rel=1e-12)
    assert (np.unique(faces) == np.unique(hull.simplices)).all()
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)  # each edge once in each direction: closed
    assert (np.unique(edges, axis=0) == np.unique(edges[:, ::-1], axis=0)).all()
    assert np.linalg.norm(
        np.cross(*(points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))), axis=1
    ).all()
    middle = points.mean(axis=0)
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    assert (np.einsum("ij,ij->i", normals, points[faces[:, 0]] - middle) > 0.0).all()


@pytest.mark.parametrize(
    "points",
    [
        _corners(_regular(5, 0.2), 0.0, 0.0),
        _corners(_regular(5, 0.2), 0.0, 1e-6),
        _corners(_regular(5, 0.2)[[0, 2, 4, 1, 3]], -0.1, 0.1),  # a star
        _corners(np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.2], [0.0, 1.0]]), -0.1, 0.1),
        _corners(np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0]]), -0.1, 0.1),  # three in a line
        _corners(np.zeros((4, 2)), -0.1, 0.1),
        _corners(_regular(5, 0.2), -0.1, 0.1)[:-1],
        _corners(_regular(2, 0.2), -0.1, 0.1),
        _corners(_regular(5, 0.2), -0.1, 0.1) + np.linspace(0.0, 0.1, 30).reshape(10, 3),
        _corners(_regular(5, 0.2), -0.1, 0.1)[::-1][[1, 0, 2, 3, 4, 5, 6, 7, 8, 9]],
        np.full((8, 3), np.nan),
    ],
)
def test_other_points_are_left_to_qhull(points: np.ndarray) -> None:
    assert prism_faces(points) is None


@pytest.mark.parametrize(("radius", "length"), [(0.05, 0.3), (0.3, 0.02), (1.0, 0.1), (0.013, 2.0)])
@pytest.mark.parametrize("steps", [0, 10216])
def test_cylinders_of_files_have_the_corners_that_a_search_finds(
    monkeypatch: pytest.MonkeyPatch, radius: float, length: float, steps: int
) -> None:
    """With steps, corners are rounded as Bullet rounds them."""
    mesh = prism(radius, length).data
    assert isinstance(mesh, TriangleMesh)
    monkeypatch.setattr(mesh_assets, "_HULLS", {})
    monkeypatch.setattr(mesh_assets, "load_hull", lambda key: pytest.fail("no hull is looked for"))
    points, faces = mesh_assets.convex_hull(mesh, steps, single=False)
    corners = mesh.vertices if steps else mesh.vertices.astype(np.float32).astype(float)
    searched, others = mesh_assets._hull(mesh_assets.rounded(corners, steps) if steps else corners)
    np.testing.assert_array_equal(np.unique(points, axis=0), np.unique(searched, axis=0))
    assert _volume(points, faces) == pytest.approx(_volume(searched, others), rel=1e-12)


@pytest.mark.parametrize(("radius", "length"), [(0.05, 0.3), (0.013, 2.0), (1.7, 1e-3)])
def test_corners_of_cylinders_are_those_of_single_products(radius: float, length: float) -> None:
    mesh = prism(radius, length).data
    assert isinstance(mesh, TriangleMesh)
    angles = [2.0 * math.pi * (k / CYLINDER_SIDES) for k in range(CYLINDER_SIDES)]
    corners = [
        (radius * math.sin(angle), radius * math.cos(angle), z)
        for angle in angles
        for z in (length / 2, -length / 2)
    ]
    assert mesh.vertices.tobytes() == np.array(corners).tobytes()
    assert not mesh.vertices.flags.writeable


def test_faces_of_one_prism_are_not_those_of_another() -> None:
    points = np.array([(x, y, z) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)) for z in (0.5, 0.0)])
    one, other = prism_faces(points), prism_faces(2.0 * points)
    assert one is not None
    assert other is not None
    one[:] = 0
    assert other.any()
