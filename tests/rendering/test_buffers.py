"""Arrays of pictures, which are used again once nothing refers to them."""

from __future__ import annotations

import numpy as np

from roboyard.rendering.buffers import result


def test_arrays_that_are_kept_are_not_written_again():
    kept = [result("kept", (50, 4), np.uint8) for _ in range(6)]
    views = [result("views", (50, 4), np.uint8).view(np.uint32).reshape(5, 10) for _ in range(6)]
    memory = [result("memory", (50, 4), np.uint8).data for _ in range(6)]
    for arrays in (kept, views, [np.asarray(m) for m in memory]):
        assert len({array.__array_interface__["data"][0] for array in arrays}) == 6


def test_arrays_that_were_dropped_are_used_again():
    places = {result("dropped", (50, 4), np.uint8).__array_interface__["data"][0] for _ in range(6)}
    assert len(places) == 1


def test_the_shape_and_the_type_are_those_asked_for():
    for shape, dtype in (((3,), np.uint8), ((4,), np.uint8), ((3,), np.float32), ((2, 2), np.int32)):
        array = result("asked", shape, dtype)
        assert array.shape == shape
        assert array.dtype == dtype


def test_pictures_keep_their_pixels(shape, picture):
    """A picture is not changed by later ones of the same size."""
    from roboyard.rendering import Camera
    from roboyard.shapes import primitives

    camera = Camera.look_at((2.0, 0.0, 1.0), (0.0, 0.0, 0.0), width=40, height=30)
    images = [picture([shape(primitives.box(k / 3, 1.0, 1.0))], camera) for k in range(1, 5)]
    copies = [(image.rgba.copy(), image.depth.copy(), image.segmentation.copy()) for image in images]
    again = [picture([shape(primitives.box(k / 3, 1.0, 1.0))], camera) for k in range(1, 5)]
    for image, second, copy in zip(images, again, copies, strict=True):
        for one in (image, second):
            for array, expected in zip((one.rgba, one.depth, one.segmentation), copy, strict=True):
                assert np.array_equal(array, expected)
