from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from roboyard.rendering import UNLIT, Camera
from roboyard.shapes import primitives

DOWN = Camera.look_at((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), width=21, height=21)
PANE = primitives.plane(1.0, 1.0)


def test_panes_blend_back_to_front_in_any_order(shape, picture):
    red = shape(PANE, (0, 0, 1), rgba=(1, 0, 0, 0.5), owner=(1, 0))
    green = shape(PANE, (0, 0, 2), rgba=(0, 1, 0, 0.25), owner=(2, 0))
    blue = shape(PANE, (0, 0, 0), rgba=(0, 0, 1, 1.0), owner=(3, 0))
    expected = 0.25 * np.array([0, 1, 0]) + 0.75 * (0.5 * np.array([1, 0, 0]) + 0.5 * np.array([0, 0, 1]))
    for order in ([red, green, blue], [blue, green, red], [green, blue, red]):
        image = picture(order, DOWN, light=UNLIT)
        assert np.abs(image.rgba[10, 10, :3] - 255 * expected).max() <= 1.0
        assert image.rgba[10, 10, 3] == 255


def test_depth_and_ids_are_those_of_the_nearest_surface(shape, picture):
    glass = shape(PANE, (0, 0, 2), rgba=(0, 1, 0, 0.25), owner=(2, 7))
    image = picture([glass, shape(PANE, owner=(3, 0))], DOWN)
    assert image.depth[10, 10] == pytest.approx(3.0)
    assert image.segmentation[10, 10].tolist() == [2, 7]


def test_shapes_behind_an_opaque_one_are_hidden(shape, picture):
    image = picture(
        [
            shape(PANE, (0, 0, 1), rgba=(1, 0, 0, 0.5)),
            shape(PANE, (0, 0, 2), rgba=(0, 0, 1, 1), owner=(4, 0)),
        ],
        DOWN,
        light=UNLIT,
    )
    assert image.rgba[10, 10].tolist() == [0, 0, 255, 255]
    assert image.segmentation[10, 10, 0] == 4


def test_shapes_with_alpha_zero_are_skipped(shape, picture):
    image = picture([shape(PANE, rgba=(1, 0, 0, 0.0))], DOWN)
    assert (image.segmentation == -1).all()
    assert (image.rgba == 255).all()


def test_the_two_triangles_of_a_pane_do_not_overlap_on_their_diagonal(shape, picture):
    image = picture([shape(PANE, rgba=(0, 0, 0, 0.5))], DOWN, light=UNLIT)
    seen = image.segmentation[..., 0] >= 0
    assert len(np.unique(image.rgba[seen], axis=0)) == 1


def test_an_infinite_pane_and_glass_on_a_transparent_background(shape, picture):
    pane = shape(PANE, rgba=(1, 0, 0, 0.5), infinite=True)
    image = picture([pane], DOWN, light=UNLIT, background=(0, 0, 0, 0))
    assert (np.abs(image.rgba.astype(int) - (128, 0, 0, 128)) <= 1).all()


def test_transparent_faces_of_an_opaque_mesh_are_blended(shape, picture):
    colors = np.array([[255, 0, 0, 255], [0, 255, 0, 51]], dtype=np.uint8)
    mesh = dataclasses.replace(PANE, colors=colors, normals=None, uv=None)
    image = picture([shape(mesh, rgba=(1, 1, 1, 1))], DOWN, light=UNLIT)
    # first triangle right and below the diagonal, second left and above it
    assert image.rgba[12, 13].tolist() == [255, 0, 0, 255]
    assert image.rgba[8, 7].tolist() == pytest.approx([204, 255, 204, 255], abs=1)


def test_texture_alpha(shape, picture):
    texture = np.zeros((1, 1, 4), dtype=np.uint8)
    texture[0, 0] = (0, 0, 0, 51)
    image = picture([shape(PANE, rgba=(1, 1, 1, 1), texture=texture)], DOWN, light=UNLIT)
    assert image.rgba[10, 10, 0] == pytest.approx(204, abs=1)


def test_transparent_shapes_cast_no_shadow(shape, picture, floor):
    roof = shape(PANE, (0, 0, 1.0), rgba=(0, 0, 1, 0.5), owner=(1, 0))
    side = Camera.look_at((0.0, -4.0, 0.6), (0.0, 0.0, 0.2), width=60, height=40)
    image = picture([floor, roof], side)
    ground = image.segmentation[..., 0] == 9
    assert len(np.unique(image.rgba[ground & (image.depth < 3)], axis=0)) == 1
