"""Mass properties against trimesh's integration, closed forms and sampled points."""

import math

import numpy as np
import pytest
import trimesh

from roboyard.shapes import inertia
from roboyard.shapes.valid_inertia import rod_inertia, valid_inertia


def of(mesh: trimesh.Trimesh) -> inertia.SolidInertia:
    return inertia.mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


@pytest.mark.parametrize(
    ("exact", "mesh"),
    [
        (inertia.box((0.1, 0.2, 0.3)), trimesh.creation.box((0.1, 0.2, 0.3))),
        (inertia.sphere(0.1), trimesh.creation.icosphere(subdivisions=5, radius=0.1)),
        (inertia.cylinder(0.1, 0.4), trimesh.creation.cylinder(0.1, 0.4, sections=512)),
        (inertia.capsule(0.1, 0.3), trimesh.creation.capsule(0.3, 0.1, count=[256, 256])),
    ],
)
def test_closed_forms_agree_with_fine_meshes(exact: inertia.SolidInertia, mesh: trimesh.Trimesh) -> None:
    fine = of(mesh)
    assert fine.solid == "closed mesh"
    assert fine.mass == pytest.approx(exact.mass, rel=2e-3)
    np.testing.assert_allclose(fine.inertia, exact.inertia, rtol=3e-3, atol=1e-6 * exact.inertia.max())
    np.testing.assert_allclose(fine.center, 0, atol=1e-9)


@pytest.mark.parametrize("flipped", [False, True])
def test_a_displaced_concave_solid_agrees_with_trimesh(flipped: bool) -> None:
    ring = trimesh.creation.annulus(0.1, 0.2, 0.3)
    ring.apply_transform(trimesh.transformations.euler_matrix(0.3, -0.7, 1.1))
    ring.apply_translation((5, -3, 2))
    ring.density = 1000
    faces = ring.faces[:, ::-1] if flipped else ring.faces
    ours = inertia.mesh(np.asarray(ring.vertices), np.asarray(faces))
    assert ours.mass == pytest.approx(ring.mass, rel=1e-9)
    np.testing.assert_allclose(ours.center, ring.center_mass, atol=1e-9)
    np.testing.assert_allclose(ours.inertia, ring.moment_inertia, rtol=1e-6, atol=1e-9)


def test_vertices_split_for_normals_are_one_place() -> None:
    """An STL's corners or an OBJ's split vertices: the surface is closed all the same."""
    box = trimesh.creation.box((1, 1, 1))
    soup = np.asarray(box.triangles).reshape(-1, 3)
    assert inertia.is_closed(soup, np.arange(len(soup)).reshape(-1, 3))


def test_an_open_mesh_is_its_hull_and_a_flat_one_its_box() -> None:
    box = trimesh.creation.box((1, 1, 1))
    opened = inertia.mesh(np.asarray(box.vertices), np.asarray(box.faces)[2:])
    assert (opened.solid, opened.mass) == ("convex hull", pytest.approx(1000))
    flat = inertia.mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)])
    assert (flat.solid, flat.mass) == ("bounding box", pytest.approx(1000 * inertia.THIN))
    assert inertia.is_physical(flat.inertia)


def test_one_face_wound_the_other_way_is_not_closed() -> None:
    box = trimesh.creation.box((1, 1, 1))
    faces = np.asarray(box.faces).copy()
    faces[0] = faces[0][::-1]
    assert not inertia.is_closed(np.asarray(box.vertices), faces)


def test_a_moved_combination_equals_the_whole() -> None:
    """Two halves of a box, turned and joined, are the box."""
    whole = inertia.box((0.4, 0.2, 0.1))
    half = inertia.box((0.2, 0.2, 0.1))
    parts = [half.moved((x, 0, 0), np.eye(3)) for x in (-0.1, 0.1)]
    joined = inertia.combined(parts)
    assert joined.mass == pytest.approx(whole.mass)
    np.testing.assert_allclose(joined.inertia, whole.inertia, atol=1e-12)
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(
        whole.moved((1, 2, 3), turn).inertia, np.diag(np.diag(whole.inertia)[[1, 0, 2]])
    )


def test_scaling_to_a_mass_scales_the_tensor() -> None:
    solid = inertia.sphere(0.1).scaled_to(5.0)
    assert solid.mass == 5.0
    np.testing.assert_allclose(np.diag(solid.inertia), 0.4 * 5.0 * 0.01)


@pytest.mark.parametrize(
    ("tensor", "physical"),
    [
        (np.diag([1, 1, 2]), True),
        (np.diag([1, 1, 2.01]), False),
        (np.diag([1, 1, -0.1]), False),
        (np.zeros((3, 3)), False),
        (np.array([[1, 0.5, 0], [0.5, 1, 0], [0, 0, 1.2]]), True),
    ],
)
def test_physical_inertia_tensors(tensor: np.ndarray, physical: bool) -> None:
    assert inertia.is_physical(tensor) is physical


def test_rod_with_a_moment_rounded_to_zero_keeps_its_large_moments() -> None:
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    rod = rod_inertia(turn @ np.diag([0.0, 2e-4, 2e-4]) @ turn.T)
    assert rod is not None and inertia.is_physical(rod)
    np.testing.assert_allclose(rod, turn @ np.diag([2e-7, 2e-4, 2e-4]) @ turn.T, atol=1e-15)
    for other in ([0, 0, 0], [0, 1, 2], [-1, 1, 1], [1, 1, 1], [0, 0, 1]):
        assert rod_inertia(np.diag(np.array(other, dtype=float))) is None


def test_moments_that_violate_the_triangle_inequality_are_raised_just_enough() -> None:
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    raised = valid_inertia(turn @ np.diag([1.0, 2.0, 5.0]) @ turn.T)
    assert raised is not None and inertia.is_physical(raised, tolerance=0.0)
    np.testing.assert_allclose(raised, turn @ np.diag([2.0, 3.0, 5.0]) @ turn.T, rtol=1e-5, atol=1e-5)
    for other in ([0, 1, 2], [1, 1, 1], [-1, 1, 1]):
        assert valid_inertia(np.diag(np.array(other, dtype=float))) is None


def test_the_hull_is_wound_outwards() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(500, 3)) + 7
    corners, faces = inertia.convex_hull(points)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - points.mean(axis=0))
    assert (outward > 0).all()
    volume, _, _ = inertia.volume_integrals(corners, faces)
    assert volume == pytest.approx(trimesh.convex.convex_hull(points).volume, rel=1e-9)


def test_points_of_a_sphere_have_the_moments_of_a_sphere() -> None:
    """Second moments against plain sampling of the solid."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    inside = np.random.default_rng(0).uniform(-1, 1, size=(400_000, 3))
    inside = inside[np.linalg.norm(inside, axis=1) < 1]
    volume, _, second = inertia.volume_integrals(np.asarray(ball.vertices), np.asarray(ball.faces))
    np.testing.assert_allclose(second, volume * inside.T @ inside / len(inside), atol=0.01 * volume)
    assert volume == pytest.approx(4 / 3 * math.pi, rel=5e-3)


def test_no_vertices_and_no_numbers_are_errors() -> None:
    for vertices in (np.zeros((0, 3)), [(0, 0, math.nan)]):
        with pytest.raises(ValueError, match="finite vertices"):
            inertia.mesh(vertices, np.zeros((0, 3), dtype=int))
    with pytest.raises(ValueError, match="mass of all parts must be above 0"):
        inertia.combined([])
