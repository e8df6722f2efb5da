"""Light of rows longer than the runs that are shaded at a time, against the same law in doubles."""

from __future__ import annotations

import numpy as np
import pytest

from roboyard.rendering import Camera, Light, RenderScene, render
from roboyard.rendering.kernels.runs import RUN
from roboyard.shapes import primitives

WIDTH, HEIGHT = 2 * RUN + 77, 12
LIGHT = Light(
    direction=(0.4, -0.3, 0.8), color=(1.0, 0.8, 0.6), ambient=0.2, diffuse=0.5, specular=0.4, sky=0.3
)


def lit(camera, image, rgb, specular):
    """Return (height, width, 3) colours of a floor z = 0, 0 to 1: ambient, sun, sky and Blinn's highlight."""
    sun = np.array(LIGHT.direction) / np.linalg.norm(LIGHT.direction)
    _, directions = camera.rays()
    view = -directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    middle = sun + view
    cosine = middle[..., 2] / np.linalg.norm(middle, axis=-1)
    shine = LIGHT.specular * specular * np.maximum(cosine, 0.0) ** 32
    amount = LIGHT.diffuse * ((1.0 - LIGHT.sky) * max(sun[2], 0.0) + LIGHT.sky)
    color = np.array(LIGHT.color)
    out = np.array(rgb) * (LIGHT.ambient + amount * color) + shine[..., None] * color
    return np.where(np.isfinite(image.depth)[..., None], np.minimum(out, 1.0), 1.0)


@pytest.mark.parametrize("parallel", [False, True])
def test_long_rows_of_a_shiny_floor(parallel, shape, picture):
    eye, target = (1.0, -2.0, 1.5), (0.2, 0.3, 0.0)
    if parallel:
        camera = Camera.orthographic(eye, target, width=WIDTH, height=HEIGHT, extent=0.2)
    else:
        camera = Camera.look_at(eye, target, width=WIDTH, height=HEIGHT, fovy=0.15)
    rgb = (0.5, 0.3, 0.7)
    floor = shape(primitives.plane(1.0, 1.0), infinite=True, rgba=(*rgb, 1.0), specular=0.8)
    image = picture([floor], camera, light=LIGHT, shadow=False)
    expected = 255.0 * lit(camera, image, rgb, 0.8)
    assert np.isfinite(image.depth).mean() > 0.9
    assert np.abs(image.rgb - expected).max() <= 1.0


@pytest.mark.parametrize("parallel", [False, True])
def test_scenes_far_from_the_origin_look_the_same(parallel, shape, floor):
    """Light, shadow and textures are computed in single precision from the camera's place."""
    ball = shape(primitives.sphere(0.3), position=(0.1, 0.0, 0.5), rgba=(0.9, 0.5, 0.2, 1.0))
    scene = RenderScene(shapes=[floor, ball])
    images = []
    for offset in (np.zeros(3), np.array([2000.0, -1500.0, 300.0])):
        eye, target = np.array([1.6, -1.2, 1.1]) + offset, np.array([0.0, 0.0, 0.3]) + offset
        make = Camera.orthographic if parallel else Camera.look_at
        camera = make(eye, target, width=160, height=120)
        images.append(render(scene, offset[None], np.eye(3)[None], camera, backend="software"))
    near, far = images
    differ = (near.segmentation != far.segmentation).any(axis=-1)
    assert differ.mean() < 0.002
    colors = np.abs(near.rgba.astype(int) - far.rgba).max(axis=-1)
    assert np.median(colors) == 0
    assert (colors[~differ] > 12).mean() < 0.005
    assert near.rgba[..., 0][near.segmentation[..., 0] == 9].min() < 150  # there is a shadow
