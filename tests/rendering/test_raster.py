"""The compiled rasteriser against a plain one in exact integers."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering.kernels import raster

WIDTH, HEIGHT = 24, 18
STEP = 1024  # snapped positions, in units of 1/1024 pixel


def plain_raster(triangles, q_far):
    """Return triangle number and nearness of each pixel; triangles (n, 3, 3) of column, row, nearness."""
    seen = np.full((HEIGHT, WIDTH), -1)
    nearness = np.full((HEIGHT, WIDTH), q_far)
    for number, triangle in enumerate(triangles):
        at = [(int(np.floor(c * STEP + 0.5)), int(np.floor(r * STEP + 0.5))) for c, r in triangle[:, :2]]
        q = [float(np.float32(v)) for v in triangle[:, 2]]
        area = cross(at[0], at[1], at[2])
        if area == 0:
            continue
        if area < 0:
            at[1], at[2], q[1], q[2] = at[2], at[1], q[2], q[1]
            area = -area
        for row in range(HEIGHT):
            for column in range(WIDTH):
                centre = column * STEP + STEP // 2, row * STEP + STEP // 2
                edges = [cross(at[k], at[(k + 1) % 3], centre) for k in range(3)]
                if all(e > 0 or (e == 0 and owns(at[k], at[(k + 1) % 3])) for k, e in enumerate(edges)):
                    here = (edges[1] * q[0] + edges[2] * q[1] + edges[0] * q[2]) / area
                    if here > nearness[row, column] + 1e-7:
                        seen[row, column], nearness[row, column] = number, here
    return seen, nearness


def cross(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def owns(a, b):
    """A pixel exactly on an edge belongs to the triangle that has it as its top or left edge."""
    return b[1] < a[1] or (b[1] == a[1] and b[0] > a[0])


def draw(triangles, q_far=0.0, cull=0):
    """Draw the same triangles by the compiled kernel, as points of an orthographic camera."""
    vertices = triangles.reshape(-1, 3).astype(np.float32)
    vertices[:, 2] *= -1.0  # depth
    faces = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    draws = np.array([[0, 0, len(vertices), 0, len(faces), cull]], dtype=np.int32)
    matrix = np.eye(3, 4)[None].copy()
    box = np.array([[vertices.min(axis=0), vertices.max(axis=0)]], dtype=float)
    seen = np.full(WIDTH * HEIGHT, -1, dtype=np.int64)
    nearness = np.full(WIDTH * HEIGHT, q_far, dtype=np.float32)
    count = len(vertices)
    raster.draw_meshes(
        draws, matrix, box, np.ascontiguousarray(vertices.T), faces, False, -1e9, 1e9, raster.RECORD,
        np.zeros(1, dtype=np.float32), nearness, seen, WIDTH, 0, HEIGHT, np.empty(count, dtype=np.int32),
        np.empty((2, count), dtype=np.int32), np.empty(count, dtype=np.float32),
        np.empty(raster.WHOLE, dtype=np.int32), np.empty(raster.SINGLE, dtype=np.float32),
        np.empty((7, 3)),
    )  # fmt: skip
    return seen.reshape(HEIGHT, WIDTH), nearness.reshape(HEIGHT, WIDTH)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("grid", [None, 0.5])
def test_random_triangles_match_the_plain_rasteriser(seed, grid):
    """With `grid`, corners are on pixel centres and edges, where the top-left rule applies."""
    rng = np.random.default_rng(seed)
    triangles = rng.uniform((-6, -6, 0.2), (WIDTH + 6, HEIGHT + 6, 5.0), (14, 3, 3))
    if seed % 3 == 0:
        triangles[:, 1:, :2] = triangles[:, :1, :2] + rng.uniform(-2.5, 2.5, (14, 2, 2))  # small ones
    if grid:
        triangles[..., :2] = np.round(triangles[..., :2] / grid) * grid
    triangles = triangles.astype(np.float32).astype(float)
    seen, nearness = draw(triangles)
    expected, expected_nearness = plain_raster(triangles, 0.0)
    assert np.array_equal(seen, expected)
    assert nearness == pytest.approx(expected_nearness, abs=2e-6)


def test_corners_far_outside_the_picture():
    """Beyond 2**20 pixels corners are not stored in whole steps; one triangle has only such corners."""
    far = 3.0e6
    triangles = np.array([
        [(-far, -far, 1), (far, -far, 1), (0, far, 1)],
        [(4, 3, 2), (far, 9, 2), (5, 15, 2)],
        [(-far, -far, 3), (-far, far, 3), (9, 8, 3)],
        [(far, far, 4), (far + 8, far, 4), (far, far + 8, 4)],
    ])  # fmt: skip
    seen, nearness = draw(triangles)
    expected, expected_nearness = plain_raster(triangles, 0.0)
    assert np.array_equal(seen, expected)
    assert set(seen.ravel()) == {0, 1, 2}
    assert nearness == pytest.approx(expected_nearness, abs=2e-6)


def test_a_fan_covers_every_pixel_once():
    """Triangles that share edges through pixel centres: no gap, no pixel twice."""
    rim = [(2, 1), (12, 1), (21.5, 1), (21.5, 9.5), (21.5, 16.5), (12, 16.5), (2, 16.5), (2, 9.5)]
    fan = np.array([[(12, 9, 1), (*rim[k], 1), (*rim[(k + 1) % 8], 1)] for k in range(8)], dtype=float)
    times = np.zeros((HEIGHT, WIDTH), dtype=int)
    for triangle in fan:
        times += draw(triangle[None])[0] >= 0
    inside = np.zeros_like(times)
    inside[1:16, 2:21] = 1
    assert np.array_equal(times, inside)


def test_culling_drops_one_winding_only():
    triangle = np.array([[(2, 2, 1), (2, 15, 1), (20, 2, 1)]], dtype=float)  # counter-clockwise as seen
    front, back = draw(triangle, cull=1)[0], draw(triangle[:, ::-1], cull=1)[0]
    assert (front >= 0).any()
    assert (back < 0).all()
    assert np.array_equal(draw(triangle, cull=0)[0], front)
    assert (draw(triangle[:, ::-1], cull=-1)[0] >= 0).any()
