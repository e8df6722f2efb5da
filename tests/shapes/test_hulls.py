"""Convex hulls against closed forms, trimesh, and inputs that span no volume."""

import numpy as np
import pytest
import trimesh

from roboyard.errors import MeshError
from roboyard.shapes.convex.hulls import convex_hull, farthest_along, hull_volume, is_convex, measure_hulls
from roboyard.shapes.mesh import TriangleMesh
from roboyard.shapes.voxels.grid import voxelize


def mesh_of(shape: trimesh.Trimesh) -> TriangleMesh:
    return TriangleMesh(
        vertices=np.array(shape.vertices, dtype=np.float64), faces=np.array(shape.faces, dtype=np.int32)
    )


def judge(hull) -> trimesh.Trimesh:
    return trimesh.Trimesh(hull.mesh.vertices, hull.mesh.faces, process=False)


@pytest.mark.parametrize(
    "shape",
    [
        trimesh.creation.box((0.3, 0.1, 0.2)),
        trimesh.creation.torus(0.2, 0.05),
        trimesh.creation.icosphere(4, 1e-4),
        trimesh.creation.cylinder(50.0, 300.0),
    ],
    ids=["box", "torus", "tiny ball", "huge cylinder"],
)
def test_hull_is_closed_outward_and_of_the_right_volume(shape):
    hull = convex_hull(mesh_of(shape), None)
    mesh = judge(hull)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(shape.convex_hull.volume, rel=1e-9)
    assert hull.volume == pytest.approx(mesh.volume, rel=1e-9)
    assert (hull.lost, hull.notes) == (0.0, ())


def test_vertex_limit_keeps_most_of_the_volume():
    ball = trimesh.creation.icosphere(4, 0.1)
    losses = [convex_hull(mesh_of(ball), limit).lost for limit in (12, 30, 60, 120)]
    assert losses == sorted(losses, reverse=True)
    assert losses[2] < 0.12
    hull = convex_hull(mesh_of(ball), 60)
    assert len(hull.mesh.vertices) == 60
    assert judge(hull).is_watertight
    assert hull.lost == pytest.approx(1 - judge(hull).volume / ball.convex_hull.volume, abs=1e-9)


def test_vertex_limit_keeps_the_corners_of_a_plain_shape():
    rng = np.random.default_rng(0)
    inside_and_corners = np.concatenate(
        [rng.uniform(-0.99, 0.99, (2000, 3)), trimesh.creation.box((2, 2, 2)).vertices]
    )
    hull = convex_hull(inside_and_corners, 8)
    assert sorted(map(tuple, np.rint(hull.mesh.vertices).tolist())) == sorted(
        map(tuple, trimesh.creation.box((2, 2, 2)).vertices.tolist())
    )


@pytest.mark.parametrize(
    ("points", "word", "thin"),
    [
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "flat", 1),
        ([[0, 0, 0], [1, 1, 1], [0, 0.5, 0.3]], "flat", 1),
        ([[0, 0, 0], [1, 2, 3], [2, 4, 6]], "a line", 2),
        ([[5, 5, 5], [5, 5, 5]], "a point", 3),
        ([[1e3, 1e3, 1e3 + k] for k in range(5)], "a line", 2),
    ],
)
@pytest.mark.parametrize("limit", [60, 4])
def test_input_without_volume_is_thickened_and_noted(points, word, thin, limit):
    hull = convex_hull(points, limit)
    assert hull.volume > 0
    assert judge(hull).is_watertight
    a, b, c = np.moveaxis((hull.mesh.vertices - hull.mesh.vertices[0])[hull.mesh.faces], 1, 0)
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(hull.volume, rel=1e-6)
    assert word in hull.notes[0]
    assert len(hull.mesh.vertices) <= limit
    sizes = np.sort(judge(hull).bounding_box_oriented.primitive.extents) if limit > 4 else None
    if sizes is not None:
        assert (sizes[:thin] < 0.01 * max(sizes.max(), 1.0)).all()


def test_nearly_flat_and_repeated_points_still_give_a_hull():
    rng = np.random.default_rng(1)
    nearly = rng.random((200, 3)) * [1, 1, 1e-9]
    assert convex_hull(nearly).volume > 0
    repeated = np.repeat(trimesh.creation.box((1, 1, 1)).vertices, 50, axis=0) + rng.normal(
        0, 1e-13, (400, 3)
    )
    assert convex_hull(repeated).volume == pytest.approx(1.0)


def test_unused_and_infinite_vertices_are_ignored():
    box = trimesh.creation.box((1, 1, 1))
    vertices = np.concatenate([box.vertices, [[9, 9, 9], [np.nan, 0, 0]]])
    hull = convex_hull(TriangleMesh(vertices=vertices, faces=box.faces.astype(np.int32)))
    assert hull.volume == pytest.approx(1.0)
    with pytest.raises(MeshError, match="no finite vertex"):
        convex_hull(np.full((3, 3), np.inf))
    with pytest.raises(MeshError, match="must be 4 or more"):
        convex_hull(box.vertices, 3)


def test_is_convex():
    box, ball = trimesh.creation.box((1, 2, 3)), trimesh.creation.icosphere(3)
    bowl = ball.copy()
    bowl.update_faces(bowl.triangles_center[:, 2] < 0)
    apart = trimesh.util.concatenate([box, box.copy().apply_translation((3, 0, 0))])
    assert is_convex(mesh_of(box))
    assert is_convex(mesh_of(ball))
    assert not is_convex(mesh_of(bowl))
    assert not is_convex(mesh_of(apart))
    assert not is_convex(mesh_of(trimesh.creation.torus(1, 0.2)))
    assert not is_convex(mesh_of(trimesh.util.concatenate([box, box])))


def test_hull_of_a_cup_has_its_cavity_as_excess():
    cup = trimesh.creation.annulus(0.08, 0.1, 0.2)
    grid = voxelize(mesh_of(cup))
    fit = measure_hulls([convex_hull(mesh_of(cup), None).mesh], grid)
    assert fit.excess == pytest.approx(0.64 / 0.36, rel=0.05)
    assert fit.missing < 0.02
    assert fit.deepest_mm == pytest.approx(80, abs=3)
    half = convex_hull(trimesh.creation.box(bounds=[[-0.1, -0.1, 0], [0.1, 0.1, 0.1]]).vertices)
    assert measure_hulls([half.mesh], grid).missing == pytest.approx(0.5, abs=0.03)


def test_small_helpers():
    points = np.random.default_rng(2).normal(size=(500, 3))
    directions = np.random.default_rng(3).normal(size=(40, 3))
    assert farthest_along(points, directions).tolist() == (points @ directions.T).argmax(axis=0).tolist()
    assert hull_volume(trimesh.creation.box((1, 2, 3)).vertices.view(np.ndarray)) == pytest.approx(6)
    assert hull_volume(np.zeros((3, 3))) == 0.0
    assert hull_volume(np.zeros((9, 3))) == 0.0
