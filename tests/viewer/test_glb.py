"""Shapes as binary glTF, read back by trimesh."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from roboyard.rendering.scene import RenderShape
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh, read_only
from roboyard.viewer.scene.glb import glb, linear_rgb


def shape(mesh: TriangleMesh, **fields: Any) -> RenderShape:
    return RenderShape(mesh=mesh, position=np.zeros(3), rotation=np.eye(3), frame=0, owner=(0, 0), **fields)


def read(data: bytes) -> Any:
    import trimesh

    return trimesh.load(io.BytesIO(data), file_type="glb", process=False)


def test_a_scaled_box_keeps_its_size_and_volume() -> None:
    scene = read(glb(shape(primitives.box(), scale=(0.2, 0.4, 0.6))))
    (mesh,) = scene.geometry.values()
    assert mesh.extents == pytest.approx([0.2, 0.4, 0.6], rel=1e-6)
    assert mesh.volume == pytest.approx(0.2 * 0.4 * 0.6, rel=1e-5)


def test_a_mirrored_mesh_still_faces_outwards() -> None:
    scene = read(glb(shape(primitives.box(), scale=(1.0, -1.0, 1.0))))
    (mesh,) = scene.geometry.values()
    assert mesh.volume == pytest.approx(1.0, rel=1e-6)
    outward = np.einsum("ij,ij->i", mesh.face_normals, mesh.vertex_normals[mesh.faces[:, 0]])
    assert (outward > 0.9).all()


def test_normals_of_a_scaled_sphere_are_those_of_the_ellipsoid() -> None:
    scene = read(glb(shape(primitives.sphere(), scale=(1.0, 1.0, 0.25))))
    (mesh,) = scene.geometry.values()
    places = np.asarray(mesh.vertices)
    expected = places / np.array([0.5, 0.5, 0.125]) ** 2
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", expected, np.asarray(mesh.vertex_normals))
    assert np.median(cosine) > 0.999


def test_each_face_colour_becomes_a_material_and_rgba_multiplies_it() -> None:
    box = primitives.box()
    colors = np.tile(np.array([[255, 0, 0, 255]], dtype=np.uint8), (len(box.faces), 1))
    colors[:4] = (0, 128, 255, 255)
    painted = TriangleMesh(vertices=box.vertices, faces=box.faces, colors=read_only(colors, np.uint8))
    scene = read(glb(shape(painted, rgba=(1.0, 0.5, 1.0, 0.5))))
    factors = sorted(
        (tuple(float(c) for c in mesh.visual.material.baseColorFactor / 255.0), len(mesh.faces))
        for mesh in scene.geometry.values()
    )
    expected = sorted(
        [
            ((*linear_rgb(np.array([0.0, 0.5 * 128 / 255, 1.0])), 0.5), 4),
            ((*linear_rgb(np.array([1.0, 0.0, 0.0])), 0.5), 8),
        ]
    )
    for (color, count), (expected_color, expected_count) in zip(factors, expected, strict=True):
        assert color == pytest.approx(expected_color, abs=0.005)
        assert count == expected_count


def test_a_material_of_the_description_overrides_the_mesh_colours() -> None:
    box = primitives.box()
    colors = np.tile(np.array([[255, 0, 0, 255]], dtype=np.uint8), (len(box.faces), 1))
    painted = TriangleMesh(vertices=box.vertices, faces=box.faces, colors=read_only(colors, np.uint8))
    scene = read(glb(shape(painted, rgba=(0.0, 1.0, 0.0, 1.0), use_mesh_colors=False)))
    (mesh,) = scene.geometry.values()
    assert tuple(mesh.visual.material.baseColorFactor) == (0, 255, 0, 255)


def test_a_texture_is_complete_and_upright() -> None:
    picture = np.arange(4 * 6 * 4, dtype=np.uint8).reshape(4, 6, 4)
    picture[..., 3] = 255
    floor = primitives.plane()
    scene = read(glb(shape(floor, texture=picture, rgba=(1.0, 1.0, 1.0, 1.0))))
    (mesh,) = scene.geometry.values()
    np.testing.assert_array_equal(np.asarray(mesh.visual.material.baseColorTexture), picture)
    # trimesh flips v on reading, so the coordinates are those of the mesh
    corner = np.argmin(np.abs(np.asarray(mesh.vertices) - (-0.5, -0.5, 0.0)).sum(axis=1))
    assert mesh.visual.uv[corner] == pytest.approx((0.0, 0.0), abs=1e-6)


def test_a_checkerboard_repeats_every_two_squares_in_its_two_colours() -> None:
    first, second = (0.8, 0.8, 0.8), (0.4, 0.2, 0.6)
    floor = primitives.plane(4.0, 4.0)
    scene = read(glb(shape(floor, rgba=(*first, 1.0), checker=(second, 0.5), infinite=True)))
    (mesh,) = scene.geometry.values()
    assert np.ptp(mesh.visual.uv, axis=0) == pytest.approx([8.0, 8.0])
    tile = np.asarray(mesh.visual.material.baseColorTexture)[..., :3] / 255.0
    factor = mesh.visual.material.baseColorFactor[:3] / 255.0
    shown = {tuple(np.round(c, 2)) for c in (linear_rgb(tile.reshape(-1, 3)) * factor)}
    wanted = {tuple(np.round(linear_rgb(np.array(c)), 2)) for c in (first, second)}
    assert len(shown) == 2
    for color in wanted:
        assert any(np.abs(np.subtract(color, other)).max() <= 0.015 for other in shown)
