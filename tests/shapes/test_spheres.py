"""Sphere fits judged by the exact metrics, on shapes that are hard in different ways."""

import numpy as np
import pytest
import trimesh

from roboyard.errors import ConfigError, MeshError
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.sampling import fibonacci_sphere
from roboyard.shapes.spheres import fit as fit_module
from roboyard.shapes.spheres import kernels
from roboyard.shapes.spheres.fit import PRESETS, SpherePreset, fit_spheres
from roboyard.shapes.spheres.metrics import gap_to_spheres, measure_spheres
from roboyard.shapes.spheres.objective import SphereFitObjective


def mesh_of(shape: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(
        vertices=np.array(shape.vertices, dtype=np.float64), faces=np.array(shape.faces, dtype=np.int32)
    )


def elbow() -> trimesh.Trimesh:
    upright = trimesh.creation.cylinder(0.05, 0.3)
    across = trimesh.creation.cylinder(0.05, 0.25)
    across.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0), (0, 0, 0)))
    across.apply_translation((0.1, 0, 0.1))
    return trimesh.util.concatenate([upright, across])


LINKS = {
    "box": trimesh.creation.box((0.2, 0.12, 0.1)),
    "cylinder": trimesh.creation.cylinder(0.05, 0.3),
    "capsule": trimesh.creation.capsule(radius=0.04, height=0.2),
    "elbow": elbow(),
}


@pytest.mark.parametrize("name", LINKS)
def test_eight_spheres_have_high_coverage_and_little_excess(name):
    mesh = mesh_of(LINKS[name])
    fit = fit_spheres(mesh, 8)
    exact = measure_spheres(mesh, fit.centers, fit.radii, samples=3000)
    assert len(fit.radii) == 8
    assert exact.coverage > 0.96
    assert exact.excess < 0.5
    # what the fit says of itself is what the exact judge finds
    assert fit.coverage == pytest.approx(exact.coverage, abs=0.03)
    assert fit.protrusion == pytest.approx(exact.protrusion, abs=0.05)
    assert fit.excess == pytest.approx(exact.excess, abs=0.05)


@pytest.mark.parametrize("name", LINKS)
def test_safe_leaves_no_surface_point_a_millimetre_outside(name):
    shape = LINKS[name]
    fit = fit_spheres(mesh_of(shape), preset="safe")
    skin, _ = trimesh.sample.sample_surface(shape, 100_000, seed=1)
    assert gap_to_spheres(np.concatenate([skin, shape.vertices]), fit.centers, fit.radii).max() <= 0.001
    assert fit.excess < 0.75


def test_a_number_that_is_too_small_is_given_up_early_without_changing_the_result(monkeypatch):
    """A wide block takes four times the spheres of the first try; tries that went on to the end agree."""
    mesh = mesh_of(trimesh.creation.box((0.8, 0.2, 0.6)))
    descents = []
    descend = SphereFitObjective.descend
    monkeypatch.setattr(SphereFitObjective, "descend", lambda *a: (descents.append(1), descend(*a))[1])
    early, count = fit_spheres(mesh), len(descents)
    whole = fit_module._solve
    monkeypatch.setattr(fit_module, "_solve", lambda *a, unless_crude: whole(*a))
    late = fit_spheres(mesh)
    assert len(early.radii) == len(late.radii) > 80
    np.testing.assert_array_equal(early.centers, late.centers)
    np.testing.assert_array_equal(early.radii, late.radii)
    assert count < len(descents) - count


def test_tight_preset_uses_more_spheres_with_less_excess():
    mesh = mesh_of(elbow())
    balanced, tight = fit_spheres(mesh), fit_spheres(mesh, preset="tight")
    assert len(tight.radii) > len(balanced.radii)
    assert tight.protrusion < 0.8 * balanced.protrusion
    assert tight.coverage > 0.97


def test_more_spheres_fit_closer():
    mesh = mesh_of(elbow())
    excess = [fit_spheres(mesh, n).excess for n in (4, 8, 16, 32)]
    assert excess == sorted(excess, reverse=True)


def test_sphere_mesh_is_one_sphere():
    fit = fit_spheres(mesh_of(trimesh.creation.icosphere(3, 0.07).apply_translation((1, 2, 3))))
    assert fit.centers == pytest.approx(np.array([[1, 2, 3]]), abs=1e-3)
    assert fit.radii == pytest.approx([0.07], rel=0.03)


def test_larger_and_longer_links_get_more_spheres():
    def number(*size: float) -> int:
        return len(fit_spheres(mesh_of(trimesh.creation.box(size))).radii)

    assert number(0.03, 0.03, 0.03) < number(0.1, 0.1, 0.1) < number(0.8, 0.6, 0.3)
    assert number(0.1, 0.1, 0.1) < number(0.05, 0.05, 0.4)


def test_hollow_and_small_parts_use_a_limited_number_of_spheres():
    """A cup of 2 mm walls has hardly any volume, and a finger's 3 mm ribs are negligible."""
    cup = trimesh.creation.annulus(r_min=0.048, r_max=0.05, height=0.1)
    bottom = trimesh.creation.cylinder(0.05, 0.002).apply_translation((0, 0, -0.05))
    fit = fit_spheres(mesh_of(trimesh.util.concatenate([cup, bottom])))
    assert len(fit.radii) <= 80
    assert fit.surface_coverage > 0.95
    frame = [trimesh.creation.box((0.05, 0.003, 0.015)).apply_translation((0, y, 0)) for y in (-0.006, 0.006)]
    finger = fit_spheres(mesh_of(trimesh.util.concatenate(frame)))
    assert len(finger.radii) <= 24
    assert finger.surface_coverage > 0.97


def test_same_input_same_spheres():
    mesh = mesh_of(elbow())
    a, b = fit_spheres(mesh, 6), fit_spheres(mesh, 6)
    assert np.array_equal(a.centers, b.centers)
    assert np.array_equal(a.radii, b.radii)


def test_several_meshes_are_fitted_as_one():
    parts = [trimesh.creation.box((0.1, 0.1, 0.1)) for _ in range(2)]
    parts[1].apply_translation((0.1, 0, 0))
    parts[1].invert()
    fit = fit_spheres([mesh_of(part) for part in parts], 8)
    exact = measure_spheres(
        mesh_of(trimesh.creation.box((0.2, 0.1, 0.1))), fit.centers - [0.05, 0, 0], fit.radii
    )
    assert exact.coverage > 0.95
    assert exact.excess < 0.5


def awkward() -> dict[str, TriangleMesh]:
    def soup(vertices, faces) -> TriangleMesh:
        return TriangleMesh(vertices=np.array(vertices, dtype=float), faces=np.array(faces, dtype=np.int32))

    box = trimesh.creation.box((0.2, 0.1, 0.15))
    open_shell = trimesh.creation.icosphere(3, 0.1)
    open_shell.update_faces(open_shell.triangles_center[:, 2] < 0)
    return {
        "open": mesh_of(open_shell),
        "duplicated": soup(
            np.tile(box.vertices, (3, 1)), np.concatenate([box.faces + 8 * k for k in range(3)])
        ),
        "inside out": soup(box.vertices, box.faces[:, ::-1]),
        "plate": mesh_of(trimesh.creation.box((0.4, 0.3, 0.001))),
        "rod": mesh_of(trimesh.creation.cylinder(0.001, 1.0)),
        "tiny": mesh_of(trimesh.creation.box((2e-5, 1e-5, 1e-5))),
        "huge": mesh_of(trimesh.creation.box((300.0, 20.0, 100.0))),
        "sheet": soup([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]),
        "line": soup([[0, 0, 0], [1, 0, 0], [0.5, 0, 0]], [[0, 1, 2]]),
        "point": soup([[1, 2, 3]] * 3, [[0, 1, 2]]),
        "vertices only": soup(np.random.default_rng(0).random((20, 3)), np.zeros((0, 3))),
        "bad vertices": soup(
            [*box.vertices, [np.nan, 0, 0], [np.inf, 0, 0]], [*box.faces, [0, 1, 8], [2, 9, 3]]
        ),
        "far away": mesh_of(box.copy().apply_translation((1e4, -1e4, 1e4))),
        "apart": mesh_of(trimesh.util.concatenate([box, box.copy().apply_translation((2, 0, 0))])),
    }


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("name", awkward())
def test_awkward_meshes_are_fitted(name, preset):
    mesh = awkward()[name]
    fit = fit_spheres(mesh, preset=preset)
    assert len(fit.radii) == len(fit.centers) >= 1
    assert np.isfinite(fit.centers).all()
    assert np.isfinite(fit.radii).all()
    assert (fit.radii > 0).all()
    used = mesh.vertices[np.unique(mesh.faces)] if len(mesh.faces) else mesh.vertices
    used = used[np.isfinite(used).all(axis=1)]
    extent = float(np.ptp(used, axis=0).max())
    gap = gap_to_spheres(used, fit.centers, fit.radii).max()
    # every corner stays near a sphere, and no sphere is out of proportion
    assert gap <= 0.12 * extent + 1e-3
    assert fit.radii.max() <= max(0.8 * extent, 0.01)
    for count in (1, 3):
        assert len(fit_spheres(mesh, count, preset).radii) == count


def test_own_preset_trades_coverage_for_excess():
    mesh = mesh_of(elbow())

    def own(worth: float) -> SpherePreset:
        return SpherePreset(density=6, worth=worth, coverage=0, surface=0, excess=9)

    lean, full = fit_spheres(mesh, 8, own(1.0)), fit_spheres(mesh, 8, own(10.0))
    assert lean.excess < 0.5 * full.excess
    assert lean.coverage < full.coverage


def test_the_price_of_surface_keeps_it_inside():
    """At equal cover, spheres that pay for what sticks out show less of their surface."""
    mesh = mesh_of(LINKS["cylinder"])

    def own(price: float) -> SpherePreset:
        return SpherePreset(density=6, worth=2.0, coverage=0.95, surface=0, excess=9, price=price)

    free, priced = fit_spheres(mesh, 8, own(0.0)), fit_spheres(mesh, 8, own(1.5))
    assert min(free.coverage, priced.coverage) >= 0.95
    assert priced.protrusion < 0.7 * free.protrusion


def test_large_boxes_are_covered_to_the_corners_without_protrusion():
    for size in ((1.0, 1.0, 1.0), (1.0, 0.6, 0.3), (0.05, 0.05, 0.05)):
        fit = fit_spheres(mesh_of(trimesh.creation.box(size)))
        assert fit.surface_coverage > 0.95, size
        exact = measure_spheres(mesh_of(trimesh.creation.box(size)), fit.centers, fit.radii, samples=2000)
        assert exact.protrusion < 0.25 or max(size) < 0.1


def test_invalid_arguments_raise():
    mesh = mesh_of(LINKS["box"])
    with pytest.raises(ConfigError, match="did you mean 'tight'"):
        fit_spheres(mesh, preset="tigth")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="at least 1"):
        fit_spheres(mesh, 0)
    with pytest.raises(MeshError):
        fit_spheres([])


NO_SURFACE = (np.zeros((2, 2, 2), dtype=np.float32), 1.0, np.zeros((1, 3)), 0.0)
"""Arguments of `descend` that leave the spheres' own surface out of the cost."""


def cost_twin(x, points, weight, tau, tail):
    spheres = x.reshape(-1, 4)
    gap = (np.linalg.norm(points[:, None] - spheres[:, :3], axis=2) - spheres[:, 3]).min(axis=1)
    t = np.where(weight > 0, gap, -gap) / tau
    u = np.clip(0.5 * (t + 1), 0, 1)
    beyond = np.where((weight > 0) & (t > 1), tail * (t - 1), 0)
    return float((np.abs(weight) * (u * u * (3 - 2 * u) + beyond)).sum())


def test_cost_and_gradient_agree_with_numpy_and_finite_differences():
    rng = np.random.default_rng(0)
    points = rng.random((400, 3)).astype(np.float32)
    weight = np.where(rng.random(400) < 0.5, 1.0, -0.3)
    x = rng.uniform(0.2, 0.8, 20)
    x[3::4] = rng.uniform(0.1, 0.3, 5)
    px, py, pz = (np.ascontiguousarray(points[:, k]) for k in range(3))
    index, gap, gradient = np.empty(400, np.int32), np.empty(400, np.float32), np.empty(20)
    got = kernels.volume_cost(x, px, py, pz, weight, 0.1, 0.7, index, gap, gradient)
    assert got == pytest.approx(cost_twin(x, points, weight, 0.1, 0.7), rel=1e-5)
    for k in range(20):
        ahead, behind = x.copy(), x.copy()
        ahead[k] += 1e-6
        behind[k] -= 1e-6
        slope = cost_twin(ahead, points, weight, 0.1, 0.7) - cost_twin(behind, points, weight, 0.1, 0.7)
        assert gradient[k] == pytest.approx(slope / 2e-6, abs=2e-2)


def test_surface_cost_and_gradient_agree_with_a_sphere_and_finite_differences():
    """The solid is a ball, whose distance is known: share outside of a sphere cut by it is a cap's."""
    size, shape = 0.02, 100
    at = (np.indices((shape,) * 3).transpose(1, 2, 3, 0) + 0.5) * size
    sdf = ((np.linalg.norm(at - 1.0, axis=-1) - 0.6) / size).astype(np.float32)
    directions = fibonacci_sphere(2000)

    def cost(x, price=1.0):
        gradient = np.zeros(len(x))
        return kernels.surface_cost(x, sdf, size, directions, 0.01, price, gradient), gradient

    # a sphere of radius 0.3 centred on the large sphere: the plane of the cut is r²/2R inside its centre
    share = (1 + 0.3 / (2 * 0.6)) / 2
    assert cost(np.array([1.6, 1.0, 1.0, 0.3]))[0] == pytest.approx(share, abs=0.01)
    assert cost(np.array([1.0, 1.0, 1.0, 0.3]))[0] == 0.0
    two = np.array([1.6, 1.0, 1.0, 0.3, 1.0, 1.0, 1.0, 0.4])
    assert cost(two, 2.0)[0] == pytest.approx(2 * share * 0.09 / 0.25, abs=0.01)
    x = np.array([1.5, 1.1, 0.9, 0.25, 0.8, 1.3, 1.2, 0.35])
    _, gradient = cost(x)
    for k in range(len(x)):
        ahead, behind = x.copy(), x.copy()
        ahead[k] += 1e-4
        behind[k] -= 1e-4
        slope = (cost(ahead)[0] - cost(behind)[0]) / 2e-4
        assert gradient[k] == pytest.approx(slope, abs=0.03)


def test_descent_ends_no_worse_than_scipy():
    from scipy.optimize import minimize

    rng = np.random.default_rng(1)
    points = rng.uniform(-1, 1, (3000, 3)).astype(np.float32)
    weight = np.where(np.abs(points).max(axis=1) < 0.5, 2.0, -1.0)
    px, py, pz = (np.ascontiguousarray(points[:, k]) for k in range(3))
    start = np.concatenate([rng.uniform(-0.3, 0.3, (6, 3)), np.full((6, 1), 0.3)], axis=1).ravel()
    index, gap, gradient = np.empty(3000, np.int32), np.empty(3000, np.float32), np.empty(24)

    def cost(x):
        return kernels.volume_cost(x, px, py, pz, weight, 0.1, 1.0, index, gap, gradient), gradient.copy()

    theirs = minimize(cost, start, jac=True, method="L-BFGS-B", options={"maxiter": 100}).fun
    ours = kernels.descend(start.copy(), px, py, pz, weight, 0.1, 1.0, 0.01, 9.0, 100, *NO_SURFACE)
    assert ours < 1.05 * theirs
