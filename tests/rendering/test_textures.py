"""The compiled texture sampling against a plain one in doubles."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering import UNLIT, Camera, RenderScene
from roboyard.rendering.kernels.textures import COLORS, SINGLE, WHOLE, sample_textures
from roboyard.rendering.scene_arrays import scene_arrays
from roboyard.rendering.textures import pack
from roboyard.shapes import primitives

WIDTH, HEIGHT, REPEAT = 60, 44, 3.0
CAMERAS = {
    "near": Camera.look_at((0.3, -0.5, 0.6), (0.1, 0.0, 0.0), width=WIDTH, height=HEIGHT),
    "slanted": Camera.look_at((0.9, -2.5, 0.4), (0.0, 0.0, 0.0), width=WIDTH, height=HEIGHT),
    "far": Camera.look_at((0.0, -3.0, 25.0), (0.0, 0.0, 0.0), width=WIDTH, height=HEIGHT, fovy=0.1),
    "parallel": Camera.orthographic((1.0, -2.0, 1.5), (0.0, 0.0, 0.0), width=WIDTH, height=HEIGHT),
}


def painting():
    """Return an image of odd size with smooth parts, plain parts, noise and transparency."""
    random = np.random.default_rng(7)
    rows, columns = np.indices((23, 37))
    image = np.stack([rows * 11, columns * 6, rows * columns % 256, 255 - rows], axis=-1)
    image[5:15, 8:20] = 40, 90, 200, 255
    image[:, 28:] = random.integers(0, 256, (23, 9, 4))
    return image.astype(np.uint8)


def on_floor(camera, columns, rows):
    """Return (n, 2) texture coordinates, and (n, 2) x and y (m), of the plane z = 0 at pixel positions."""
    p = camera.pixel_matrix[:, [0, 1, 3]].copy()
    if not camera.is_perspective:
        p[2] = 0.0, 0.0, 1.0
    points = np.linalg.solve(p, np.stack([columns, rows, np.ones_like(columns)]))
    at = (points[:2] / points[2]).T
    return (0.5 * at + 0.5) * REPEAT, at


def bilinear(level, uv):
    height, width = level.shape[:2]
    x, y = uv[0] * width - 0.5, (1.0 - uv[1]) * height - 0.5
    i, j = int(np.floor(x)), int(np.floor(y))
    fx, fy = x - i, y - j
    corner = [[level[(j + b) % height, (i + a) % width].astype(float) for a in (0, 1)] for b in (0, 1)]
    upper, lower = ((1 - fx) * c[0] + fx * c[1] for c in corner)
    return (1 - fy) * upper + fy * lower


def plain_sample(image, camera, column, row):
    """Return the colour (4,) at the centre of a pixel, footprint by central differences."""
    texels, table = pack([image])
    levels = [
        texels[start : start + w * h].view(np.uint8).reshape(h, w, 4) for start, w, h in table[0].tolist()
    ]
    step = 1e-4
    here = np.array([column + 0.5, row + 0.5])
    sides = []
    for axis in np.eye(2):
        ends = np.stack([here - step * axis, here + step * axis])
        uv = on_floor(camera, ends[:, 0], ends[:, 1])[0]
        sides.append(np.linalg.norm((uv[1] - uv[0]) / (2 * step) * image.shape[1::-1]))
    side = max(np.sqrt(sides[0] * sides[1]), 0.5 * max(sides))
    level = 0
    while side > 2.0 and level < len(levels) - 2:
        side, level = side / 2.0, level + 1
    part = min(max(3.0 * side - 4.0, 0.0), 1.0)
    uv = on_floor(camera, here[:1], here[1:])[0][0]
    return (1 - part) * bilinear(levels[level], uv) + part * bilinear(levels[level + 1], uv)


@pytest.mark.parametrize("opaque", [True, False])
@pytest.mark.parametrize("name", CAMERAS)
def test_pixels_of_a_textured_floor(name, opaque, shape, picture):
    camera, image = CAMERAS[name], painting()
    if opaque:
        image[..., 3] = 255
    floor = shape(primitives.plane(1.0, 1.0, REPEAT), texture=image, rgba=(1, 1, 1, 1))
    over_black = picture([floor], camera, light=UNLIT, background=(0, 0, 0)).rgba
    compared = 0
    for row in range(0, HEIGHT, 3):
        for column in range(0, WIDTH, 2):
            at = on_floor(camera, np.array([column + 0.5]), np.array([row + 0.5]))[1][0]
            if np.abs(at).max() > 0.97:
                continue
            color = plain_sample(image, camera, column, row)
            expected = color[:3] * color[3] / 255.0
            # colours are rounded to integers twice, weights to 256ths
            assert np.abs(over_black[row, column, :3] - expected).max() < 4.0, (row, column)
            compared += 1
    assert compared > 30


def test_invalid_texture_coordinates_read_only_the_texture():
    """Mesh files may contain any number; each texel that is read is inside the image."""
    texels, table = pack([painting()])
    for bad in (np.nan, np.inf, -np.inf, 1e30, -1e30):
        out = np.zeros(4, dtype=np.uint32)
        sample_textures(
            np.zeros(4, dtype=np.int64), np.ones(4, dtype=np.float32), 0, 1, 4, True, np.zeros((3, 3)),
            np.array([[0.0, 0.0, 1.0], [1e-3, 0.0, 0.0], [0.0, 1e-3, 0.0]]),
            np.eye(3, 4)[None].copy(), np.eye(3)[None].copy(), np.zeros((1, 7), dtype=np.int32),
            np.array([[0, 1, 2]], dtype=np.int32),
            np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], dtype=np.float32),
            np.full((1, 3, 2), bad, dtype=np.float32), texels, table, np.empty((3, 6)),
            np.empty(SINGLE, dtype=np.float32), np.empty(WHOLE, dtype=np.int32),
            np.empty(COLORS, dtype=np.uint32), out,
        )  # fmt: skip
        assert set(out.tolist()) - {0}  # written, in any colour


def test_textures_are_packed_again_only_when_they_change(shape):
    image = painting()
    image.flags.writeable = False
    scene = RenderScene(shapes=[shape(primitives.plane(1.0, 1.0, REPEAT), texture=image)])
    first = scene_arrays(scene)
    scene.revision += 1
    assert scene_arrays(scene).texels is first.texels
    for other in (image[::-1].copy(), image.copy()):  # two that a program may write into
        scene.shapes = [shape(primitives.plane(1.0, 1.0, REPEAT), texture=other)]
        for red in (1, 2):
            other[:, :, 0] = red
            scene.revision += 1
            texels = scene_arrays(scene).texels
            np.testing.assert_array_equal(texels, pack([other])[0])
