"""Colours, light and shadow against closed forms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from roboyard.rendering import UNLIT, Backdrop, Camera, Light
from roboyard.shapes import primitives
from roboyard.shapes.mesh import TriangleMesh

FRONT = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=41, height=41)


@pytest.mark.parametrize("rgba", [(0.7, 0.2, 0.1), (0.0, 0.5, 1.0), (1 / 255, 77 / 255, 254 / 255)])
def test_unlit_colours_are_exact(rgba, shape, picture):
    image = picture([shape(primitives.sphere(0.8), rgba=(*rgba, 1.0))], FRONT, light=UNLIT)
    seen = image.segmentation[..., 0] >= 0
    assert (image.rgba[seen] == [*(int(c * 255 + 0.5) for c in rgba), 255]).all()


def test_face_colours_multiply_and_can_be_overridden(shape, picture):
    box = primitives.box(0.5, 0.5, 0.5)
    colors = np.full((12, 4), 255, dtype=np.uint8)
    colors[6:8] = (200, 100, 50, 255)  # the side at -y
    mesh = dataclasses.replace(box, colors=colors, normals=None, uv=None)
    image = picture([shape(mesh, rgba=(1.0, 0.5, 1.0, 1.0))], FRONT, light=UNLIT)
    assert image.rgba[20, 20].tolist() == [200, 50, 50, 255]
    image = picture([shape(mesh, rgba=(0.2, 0.4, 0.6, 1.0), use_mesh_colors=False)], FRONT, light=UNLIT)
    assert image.rgba[20, 20].tolist() == [51, 102, 153, 255]


def quarters():
    """Return 2 x 2 texels: red and green above, blue and white below."""
    texture = np.full((2, 2, 4), 255, dtype=np.uint8)
    texture[0, 0, :3], texture[0, 1, :3] = (255, 0, 0), (0, 255, 0)
    texture[1, 0, :3] = (0, 0, 255)
    return texture


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_textures_are_upright_on_every_vertical_side_of_a_box(turn, shape, picture):
    angle = turn * np.pi / 2
    camera = Camera.look_at((3 * np.sin(angle), -3 * np.cos(angle), 0), (0, 0, 0), width=41, height=41)
    box = shape(primitives.box(), texture=quarters(), rgba=(1.0, 1.0, 1.0, 1.0))
    image = picture([box], camera, light=UNLIT)
    rows, columns = np.nonzero(image.segmentation[..., 0] >= 0)
    top, bottom, left, right = rows.min() + 1, rows.max() - 1, columns.min() + 1, columns.max() - 1
    for at, color in {
        (top, left): (255, 0, 0), (top, right): (0, 255, 0),
        (bottom, left): (0, 0, 255), (bottom, right): (255, 255, 255),
    }.items():  # fmt: skip
        # bilinear and repeating: corners blend slightly with the opposite edge
        assert np.abs(image.rgba[at][:3].astype(int) - color).max() < 130
        assert np.argmin([np.abs(image.rgba[at][:3].astype(int) - c).sum() for c in
                          [(255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)]]) == [
            (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)].index(color)  # fmt: skip


def test_a_texture_is_perspective_correct(shape, picture):
    """Stripes on the floor: the colour of each pixel is that of the point where its ray hits."""
    size = 256
    ramp = np.zeros((1, size, 4), dtype=np.uint8)
    ramp[0, :, 0], ramp[..., 3] = np.arange(size), 255
    camera = Camera.look_at((0.9, -1.4, 0.5), (0.0, 0.0, 0.0), width=64, height=48)
    image = picture([shape(primitives.plane(1.0, 1.0), texture=ramp, rgba=(1, 1, 1, 1))], camera, light=UNLIT)
    points = image.points()
    inner = (np.abs(points[..., :2]) < 0.8).all(axis=-1)
    expected = (points[..., 0] + 1.0) / 2.0 * size - 0.5
    assert inner.sum() > 300
    assert np.abs(image.rgba[..., 0][inner] - expected[inner]).max() < 2.0


def test_distant_textures_show_their_mean(shape, picture):
    board = np.zeros((64, 64, 4), dtype=np.uint8)
    board[(np.indices((64, 64)).sum(axis=0) % 2) == 0, :3] = 255
    board[..., 3] = 255
    camera = Camera.look_at((0.0, 0.0, 40.0), (0.0, 0.0, 0.0), width=40, height=40)
    mesh = primitives.plane(10.0, 10.0, 20.0)
    image = picture([shape(mesh, texture=board, rgba=(1, 1, 1, 1))], camera, light=UNLIT)
    assert np.abs(image.rgba[15:25, 15:25, 0].astype(int) - 128).max() <= 6


def test_the_checker_shows_both_colours_near_and_their_mean_at_the_horizon(shape, picture):
    plane = shape(
        primitives.plane(1, 1), infinite=True, rgba=(1, 1, 1, 1), checker=((0.0, 0.0, 0.0), 0.5), specular=0.0
    )
    camera = Camera.look_at((0.25, 0.25, 1.0), (0.25, 0.25, 0.0), width=200, height=200)
    image = picture([plane], camera, light=UNLIT)
    points = image.points()
    square = np.floor(points[..., :2] / 0.5).sum(axis=-1) % 2
    edge = np.abs(points[..., :2] / 0.5 - np.round(points[..., :2] / 0.5)).min(axis=-1) < 0.02
    assert (image.rgba[..., 0][(square == 0) & ~edge] == 255).all()
    assert (image.rgba[..., 0][(square == 1) & ~edge] == 0).all()
    camera = Camera.look_at((0, 0, 0.5), (5, 0.3, 0.5), width=200, height=200, far=1000.0)
    image = picture([plane], camera, light=UNLIT)
    horizon = image.rgba[102:104, :, 0].astype(int)
    assert np.isfinite(image.depth[102]).all()
    assert np.abs(horizon - 128).max() < 12


def test_lambert_on_a_plane(shape, picture, floor):
    sun = np.array([1.0, 2.0, 2.0]) / 3.0
    light = Light(direction=tuple(3 * sun), ambient=0.25, diffuse=0.5, specular=0.0, sky=0.4)
    camera = Camera.look_at((0, -0.1, 3.0), (0, 0, 0), width=9, height=9)
    image = picture([floor], camera, light=light)
    expected = 0.8 * (0.25 + 0.5 * (0.6 * sun[2] + 0.4 * 1.0))
    assert np.abs(image.rgba[..., 0] - 255 * expected).max() <= 0.51


def test_a_smooth_sphere_is_lit_by_its_true_normals(shape, picture):
    light = Light(direction=(0.3, -1.0, 0.6), ambient=0.1, diffuse=0.9, specular=0.0, sky=0.0)
    sphere = primitives.sphere(0.8, 48)
    bare = TriangleMesh(vertices=sphere.vertices, faces=sphere.faces)  # normals computed by the renderer
    sun = np.array(light.direction) / np.linalg.norm(light.direction)
    for mesh in (sphere, bare):
        image = picture([shape(mesh, rgba=(1, 1, 1, 1))], FRONT, light=light, shadow=False)
        points = image.points() / 0.8
        seen = np.isfinite(points[..., 0])
        expected = 255 * (0.1 + 0.9 * np.maximum(points @ sun, 0.0))
        assert np.abs(image.rgba[..., 0][seen] - expected[seen]).max() < 4.0


def test_sharp_edges_stay_sharp_without_normals(shape, picture):
    box = primitives.box(0.5, 0.5, 0.5)
    bare = TriangleMesh(vertices=box.vertices, faces=box.faces)
    camera = Camera.look_at((2, -2.5, 1.5), (0, 0, 0), width=60, height=60)
    image = picture([shape(bare)], camera, light=Light(specular=0.0), shadow=False)
    seen = image.segmentation[..., 0] >= 0
    assert len(np.unique(image.rgba[seen], axis=0)) == 3


def test_the_shadow_of_a_sphere_is_at_its_projection_along_the_sun(shape, picture, floor):
    centre, radius = np.array([0.1, -0.2, 0.8]), 0.3
    light = Light(direction=(0.5, -0.4, 1.0), ambient=0.2, diffuse=0.8, specular=0.0, sky=0.0)
    sun = np.array(light.direction) / np.linalg.norm(light.direction)
    ball = shape(primitives.sphere(radius, 96), centre)
    camera = Camera.look_at((-0.3, 0.2, 2.6), (-0.3, 0.1, 0.0), width=160, height=160)
    image = picture([floor, ball], camera, light=light)
    ground = image.segmentation[..., 0] == 9
    points = image.points()
    away = points - centre
    from_axis = np.linalg.norm(away - (away @ sun)[..., None] * sun, axis=-1)
    dark = image.rgba[..., 0] < 100
    edge = np.abs(from_axis - radius) < 0.04
    assert (ground & (from_axis < radius) & ~edge).sum() > 500
    assert np.array_equal(dark[ground & ~edge], (from_axis < radius)[ground & ~edge])
    # on the sphere: bright where it faces the sun, no speckles
    on_ball = (image.segmentation[..., 0] == 0) & ((away / radius) @ sun > 0.3)
    expected = 0.7 * (0.2 + 0.8 * np.clip((away / radius) @ sun, 0, 1)) * 255
    assert on_ball.sum() > 200
    assert np.abs(image.rgba[..., 0][on_ball] - expected[on_ball]).max() < 8


def test_shadows_reach_the_base_of_their_caster(shape, picture, floor):
    light = Light(direction=(-1.0, 0.0, 1.0), ambient=0.2, diffuse=0.8, specular=0.0, sky=0.0)
    box = shape(primitives.box(0.1, 0.3, 0.2), (0, 0, 0.2))
    camera = Camera.look_at((0.6, -0.6, 1.2), (0.3, 0, 0.0), width=200, height=200)
    image = picture([floor, box], camera, light=light)
    points = image.points()
    ground = image.segmentation[..., 0] == 9
    x, y = points[..., 0], points[..., 1]
    shaded = ground & (x > 0.115) & (x < 0.47) & (np.abs(y) < 0.27)
    assert shaded.sum() > 500
    assert image.rgba[..., 0][shaded].max() < 100
    lit = ground & ((x < -0.12) | (x > 0.54) | (np.abs(y) > 0.33))
    assert image.rgba[..., 0][lit].min() > 120


def test_shapes_outside_the_view_cast_shadows_into_it(shape, picture, floor):
    light = Light(direction=(0.0, 0.0, 1.0), ambient=0.2, diffuse=0.8, specular=0.0, sky=0.0)
    camera = Camera.look_at((0, -1, 1.0), (0, 0, 0), width=60, height=60, fovy=0.6)
    roof = shape(primitives.box(0.1, 0.1, 0.01), (0, 0, 5.0))
    image = picture([floor, roof], camera, light=light)
    assert set(image.segmentation[..., 0].ravel().tolist()) == {9}
    points = image.points()
    under = (np.abs(points[..., :2]) < 0.08).all(axis=-1)
    assert image.rgba[..., 0][under].max() < 60
    assert image.rgba[..., 0][(np.abs(points[..., :2]) > 0.12).any(axis=-1)].min() > 190


@pytest.mark.parametrize("ground", [primitives.plane(30.0, 30.0), primitives.box(30.0, 30.0, 0.5)])
def test_a_large_ground_leaves_the_shadows_on_it_sharp(ground, shape, picture):
    light = Light(direction=(0.6, 0.0, 1.0), ambient=0.2, diffuse=0.8, specular=0.0, sky=0.0)
    top = float(ground.bounds[1, 2])
    camera = Camera.look_at((-0.2, -1.5, 1.5 + top), (-0.2, 0, top), width=200, height=150)
    roof = shape(primitives.box(0.15, 0.15, 0.02), (0, 0, 0.5 + top), owner=(1, 0))
    image = picture([shape(ground), roof], camera, light=light)
    points = image.points()
    x, y = points[..., 0] + 0.6 * 0.5, points[..., 1]
    floor_seen = image.segmentation[..., 0] == 0
    inside = floor_seen & (np.abs(x) < 0.12) & (np.abs(y) < 0.12)
    outside = floor_seen & ((np.abs(x) > 0.19) | (np.abs(y) > 0.18))
    assert inside.sum() > 100
    assert image.rgba[..., 0][inside].max() < 60
    assert image.rgba[..., 0][outside].min() > 120


def test_a_table_top_casts_its_shadow_on_the_ground(shape, picture):
    light = Light(direction=(0.0, 0.0, 1.0), ambient=0.2, diffuse=0.8, specular=0.0, sky=0.0)
    table = shape(primitives.box(0.3, 0.3, 0.01), (0, 0, 0.6), owner=(1, 0))
    cup = shape(primitives.box(0.05, 0.05, 0.05), (0, 0, 0.66), owner=(2, 0))
    camera = Camera.look_at((0.0, -2.0, 0.5), (0, 0, 0.2), width=120, height=90)
    image = picture([shape(primitives.plane(5, 5)), table, cup], camera, light=light)
    points = image.points()
    under = (image.segmentation[..., 0] == 0) & (np.abs(points[..., :2]) < 0.27).all(axis=-1)
    assert under.sum() > 100
    assert image.rgba[..., 0][under].max() < 60


def test_shadow_false_gives_no_shadow(shape, picture, floor):
    box = shape(primitives.box(0.1, 0.1, 0.1), (0, 0, 0.5))
    camera = Camera.look_at((0.6, -0.6, 2.2), (0.0, 0, 0.0), width=60, height=60)
    image = picture([floor, box], camera, shadow=False)
    ground = image.segmentation[..., 0] == 9
    assert len(np.unique(image.rgba[ground], axis=0)) == 1


def test_the_backdrop_is_a_vertical_gradient_and_the_floor_fades_into_it(picture, floor):
    backdrop = Backdrop(top=(0.0, 0.0, 1.0), bottom=(1.0, 0.0, 0.0), fade=(5.0, 10.0))
    camera = Camera.look_at((0, 0, 1.0), (10, 0, 1.0), width=20, height=100, far=200.0)
    image = picture([floor], camera, background=backdrop, light=UNLIT)
    assert image.rgba[0, 0, 2] > 250
    assert image.rgba[0, 0, 0] < 5
    below = image.rgba[55, 10].astype(int)  # beyond 10 m the floor has faded completely
    assert image.depth[55, 10] > 10.0
    assert below[0] == pytest.approx(255 * 0.555, abs=2)
    assert image.rgba[99, 10].tolist() == [204, 204, 204, 255]


def test_a_transparent_background_keeps_its_alpha(shape, picture):
    image = picture([shape(primitives.sphere(0.5))], FRONT, background=(1.0, 1.0, 1.0, 0.0))
    assert set(np.unique(image.rgba[..., 3])) == {0, 255}
    assert np.array_equal(image.rgba[..., 3] == 255, image.segmentation[..., 0] >= 0)


def test_supersampling_smooths_colours_only(shape, picture):
    shapes = [shape(primitives.sphere(0.5), rgba=(0, 0, 0, 1))]
    plain, fine = (picture(shapes, FRONT, light=UNLIT, samples=n) for n in (1, 4))
    assert np.array_equal(plain.depth, fine.depth)
    assert np.array_equal(plain.segmentation, fine.segmentation)
    assert set(np.unique(plain.rgba[..., 0])) == {0, 255}
    assert set(np.unique(fine.rgba[..., 0])) == {0, 64, 128, 191, 255}


def test_a_light_without_direction_raises(picture):
    with pytest.raises(ValueError, match="towards the sun"):
        picture([], FRONT, light=Light(direction=(0.0, 0.0, 0.0)))


@pytest.mark.parametrize("leak", [0.0, 0.5, 0.8])
def test_light_leak_brightens_shadows(leak, shape, picture, floor):
    camera = Camera.look_at((0.0, -3.0, 3.0), (0.0, 0.0, 0.0), width=60, height=60)
    light = Light(direction=(0, 0, 1), ambient=0.1, diffuse=0.8, sky=0.0, specular=0.0, leak=leak)
    roof = shape(primitives.box(0.5, 0.5, 0.05), position=(0.0, 0.0, 1.0), owner=(1, -1))
    image = picture([floor, roof], camera, light=light, shadow=True)
    points = image.points()
    ground = (np.abs(points[..., 2]) < 1e-3) & (image.segmentation[..., 0] == 9)
    under = ground & (np.abs(points[..., :2]).max(axis=-1) < 0.3)
    beside = ground & (np.abs(points[..., :2]).max(axis=-1) > 0.8)
    assert under.sum() > 10
    assert image.rgba[under][:, 0] == pytest.approx(255 * 0.8 * (0.1 + 0.8 * leak), abs=1.5)
    assert image.rgba[beside][:, 0] == pytest.approx(255 * 0.8 * 0.9, abs=1.5)
