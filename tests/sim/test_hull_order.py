"""The corners of convex hulls come in Bullet's order, recorded with `getMeshData` of PyBullet 3.2.7."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from roboyard.pybullet.bullet_rules.models import prism
from roboyard.shapes.load import scaled
from roboyard.shapes.mesh import TriangleMesh
from roboyard.sim.build import hull_order, mesh_assets
from roboyard.sim.build.hull_kernels import compare
from roboyard.sim.build.hull_order import ordered_hull
from roboyard.sim.physics_profile import BULLET

STEPS = BULLET.hull_steps
BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 0.01
ANGLE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 3], [0, 3]]) * 0.02
RECORDED = {
    "box": [7, 6, 3, 5, 4, 2, 1, 0],
    "cube": [7, 6, 3, 5, 4, 2, 1, 0],
    "repeated cube": [14, 13, 5, 12, 7, 4, 1, 0],
    "prism": [8, 7, 1, 9, 0, 13, 2, 10, 6, 12, 3, 11, 5, 4],
    "other polygons": [1, 0, 2, 6, 5, 4, 7, 3, 8],
    "tall": [6, 11, 0, 7, 10, 5, 1, 8, 9, 4, 2, 3],
    "cone": [5, 6, 9, 4, 7, 8, 0, 1, 2, 3],
    "lattice": [26, 20, 24, 8, 18, 2, 6, 0],
    "angle": [0, 1, 6, 5, 7, 2, 11, 4, 8, 10],
    "scattered": [10, 15, 3, 4, 21, 32, 36, 29, 22, 11, 7, 6, 2, 20, 28, 38, 27, 16, 13],
    "scattered twice": [10, 15, 3, 4, 21, 8, 22, 29, 7, 11, 6, 2, 20, 24, 27, 28, 16, 5],
}
"""Points of `_points` to the places of the corners among them."""


def _polygon(count: int, radius: float, z: float, turn: float = 0.0) -> np.ndarray:
    angles = 2.0 * np.pi * np.arange(count) / count + turn
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(count, z)])


def _scattered(count: int) -> np.ndarray:
    k = np.arange(1, count + 1)[:, None]
    return (k * np.array([0.7548776662, 0.5698402910, 0.8191725134])) % 1.0 * [0.1, 0.05, 0.08]


def _points(name: str) -> np.ndarray:
    match name:
        case "box":
            return BOX * [3.0, 2.0, 1.0]
        case "cube":
            return BOX
        case "repeated cube":
            return np.repeat(BOX, [1, 3, 1, 2, 5, 1, 1, 4], axis=0)
        case "prism":
            return np.concatenate([_polygon(7, 0.05, -0.02, 0.3), _polygon(7, 0.05, 0.02, 0.3)])
        case "other polygons":
            return np.concatenate([_polygon(5, 0.05, -0.02, 0.3), _polygon(4, 0.03, 0.02)])
        case "tall":
            return np.concatenate([_polygon(6, 0.02, z, 0.1) for z in (-0.1, 0.1)])[:, [2, 0, 1]]
        case "cone":
            return np.concatenate([_polygon(9, 0.05, 0.0), [[0.0, 0.0, 0.06]]])
        case "lattice":
            steps = np.arange(3)
            return 0.01 * np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), -1).reshape(-1, 3)
        case "angle":
            return np.concatenate([np.column_stack([ANGLE, np.full(6, z)]) for z in (0.0, 0.02)])
        case "scattered":
            return _scattered(40)
        case _:
            return np.concatenate([_scattered(30), _scattered(12), _scattered(5)])


def _volume(corners: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (corners[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("name", RECORDED)
@pytest.mark.parametrize("scale", [1.0, 17.0])
def test_corners_are_in_bullets_order(name: str, scale: float) -> None:
    points = scale * _points(name)
    found = ordered_hull(points, STEPS)
    step = scale * np.ptp(points, axis=0).max() / STEPS
    np.testing.assert_allclose(found[0], points[RECORDED[name]], rtol=0.0, atol=step)
    again = ordered_hull(points[::-1], STEPS)  # the points' own order does not count
    np.testing.assert_array_equal(again[0], found[0])


@pytest.mark.parametrize("count", [5, 12, 60, 700])
def test_faces_are_the_hull_and_point_outwards(count: int) -> None:
    points = np.random.default_rng(count).normal(size=(count, 3))
    points[: count // 3] = np.round(points[: count // 3])  # some of them in planes
    corners, faces, fullness = ordered_hull(points, STEPS)
    assert fullness == pytest.approx(_volume(corners, faces) / np.ptp(points, axis=0).max() ** 3, rel=1e-9)
    assert _volume(corners, faces) == pytest.approx(ConvexHull(corners).volume, rel=1e-12)
    assert (np.unique(faces) == np.arange(len(corners))).all()
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert (np.unique(edges, axis=0) == np.unique(edges[:, ::-1], axis=0)).all()


@pytest.mark.parametrize("points", [_polygon(6, 0.05, 0.1), BOX[:2], np.zeros((5, 3)), BOX[[0, 1, 2]]])
def test_flat_points_have_no_hull(points: np.ndarray) -> None:
    assert ordered_hull(points, STEPS)[2] == 0.0


def test_flat_meshes_get_a_thickness() -> None:
    corners, faces = mesh_assets.convex_hull(
        TriangleMesh(vertices=_polygon(3, 0.05, 0.1), faces=np.array([[0, 1, 2]], np.int32)), STEPS
    )
    assert np.ptp(corners[:, 2]) == pytest.approx(1e-3)
    assert _volume(corners, faces) > 0.0


def test_each_triangle_of_a_mesh_gives_its_corners() -> None:
    """The order depends on how often a corner is given, not on where the file has it."""
    points = _points("other polygons")
    faces = ConvexHull(points).simplices.astype(np.int32)
    more = np.concatenate([faces, faces[:4], faces[:2]])
    expected = ordered_hull(points[more.ravel()], STEPS)
    found, _ = mesh_assets.convex_hull(TriangleMesh(vertices=points, faces=more), STEPS, single=False)
    np.testing.assert_array_equal(found, expected[0])
    turned = TriangleMesh(vertices=points[::-1], faces=len(points) - 1 - more[::-1])
    np.testing.assert_array_equal(mesh_assets.convex_hull(turned, STEPS, single=False)[0], expected[0])


def test_points_that_a_mesh_is_the_hull_of_count_once() -> None:
    """They are not taken for the corners of its triangles, which may be the same ones more often."""
    other = _points("repeated cube")
    mesh = TriangleMesh(vertices=BOX, faces=ConvexHull(BOX).simplices.astype(np.int32))
    found, _ = mesh_assets.convex_hull(mesh, STEPS, single=False)
    assert found is mesh_assets.convex_hull(mesh, STEPS, single=False)[0]
    once = TriangleMesh(vertices=mesh.vertices, faces=mesh.faces, hull_points=mesh.vertices)
    assert mesh_assets.convex_hull(once, STEPS, single=False)[0] is not found
    again = TriangleMesh(vertices=mesh.vertices, faces=mesh.faces, hull_points=other)
    np.testing.assert_array_equal(
        mesh_assets.convex_hull(again, STEPS, single=False)[0], ordered_hull(other, STEPS)[0]
    )
    points = _points("lattice")
    hull = ConvexHull(points).simplices.astype(np.int32)
    mesh = TriangleMesh(vertices=points, faces=np.repeat(hull, 3, axis=0), hull_points=points)
    found, _ = mesh_assets.convex_hull(scaled(mesh, (1.0, 2.0, -1.0)), STEPS, single=False)
    expected = ordered_hull(points * [1.0, 2.0, -1.0], STEPS)
    np.testing.assert_array_equal(found, expected[0])


def test_a_cylinder_of_a_file_begins_where_bullets_does() -> None:
    mesh = prism(0.05, 0.2).data
    assert isinstance(mesh, TriangleMesh)
    corners, _ = mesh_assets.convex_hull(mesh, STEPS, single=False)
    assert len(corners) == 64
    angles = np.degrees(np.arctan2(corners[:10, 0], corners[:10, 1])) % 360.0
    recorded = [90.0, 78.75, 101.25, 90.0, 78.75, 67.51, 112.49, 101.25, 67.51, 56.26]
    np.testing.assert_allclose(angles, recorded, atol=0.006)
    np.testing.assert_array_equal(np.sign(corners[:10, 2]), [1, 1, 1, -1, -1, 1, 1, -1, -1, 1])


def test_more_edges_get_more_room(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = ordered_hull(_scattered(200), STEPS)
    monkeypatch.setattr(hull_order, "_EDGES", 0)
    found = ordered_hull(_scattered(200), STEPS)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ((1, 2), (2, 4), 0),
        ((1, 2), (1, 3), 1),
        ((-1, 2), (-1, 3), -1),
        ((-1, 0), (-5, 0), 0),
        ((-1, 0), (-10, 1), -1),
        ((1, 0), (10, 1), 1),
        ((0, 3), (0, 5), 0),
        ((0, 3), (-1, 5), 1),
        ((10**17 + 1, 10**13), (10**17, 10**13), 1),
        ((10**17, 10**13 + 1), (10**17, 10**13), -1),
        ((3 * 10**16, 3 * 10**12), (10**16, 10**12), 0),
    ],
)
def test_fractions_are_compared_exactly(one: tuple[int, int], other: tuple[int, int], expected: int) -> None:
    assert compare(*one, *other) == expected
    assert compare(*other, *one) == -expected
