"""Decoded images on disk agree with Pillow's; what is damaged, too small or too large is not kept."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from roboyard.shapes.readers import external_files, image_store
from roboyard.shapes.readers.external_files import clear_images, load_image_file
from roboyard.shapes.readers.image_store import image_key, store_image, stored_image

RANDOM = np.random.default_rng(7)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(image_store, "user_cache", lambda: str(tmp_path / "cache"))
    clear_images()
    return tmp_path / "cache" / "images"


def picture(height: int = 70, width: int = 90) -> np.ndarray:
    return RANDOM.integers(0, 256, (height, width, 4)).astype(np.uint8)


def png(image: np.ndarray) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(image).save(stream, "PNG")
    return stream.getvalue()


@pytest.mark.parametrize("channels", [3, 4])
def test_an_image_is_decoded_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, channels: int) -> None:
    expected = picture()
    if channels == 3:
        expected[..., 3] = 255
    file = tmp_path / "texture.png"
    file.write_bytes(png(expected[..., :channels]))
    np.testing.assert_array_equal(load_image_file(file, "texture"), expected)
    clear_images()
    monkeypatch.setattr(external_files, "decode_image", lambda *_: pytest.fail("decoded again"))
    again = load_image_file(file, "texture")
    assert again is not None and not again.flags.writeable
    np.testing.assert_array_equal(again, expected)


def test_another_content_is_another_image(tmp_path: Path) -> None:
    file = tmp_path / "texture.png"
    for expected in (picture(), picture(), picture(90, 70)):
        file.write_bytes(png(expected))
        clear_images()
        np.testing.assert_array_equal(load_image_file(file, "texture"), expected)


@pytest.mark.parametrize("place", [0, 9, 17, -1])
def test_a_damaged_file_counts_as_absent(folder: Path, place: int) -> None:
    key, image = image_key(b"content"), picture()
    store_image(key, image)
    np.testing.assert_array_equal(stored_image(key), image)
    whole = (folder / key).read_bytes()
    damaged = bytearray(whole)
    damaged[place] ^= 1
    for content in (bytes(damaged), whole[:-1], whole + b"0", whole[:10], b""):
        (folder / key).write_bytes(content)
        assert stored_image(key) is None


def test_small_large_and_too_many_images_are_not_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image_store, "MOST_PIXELS", 70 * 90)
    monkeypatch.setattr(image_store, "MOST_BYTES", 2 * 4 * 70 * 90 + 100)
    store_image("small", picture(8, 8))
    store_image("large", picture(71, 90))
    assert not folder.exists()
    for k in range(4):
        store_image(f"image{k}", picture())
    assert sorted(file.name for file in folder.iterdir()) == ["image0", "image1"]


def test_without_a_place_images_are_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "taken").write_text("a file")
    monkeypatch.setattr(image_store, "user_cache", lambda: str(tmp_path / "taken"))
    file, expected = tmp_path / "texture.png", picture()
    file.write_bytes(png(expected))
    np.testing.assert_array_equal(load_image_file(file, "texture"), expected)
