from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image as Pillow

from roboyard.rendering import (
    Camera,
    contact_sheet,
    depth_to_rgb,
    save_gif,
    save_png,
    segmentation_to_rgb,
    side_by_side,
)
from roboyard.shapes import primitives

CAMERA = Camera.look_at((0.9, -1.4, 0.8), (0, 0, 0.1), width=64, height=48)


@pytest.fixture
def image(shape, picture, floor):
    return picture([floor, shape(primitives.sphere(0.3), (0, 0, 0.3), rgba=(0.8, 0.2, 0.1, 1.0))], CAMERA)


def test_a_png_round_trip_keeps_every_pixel(image, tmp_path):
    path = save_png(tmp_path / "a.png", image)
    with Pillow.open(path) as back:
        assert np.array_equal(np.asarray(back), image.rgb)
    with Pillow.open(io.BytesIO(image._repr_png_())) as back:
        assert back.size == (64, 48)


def test_alpha_is_kept_unless_opaque_everywhere(tmp_path):
    pixels = np.zeros((4, 5, 4), dtype=np.uint8)
    pixels[..., 3] = np.arange(20).reshape(4, 5)
    with Pillow.open(save_png(tmp_path / "a.png", pixels)) as back:
        assert np.array_equal(np.asarray(back), pixels)


@pytest.mark.parametrize("fps", [20.0, 24.0, 50.0])
def test_an_animation_keeps_frames_rate_and_nearly_the_colours(fps, shape, picture, floor, tmp_path):
    frames = [
        picture([floor, shape(primitives.sphere(0.3), (x, 0, 0.3), rgba=(0.8, 0.2, 0.1, 1.0))], CAMERA)
        for x in np.linspace(-0.4, 0.4, 12)
    ]
    path = save_gif(tmp_path / "a.gif", frames, fps=fps)
    with Pillow.open(path) as gif:
        assert gif.n_frames == 12
        assert gif.info["loop"] == 0
        total = 0
        for k, frame in enumerate(frames):
            gif.seek(k)
            total += gif.info["duration"]
            difference = np.abs(np.asarray(gif.convert("RGB")).astype(int) - frame.rgb)
            assert difference.mean() < 4.0
        assert total == pytest.approx(12000 / fps, abs=6)


def test_invalid_animations_name_the_fault(image, tmp_path):
    with pytest.raises(ValueError, match="at least one"):
        save_gif(tmp_path / "a.gif", [])
    with pytest.raises(ValueError, match="same size"):
        save_gif(tmp_path / "a.gif", [image, np.zeros((3, 3, 3), dtype=np.uint8)])
    with pytest.raises(ValueError, match="fps"):
        save_gif(tmp_path / "a.gif", [image], fps=240)
    with pytest.raises(ValueError, match="uint8"):
        save_png(tmp_path / "a.png", image.depth)
    assert not list(tmp_path.iterdir())


def test_sheets_place_their_tiles():
    tiles = [np.full((4, 6, 3), value, dtype=np.uint8) for value in (10, 20, 30)]
    sheet = contact_sheet(tiles, columns=2, gap=1)
    assert sheet.shape == (9, 13, 3)
    assert (sheet[0, 0, 0], sheet[0, 12, 0], sheet[8, 0, 0], sheet[8, 12, 0]) == (10, 20, 30, 255)
    assert (sheet[4] == 255).all()
    assert side_by_side(*tiles, gap=0).shape == (4, 18, 3)


def test_depth_colours_change_from_near_to_far(image):
    rgb = depth_to_rgb(image)
    missing = ~np.isfinite(image.depth)
    assert (rgb[missing] == 255).all()
    order = np.argsort(image.depth[~missing])
    brightness = rgb[~missing].sum(axis=-1)[order].astype(int)
    assert brightness[0] > brightness[-1]
    assert (np.diff(brightness) <= 3).all()


def test_ids_have_one_colour_each():
    ids = np.array([[[-1, -1], [0, -1], [0, 0], [0, 1], [1, -1], [1, 0]]])
    rgb = segmentation_to_rgb(ids)[0]
    assert (rgb[0] == 255).all()
    assert len({tuple(color) for color in rgb.tolist()}) == 6
    assert np.array_equal(segmentation_to_rgb(ids[:, 3:])[0], rgb[3:])
