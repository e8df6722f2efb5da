"""Voxel fill against closed forms and trimesh, and against readable NumPy references of the kernels."""

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from roboyard.errors import MeshError
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels import kernels
from roboyard.shapes.voxels.grid import voxelize


def mesh_of(shape: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(
        vertices=np.array(shape.vertices, dtype=np.float64), faces=np.array(shape.faces, dtype=np.int32)
    )


def joined(*shapes: trimesh.Trimesh) -> TriangleMesh:
    return mesh_of(trimesh.util.concatenate(list(shapes)))


@pytest.mark.parametrize(
    "shape",
    [
        trimesh.creation.box((0.3, 0.1, 0.2)),
        trimesh.creation.icosphere(3, 0.1),
        trimesh.creation.cylinder(0.05, 0.4),
        trimesh.creation.torus(0.2, 0.06),
        trimesh.creation.annulus(0.05, 0.1, 0.1),
    ],
    ids=["box", "ball", "cylinder", "torus", "annulus"],
)
def test_volume_and_distance_agree_with_exact_ones(shape):
    grid = voxelize(mesh_of(shape))
    assert grid.volume == pytest.approx(shape.volume, rel=0.02)
    points = np.random.default_rng(0).uniform(*shape.bounds, (200, 3))
    exact = -trimesh.proximity.signed_distance(shape, points)
    off = np.abs(grid.distance(points) - exact) / grid.size
    assert np.median(off) < 0.15
    assert off.max() < 1.0


def test_distance_grows_linearly_outside_the_grid():
    grid = voxelize(mesh_of(trimesh.creation.icosphere(3, 0.1)))
    far = np.array([[5.0, 0.0, 0.0], [0.0, -3.0, 4.0]])
    assert grid.distance(far) == pytest.approx([4.9, 4.9], rel=0.01)


def test_overlapping_shells_are_one_solid():
    a = trimesh.creation.box((0.2, 0.2, 0.2))
    b = a.copy()
    b.apply_translation((0.1, 0, 0))
    assert voxelize(joined(a, b)).volume == pytest.approx(0.3 * 0.2 * 0.2, rel=0.02)


def test_meshes_wound_opposite_ways_still_unite():
    a = trimesh.creation.box((0.2, 0.2, 0.2))
    b = a.copy()
    b.apply_translation((0.1, 0, 0))
    b.invert()
    assert voxelize([mesh_of(a), mesh_of(b)]).volume == pytest.approx(0.012, rel=0.02)


def test_cavities_are_filled_only_with_fill_cavities():
    outer, inner = trimesh.creation.icosphere(3, 0.1), trimesh.creation.icosphere(3, 0.07)
    inner.invert()
    shell = joined(outer, inner)
    assert voxelize(shell).volume == pytest.approx(outer.volume + inner.volume, rel=0.03)
    filled = voxelize(shell, fill_cavities=True)
    assert filled.volume == pytest.approx(outer.volume, rel=0.03)
    assert "enclosed cavity counted as solid" in filled.notes


def test_missing_faces_keep_the_solid():
    ball = trimesh.creation.icosphere(3, 0.1)
    holed = mesh_of(ball)
    keep = np.random.default_rng(1).random(len(ball.faces)) > 0.03
    holed = TriangleMesh(vertices=holed.vertices, faces=holed.faces[keep])
    assert voxelize(holed).volume == pytest.approx(ball.volume, rel=0.03)


def test_missing_cap_keeps_the_solid():
    cup = trimesh.creation.cylinder(0.1, 0.2)
    cup.update_faces(cup.face_normals[:, 2] < 0.9)
    assert voxelize(mesh_of(cup)).volume == pytest.approx(np.pi * 0.01 * 0.2, rel=0.03)


def test_faces_doubled_both_ways_are_still_solid():
    box = trimesh.creation.box((0.2, 0.1, 0.3))
    faces = np.concatenate([box.faces, box.faces[:, ::-1]]).astype(np.int32)
    grid = voxelize(TriangleMesh(vertices=np.array(box.vertices), faces=faces))
    assert grid.volume == pytest.approx(0.006, rel=0.03)
    assert "12 duplicate faces" in grid.notes


def test_faces_wound_at_random_are_still_solid():
    ball = trimesh.creation.icosphere(3, 0.1)
    faces = np.array(ball.faces, dtype=np.int32)
    flip = np.random.default_rng(2).random(len(faces)) < 0.5
    faces[flip] = faces[flip][:, ::-1]
    grid = voxelize(TriangleMesh(vertices=np.array(ball.vertices), faces=faces))
    assert grid.volume == pytest.approx(ball.volume, rel=0.02)
    assert "faces wound both ways" in grid.notes


def test_thin_plate_and_open_sheet_keep_their_surface_voxels():
    plate = voxelize(mesh_of(trimesh.creation.box((0.5, 0.5, 1e-4))))
    sheet = TriangleMesh(
        vertices=np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
        faces=np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
    )
    flat = voxelize(sheet)
    for grid, area in ((plate, 0.25), (flat, 1.0)):
        assert not grid.inside.any()
        assert grid.solid.sum() * grid.size**2 == pytest.approx(area, rel=0.1)
        assert any("no inside" in note for note in grid.notes)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e5])
def test_any_scale(size):
    grid = voxelize(mesh_of(trimesh.creation.box((size, size, 2 * size))))
    assert grid.volume == pytest.approx(2 * size**3, rel=0.03)


def test_mesh_without_finite_vertex_raises():
    bad = TriangleMesh(vertices=np.full((3, 3), np.nan), faces=np.array([[0, 1, 2]], dtype=np.int32))
    with pytest.raises(MeshError, match="no finite vertex"):
        voxelize(bad)


def test_interior_samples_are_inside_and_uniform():
    box = trimesh.creation.box((0.3, 0.1, 0.2))
    samples = voxelize(mesh_of(box)).interior_samples(4000, np.random.default_rng(0))
    assert len(samples) == 4000
    assert (np.abs(samples) < np.array([0.15, 0.05, 0.1]) * 1.02).all()
    assert samples.mean(axis=0) == pytest.approx([0, 0, 0], abs=0.004)
    assert samples.std(axis=0) == pytest.approx(np.array([0.3, 0.1, 0.2]) / np.sqrt(12), rel=0.05)


def test_nearest_seed_is_the_euclidean_feature_transform():
    seeds = np.random.default_rng(3).random((13, 9, 17)) < 0.02
    label = kernels.nearest_seed(seeds)
    at = np.stack(np.unravel_index(label, seeds.shape), axis=-1)
    distance = np.linalg.norm(at - np.moveaxis(np.indices(seeds.shape), 0, -1), axis=-1)
    assert seeds.ravel()[label].all()
    assert distance == pytest.approx(ndimage.distance_transform_edt(~seeds))


def test_sample_field_is_trilinear_with_its_gradient():
    field = np.random.default_rng(4).random((6, 5, 7)).astype(np.float32)
    points = np.random.default_rng(5).uniform(0.6, 4.4, (50, 3))
    expected = ndimage.map_coordinates(field, (points - 0.5).T, order=1)
    for point, value in zip(points, expected, strict=True):
        got, *gradient = kernels.sample_field(field, *point)
        assert got == pytest.approx(value, abs=1e-5)
        for axis in range(3):
            shifted = point.copy()
            shifted[axis] += 1e-4
            slope = (kernels.sample_field(field, *shifted)[0] - got) / 1e-4
            assert gradient[axis] == pytest.approx(slope, abs=2e-2)


def test_crossings_cancel_along_every_ray_of_a_closed_mesh():
    torus = trimesh.creation.torus(0.3, 0.1)
    local = np.ascontiguousarray((torus.vertices - torus.bounds[0]) / 0.02 + 2.0)
    shape = np.ceil(np.ptp(local, axis=0)).astype(np.int64) + 5
    for axis in range(3):
        rays = (shape[(axis + 1) % 3], shape[(axis + 2) % 3], shape[axis] + 1)
        signed, unsigned = np.zeros(rays, np.int16), np.zeros(rays, np.int16)
        kernels.count_crossings(local, torus.faces.astype(np.int32), axis, shape, signed, unsigned)
        assert not signed.sum(axis=2).any()
        assert unsigned.sum() > 100
        hit, by_sign, by_parity = kernels.closed_share(signed, unsigned)
        assert hit == by_sign == by_parity == (unsigned.sum(axis=2) > 0).sum()
