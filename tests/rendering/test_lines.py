from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering import UNLIT, Camera, DebugLines, RenderScene, render
from roboyard.shapes import primitives

FRONT = Camera.look_at((0.0, -3.0, 0.0), (0.0, 0.0, 0.0), width=101, height=101)


def lines(*segments, rgb=(1.0, 0.0, 0.0), width=1.0):
    ends = np.array(segments, dtype=float)
    return DebugLines(
        start=ends[:, 0], end=ends[:, 1], rgb=np.tile(rgb, (len(ends), 1)), width=np.full(len(ends), width)
    )


def red(image):
    return image.rgba[..., 1] < 128


@pytest.mark.parametrize("camera", [FRONT, Camera.orthographic((0, -3, 0), (0, 0, 0), width=101, height=101)])
@pytest.mark.parametrize("width", [1.0, 5.0])
def test_a_line_covers_the_pixels_near_its_projection(camera, width, picture):
    a, b = np.array([-0.7, 0.3, -0.5]), np.array([0.6, -0.4, 0.7])
    image = picture([], camera, lines=lines((a, b), width=width))
    (x0, y0, _), (x1, y1, _) = camera.project([a, b])
    row, column = np.mgrid[0:101, 0:101] + 0.5
    d = np.array([x1 - x0, y1 - y0])
    t = np.clip(((column - x0) * d[0] + (row - y0) * d[1]) / (d @ d), 0, 1)
    distance = np.hypot(column - x0 - t * d[0], row - y0 - t * d[1])
    assert red(image)[distance < width / 2 - 0.1].all()
    assert not red(image)[distance > width / 2 + 0.1].any()
    assert red(image).sum() > 50 * width


def test_lines_are_hidden_behind_shapes_and_visible_on_their_surface(shape, picture):
    box = shape(primitives.box(0.5, 0.5, 0.5))
    behind = picture([box], FRONT, light=UNLIT, lines=lines(((-0.4, 1.0, 0), (0.4, 1.0, 0)), width=3))
    assert not red(behind)[50].any()
    on = picture([box], FRONT, light=UNLIT, lines=lines(((-0.4, -0.5, 0), (0.4, -0.5, 0)), width=3))
    assert (on.rgba[50, 45:56, :3] == (255, 0, 0)).all()
    assert np.array_equal(on.depth, behind.depth)


def test_a_line_past_the_camera_is_clipped_at_the_near_plane(picture):
    image = picture([], FRONT, lines=lines(((0.2, -6.0, 0.1), (0.2, 2.0, 0.1)), width=2))
    rows, columns = np.nonzero(red(image))
    assert len(rows) > 20
    # on the ray from the vanishing point outward, to the picture's edge
    assert (columns > 50).all()
    assert (rows < 50).all()
    assert not red(picture([], FRONT, lines=lines(((0, -6.0, 0), (0, -4.0, 0))))).any()


def test_lines_of_the_scene_and_of_the_call_are_both_drawn():
    scene = RenderScene(lines=lines(((-0.5, 0, 0.5), (0.5, 0, 0.5)), width=3))
    image = render(
        scene,
        np.zeros((1, 3)),
        np.eye(3)[None],
        FRONT,
        lines=lines(((-0.5, 0, -0.5), (0.5, 0, -0.5)), width=3),
    )
    up, down = (int(FRONT.project((0, 0, z))[1]) for z in (0.5, -0.5))
    assert red(image)[up, 50]
    assert red(image)[down, 50]
