"""The compiled loops of shapes against NumPy, SciPy and trimesh."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.cluster.vq import kmeans2
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt
from scipy.spatial import ConvexHull
from scipy.spatial.distance import cdist

from roboyard.shapes import primitives, sampling
from roboyard.shapes.convex.box_splitter import clip_triangles, slice_extremes
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.shapes.readers.texture_atlas import pack_textures
from roboyard.shapes.simplify import clustered
from roboyard.shapes.spheres import kernels as spheres
from roboyard.shapes.spheres.growth import grow_to_cover, grow_to_enclose
from roboyard.shapes.voxels import kernels as voxels


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def corners_of(mesh: TriangleMesh) -> np.ndarray:
    """(m, 3, 3) triangles of a mesh."""
    return np.ascontiguousarray(mesh.vertices[mesh.faces])


def gaps(points: np.ndarray, centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """(p,) signed distance of points to the union of spheres, for points outside it."""
    return (cdist(points, centers) - radii).min(axis=1)


# ----------------------------------------------------------------------------------------------- spheres


def test_the_nearest_sphere_is_that_of_the_distance_matrix(rng: np.random.Generator) -> None:
    points = rng.normal(size=(300, 3)).astype(np.float32)
    centers, radii = rng.normal(size=(7, 3)), rng.uniform(0.1, 0.6, 7)
    index, gap = np.zeros(300, np.int32), np.zeros(300, np.float32)
    x = np.column_stack([centers, radii]).ravel()
    spheres.nearest_sphere(*(np.ascontiguousarray(points[:, k]) for k in range(3)), x, index, gap)
    distance = cdist(points.astype(float), centers) - radii
    np.testing.assert_allclose(gap, distance.min(axis=1), atol=2e-6)
    clear = np.diff(np.partition(distance, 1, axis=1)[:, :2], axis=1)[:, 0] > 1e-5
    np.testing.assert_array_equal(index[clear], distance.argmin(axis=1)[clear])


def test_seeds_are_farther_apart_than_points_drawn_at_random(rng: np.random.Generator) -> None:
    points, centers = rng.random((500, 3)), np.empty((8, 3))
    spheres.spread_seeds(points, centers)
    apart = cdist(centers, centers) + 9 * np.eye(8)
    drawn = points[rng.choice(500, 8, replace=False)]
    assert apart.min() > 2 * (cdist(drawn, drawn) + 9 * np.eye(8)).min()
    assert all((points == center).all(axis=1).any() for center in centers)


def test_clusters_are_those_of_lloyds_iteration(rng: np.random.Generator) -> None:
    points = np.concatenate([rng.normal(at, 0.1, (60, 3)) for at in ((0, 0, 0), (2, 0, 0), (0, 2, 1))])
    start = points[[0, 60, 120]].copy()
    centers, label, spread = start.copy(), np.zeros(180, np.int32), np.zeros(3)
    spheres.cluster(points, centers, 10, label, spread)
    expected, groups = kmeans2(points, start, iter=10, minit="matrix")
    np.testing.assert_allclose(centers, expected, atol=1e-9)
    np.testing.assert_array_equal(label, groups)
    for k in range(3):
        own = points[groups == k]
        assert spread[k] == pytest.approx(np.sqrt(((own - expected[k]) ** 2).sum(axis=1).mean()), rel=1e-9)


@pytest.mark.parametrize("slack", [0.0, 0.05])
def test_grown_spheres_cover_all_points(rng: np.random.Generator, slack: float) -> None:
    points, centers = rng.normal(size=(400, 3)), rng.normal(size=(6, 3))
    radii = rng.uniform(0.1, 0.3, 6)
    before = radii.copy()
    grow_to_cover(points, centers, radii, slack)
    assert np.all(radii >= before)
    assert gaps(points, centers, radii).max() <= slack + 1e-8


def test_spheres_that_cover_already_do_not_grow(rng: np.random.Generator) -> None:
    points, centers, radii = rng.uniform(-0.1, 0.1, (50, 3)), np.zeros((1, 3)), np.array([1.0])
    grow_to_cover(points, centers, radii, 0.0)
    assert radii[0] == 1.0


def test_grown_spheres_enclose_whole_triangles(rng: np.random.Generator) -> None:
    box = primitives.box(0.5, 0.3, 0.2)
    centers, radii = rng.uniform(-0.3, 0.3, (5, 3)), np.full(5, 0.1)
    grow_to_enclose(corners_of(box), centers, radii, 0.02, 0.005)
    surface = sampling.surface_points(box, 4000, rng)
    assert gaps(surface, centers, radii).max() <= 0.02 + 1e-6


# ------------------------------------------------------------------------------------------------ voxels


def test_sampled_values_are_scipys_trilinear_interpolation(rng: np.random.Generator) -> None:
    field = rng.normal(size=(6, 7, 5))
    points = rng.uniform(0.6, [5.4, 6.4, 4.4], (200, 3))  # inside the outermost voxel centres
    axes = [np.arange(n) + 0.5 for n in field.shape]
    expected = RegularGridInterpolator(axes, field)(points)
    np.testing.assert_allclose(voxels.sample_many(field, points), expected, atol=1e-5)


def test_outside_the_grid_the_value_grows_by_the_distance(rng: np.random.Generator) -> None:
    field = np.full((4, 4, 4), 0.25)
    points = np.array([[-2.5, 2.0, 2.0], [2.0, 2.0, 9.5], [-1.5, -1.5, 2.0]])
    expected = 0.25 + np.array([3.0, 6.0, np.hypot(2.0, 2.0)])
    np.testing.assert_allclose(voxels.sample_many(field, points), expected, atol=1e-5)


@pytest.mark.parametrize("shape", [(9, 8, 7), (1, 12, 3), (15, 1, 1)])
def test_the_nearest_seed_is_as_far_as_scipys_distance_transform(rng: np.random.Generator, shape) -> None:
    seeds = rng.random(shape) < 0.1
    seeds.flat[0] = True
    label = voxels.nearest_seed(seeds)
    at = np.stack(np.unravel_index(label.ravel(), shape), axis=1)
    here = np.stack(np.unravel_index(np.arange(label.size), shape), axis=1)
    assert seeds.ravel()[label.ravel()].all()
    found = np.linalg.norm(at - here, axis=1)
    np.testing.assert_allclose(found, distance_transform_edt(~seeds).ravel(), atol=1e-9)


def test_no_seed_gives_no_label() -> None:
    np.testing.assert_array_equal(voxels.nearest_seed(np.zeros((3, 4, 5), bool)), -1)


def test_marked_voxels_hold_points_of_the_surface() -> None:
    ball = primitives.sphere(3.0)
    vertices = ball.vertices + 5.0
    best, point = np.full((10, 10, 10), np.inf), np.zeros((10, 10, 10, 3))
    voxels.mark_surface(vertices, ball.faces.astype(np.int64), best, point)
    marked = np.isfinite(best)
    centers = np.stack(np.nonzero(marked), axis=1) + 0.5
    radius = np.linalg.norm(centers - 5.0, axis=1)
    assert marked.sum() > 60 and np.all(np.abs(radius - 3.0) < 0.9)
    np.testing.assert_allclose(np.linalg.norm(point[marked] - 5.0, axis=1), 3.0, atol=0.08)


# -------------------------------------------------------------------------------------------- splitting


def test_clipped_triangles_have_the_area_inside_the_box(rng: np.random.Generator) -> None:
    """Two triangles of a large square over a box: the clipped polygon is the box's cross-section."""
    square = np.array([[-5, -5, 0.2], [5, -5, 0.2], [5, 5, 0.2], [-5, 5, 0.2]], dtype=float)
    corners = square[np.array([[0, 1, 2], [0, 2, 3]])]
    lower, upper = np.array([-1.0, -2.0, 0.0]), np.array([2.0, 1.0, 1.0])
    found = clip_triangles(corners, lower, upper)
    assert np.all(found >= lower - 1e-12) and np.all(found <= upper + 1e-12)
    assert ConvexHull(found[:, :2]).volume == pytest.approx(9.0)


def test_triangles_outside_vanish_and_inside_stay(rng: np.random.Generator) -> None:
    inside, outside = rng.uniform(0.1, 0.9, (4, 3, 3)), rng.uniform(2.0, 3.0, (4, 3, 3))
    found = clip_triangles(np.concatenate([inside, outside]), np.zeros(3), np.ones(3))
    np.testing.assert_allclose(found, inside.reshape(-1, 3))


def test_many_triangles_enlarge_the_output(rng: np.random.Generator) -> None:
    inside = rng.uniform(0.0, 1.0, (500, 3, 3))
    assert clip_triangles(inside, np.zeros(3), np.ones(3)).shape == (1500, 3)


def test_slice_extremes_are_the_running_maxima(rng: np.random.Generator) -> None:
    reach, index = rng.normal(size=(80, 5)), rng.integers(0, 6, 80)
    index[:6] = np.arange(6)  # every slice has a point
    below, above = slice_extremes(reach, index, 6)
    for k in range(6):
        for rows, found in ((index <= k, below[k]), (index >= k, above[k])):
            best = np.where(rows[:, None], reach, -np.inf).argmax(axis=0)
            np.testing.assert_array_equal(found, best)


# ---------------------------------------------------------------------------- sampling, textures, simplifying


def test_surface_samples_are_on_the_surface_and_even(rng: np.random.Generator) -> None:
    half = np.array([0.5, 0.3, 0.2])
    points = sampling.surface_points(primitives.box(*half), 6000, rng)
    side = np.isclose(np.abs(points), half, atol=1e-9)
    assert side.any(axis=1).all()
    areas = np.array([half[1] * half[2], half[0] * half[2], half[0] * half[1]])
    np.testing.assert_allclose(side.mean(axis=0), areas / areas.sum(), atol=0.03)


def test_fibonacci_directions_are_unit_and_balanced() -> None:
    directions = sampling.fibonacci_sphere(400)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=3e-3)
    np.testing.assert_allclose(directions.T @ directions / 400, np.eye(3) / 3, atol=3e-3)


def test_box_points_fill_every_octant_alike() -> None:
    points = sampling.box_points(np.zeros(3), np.array([2.0, 4.0, 6.0]), 4096)
    octant = (points > [1, 2, 3]) @ [1, 2, 4]
    np.testing.assert_allclose(np.bincount(octant, minlength=8) / 4096, 1 / 8, atol=0.01)


def test_packed_textures_keep_every_pixel_under_its_coordinates(rng: np.random.Generator) -> None:
    images = [rng.integers(0, 255, (h, w, 4), dtype=np.uint8) for h, w in ((3, 5), (8, 2), (1, 1))]
    packed, places = pack_textures(images)
    height, width = packed.shape[:2]
    for number, image in enumerate(images):
        rows, columns = image.shape[:2]
        for r, c in ((0, 0), (rows - 1, columns - 1), (rows // 2, columns // 2)):
            own = np.array([[c / max(columns - 1, 1), 1 - r / max(rows - 1, 1)]])
            u, v = places.map(number, own)[0]
            np.testing.assert_array_equal(packed[int((1 - v) * height), int(u * width)], image[r, c])
    u, v = places.blank
    np.testing.assert_array_equal(packed[int((1 - v) * height), int(u * width)], 255)


@pytest.mark.parametrize("cells", [8, 32])
def test_simplified_meshes_stay_within_a_cell_of_the_original(cells: int) -> None:
    ball = trimesh.creation.icosphere(4, 1.0)
    mesh = TriangleMesh(vertices=read_only(ball.vertices, np.float64), faces=read_only(ball.faces, np.int32))
    small = clustered(mesh, cells)
    assert len(small.faces) < len(mesh.faces)
    off = np.abs(np.linalg.norm(small.vertices, axis=1) - 1.0)
    assert off.max() < np.sqrt(3) * 2.0 / cells
