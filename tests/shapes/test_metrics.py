"""Sphere metrics against closed forms."""

import numpy as np
import pytest
import trimesh

from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import box_points, fibonacci_sphere, surface_points
from roboyard.shapes.spheres.metrics import contains, gap_to_spheres, measure_spheres, winding_numbers


def mesh_of(shape: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(
        vertices=np.array(shape.vertices, dtype=np.float64), faces=np.array(shape.faces, dtype=np.int32)
    )


def test_winding_number_is_one_inside_and_zero_outside():
    torus = trimesh.creation.torus(0.3, 0.1)
    points = np.random.default_rng(0).uniform(*torus.bounds, (300, 3))
    winding = winding_numbers(torus.vertices.view(np.ndarray), torus.faces.astype(np.int32), points)
    assert np.abs(winding - np.rint(winding)).max() < 1e-9
    assert (np.rint(winding) == 1).tolist() == torus.contains(points).tolist()


def test_contains_ignores_how_meshes_are_wound():
    a, b = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1))
    b.apply_translation((0.5, 0, 0))
    b.invert()
    at = np.array([[0.25, 0, 0], [0.9, 0, 0], [-0.4, 0, 0], [1.1, 0, 0]])
    assert contains([mesh_of(a), mesh_of(b)], at).tolist() == [True, True, True, False]


def test_sphere_by_a_smaller_and_a_larger_sphere():
    ball = mesh_of(trimesh.creation.icosphere(3, 0.1))
    small = measure_spheres(ball, [[0, 0, 0]], [0.08], samples=2000)
    assert small.coverage == pytest.approx(0.8**3, abs=0.04)
    assert small.max_gap_mm == pytest.approx(20, abs=0.5)
    assert (small.protrusion, small.excess, small.surface_coverage) == (0, 0, 0)
    large = measure_spheres(ball, [[0, 0, 0]], [0.12], samples=2000)
    assert (large.coverage, large.surface_coverage, large.max_gap_mm, large.protrusion) == (1, 1, 0, 1)
    assert large.excess == pytest.approx(1.2**3 - 1, rel=0.08)
    assert large.mean_protrusion_mm == pytest.approx(20, rel=0.03)


def test_half_of_a_sphere_protrudes_from_a_face():
    box = mesh_of(trimesh.creation.box((1, 1, 1)))
    got = measure_spheres(box, [[0.5, 0, 0]], [0.2])
    assert got.protrusion == pytest.approx(0.5, abs=0.02)
    assert got.excess == pytest.approx(2 / 3 * np.pi * 0.2**3, rel=0.1)


def test_samplers_are_even():
    box = mesh_of(trimesh.creation.box((1, 2, 3)))
    skin = surface_points(box, 20_000, np.random.default_rng(0))
    on_x = (np.abs(np.abs(skin[:, 0]) - 0.5) < 1e-9).mean()
    assert on_x == pytest.approx(12 / 22, abs=0.02)
    assert np.abs(fibonacci_sphere(500).mean(axis=0)).max() < 0.01
    points = box_points(np.array([0.0, 1, 2]), np.array([1.0, 3, 5]), 4000)
    assert points.mean(axis=0) == pytest.approx([0.5, 2, 3.5], abs=0.01)


def test_gap_is_the_signed_distance_to_the_nearest_surface():
    gap = gap_to_spheres([[0, 0, 0], [3, 0, 0], [1.5, 0, 0]], [[0, 0, 0], [2, 0, 0]], [1, 0.25])
    assert gap == pytest.approx([-1, 0.75, 0.25])
