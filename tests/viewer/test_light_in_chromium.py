"""The light of a real page against `World.render`: the same direction, and nearly the same picture."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import Camera, World
from roboyard.rendering.light import Light

pytest.importorskip("viser")
from roboyard.viewer import Viewer

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
CENTER, RADIUS = np.array([0.0, 0.0, 0.5]), 0.5
CANVAS = "(b => [b.left, b.top, b.width, b.height])(window.__viserMutable.canvas.getBoundingClientRect())"
SUN = """(() => {
  let found = null;
  window.__viserMutable?.scene?.traverse(o => {
    if (!o.isDirectionalLight || o.position.length() < 1) return;  // the sun is several lights
    const way = o.position.clone().sub(o.target.position).normalize();
    found = [-way.z, -way.x, way.y];
  });
  return found;
})()"""
"""JavaScript for the direction to the sun in the world frame; three.js has y up."""
EYE = "(p => [-p.z, -p.x, p.y])(window.__viserMutable.cameraControl.getPosition(undefined, true))"
Opened = tuple[Viewer, chromium.Page, Any, Any]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    world = World()
    world.add_plane()
    ball = world.add_sphere(RADIUS, position=CENTER, rgba=(0.6, 0.6, 0.6, 1.0), mass=0.0)
    viewer = Viewer(world, port=0, quiet=True, follow_steps=False)
    page = chromium.Page(viewer.url, tmp_path_factory.mktemp("page") / "profile", (1000, 700))
    client = until(lambda: next(iter(viewer.server.get_clients().values()), None))
    until(lambda: page.choose_quality("normal"))
    yield viewer, page, client, ball
    page.close()
    viewer.close()


def pictures(opened: Opened, direction: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray, Any]:
    """Return the page's picture, that of `World.render` from the same place, (h, w, 3), and the camera."""
    viewer, page, client, _ = opened
    viewer.light.set_direction(direction)
    eye, target = (1.6, -1.9, 1.7), (0.0, 0.0, 0.35)
    with client.atomic():
        client.camera.position, client.camera.look_at = eye, target
    unit = np.array(direction) / np.linalg.norm(direction)
    until(lambda: np.abs(np.array(page.evaluate(SUN) or 9.0) - unit).max() < 1e-3)
    until(lambda: np.abs(np.array(page.evaluate(EYE)) - eye).max() < 1e-3)
    last = [page.picture()]

    def is_still() -> bool:
        last.append(page.picture())
        return bool(np.abs(last[-1] - last[-2]).max() < 3)

    until(lambda: is_still() and is_still())
    left, top, width, height = (round(value) for value in page.evaluate(CANVAS))
    camera = Camera.look_at(eye, target, width=width, height=height, fovy=float(client.camera.fov))
    image = viewer.world.render(camera, light=Light(direction=direction), shadow=True, backend="software")
    return last[-1][top : top + height, left : left + width], image.rgb[..., :3].astype(np.int16), camera


def sphere_pixels(camera: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the (n, 2) rows and columns of a camera's pixels on the sphere, and its (n, 3) normals there."""
    to_world = np.linalg.inv(camera.projection @ camera.view)
    rows, columns = np.mgrid[: camera.height, : camera.width]
    x, y = 2.0 * (columns + 0.5) / camera.width - 1.0, 1.0 - 2.0 * (rows + 0.5) / camera.height
    far = np.stack([x, y, np.ones_like(x), np.ones_like(x)], axis=-1) @ to_world.T
    eye = np.linalg.inv(camera.view)[:3, 3]
    way = far[..., :3] / far[..., 3:] - eye
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    middle = way @ (eye - CENTER)
    root = middle**2 - (eye - CENTER) @ (eye - CENTER) + RADIUS**2
    hit = root > (0.15 * RADIUS) ** 2  # not the outermost pixels
    points = eye + (-middle - np.sqrt(np.where(hit, root, 0.0)))[..., None] * way
    return np.argwhere(hit), ((points - CENTER) / RADIUS)[hit]


def light_of(picture: np.ndarray, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the horizontal direction, (2,), from which a matte sphere is lit: brightness = a + b · n."""
    grey = picture[places[:, 0], places[:, 1]].mean(axis=1)
    b = np.linalg.lstsq(np.c_[normals, np.ones(len(normals))], grey, rcond=None)[0][:2]
    return b / np.linalg.norm(b)


@pytest.mark.parametrize("direction", [(-0.35, -0.75, 1.1), (1.0, -0.8, 0.9), (-1.0, -0.6, 0.7)])
def test_the_page_is_lit_from_where_world_render_is(
    opened: Opened, direction: tuple[float, float, float]
) -> None:
    shown, rendered, camera = pictures(opened, direction)
    places, normals = sphere_pixels(camera)
    assert len(places) > 3000
    lights = [light_of(picture, places, normals) for picture in (shown, rendered)]
    turn = np.degrees(np.arccos(np.clip(lights[0] @ lights[1], -1.0, 1.0)))
    difference = np.abs(shown - rendered)[tuple(places.T)].mean()
    assert turn < 15.0  # 4 to 12 degrees: the page has a fill light, World.render has none
    assert difference < 32.0  # 14 to 30 of 255


def test_a_page_lit_from_elsewhere_is_noticed(opened: Opened) -> None:
    shown, _, camera = pictures(opened, (1.0, -0.8, 0.9))
    light = Light(direction=(-1.0, -0.6, 0.7))
    other = opened[0].world.render(camera, light=light, backend="software").rgb[..., :3].astype(np.int16)
    places, normals = sphere_pixels(camera)
    lights = [light_of(picture, places, normals) for picture in (shown, other)]
    assert lights[0] @ lights[1] < 0.5
