"""The bar in small and large windows: it hides no robot, and every control stays within reach."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import Camera, World, add_robot
from roboyard.sim.queries.default_view import fitted_points

pytest.importorskip("viser")
from roboyard.viewer import Viewer

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
BOXES = """(() => {
  const bar = document.querySelector('.roboyard-bar'), canvas = window.__viserMutable?.canvas;
  if (!bar || !canvas) return null;
  const box = e => { const b = e.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; };
  return {bar: box(bar), canvas: box(canvas), inner: [innerWidth, innerHeight],
    controls: [...bar.children].map(box)};
})()"""


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[tuple[Viewer, chromium.Page, Any]]:
    world = World()
    world.add_plane()
    add_robot(world, "r1")  # tall: its head is in the uppermost tenth of the picture
    viewer = Viewer(world, port=0, quiet=True)
    page = chromium.Page(viewer.url, tmp_path / "profile", (1280, 800))
    client = until(lambda: next(iter(viewer.server.get_clients().values()), None))
    yield viewer, page, client
    page.close()
    viewer.close()


def top_of(viewer: Viewer, client: Any) -> float:
    """Return how far below the upper edge of the picture the highest point of the robot is (pixels)."""
    c = client.camera
    camera = Camera.look_at(
        c.position, c.look_at, width=c.image_width, height=c.image_height, fovy=float(c.fov)
    )
    points = fitted_points(viewer.world.bodies)
    clip = np.c_[points, np.ones(len(points))] @ (camera.projection @ camera.view).T
    return float((0.5 - 0.5 * (clip[:, 1] / clip[:, 3]).max()) * c.image_height)


@pytest.mark.parametrize(
    ("size", "is_strip"),
    [((900, 457), True), ((800, 600), True), ((1280, 800), False), ((2560, 1440), False)],
)
def test_the_bar_hides_no_robot_and_all_its_controls_are_seen(
    opened: tuple[Viewer, chromium.Page, Any], size: tuple[int, int], is_strip: bool
) -> None:
    viewer, page, client = opened
    page.resize(*size)

    def placed() -> dict[str, Any] | None:
        """Return the boxes, once the panel is docked and the camera has the size of the window."""
        boxes = page.evaluate(BOXES)
        if not boxes or boxes["inner"] != list(size):
            return None
        width = boxes["canvas"][2] - boxes["canvas"][0]
        docked = 100 < width < size[0] - 100 and abs(client.camera.image_width - width) < 2
        middle = (boxes["bar"][0] + boxes["bar"][2]) / 2
        return boxes if docked and abs(middle - (boxes["canvas"][0] + width / 2)) < 1 else None

    boxes = until(placed)
    left, top, right, bottom = boxes["bar"]
    assert bottom - top <= (30 if is_strip else 40)
    assert (top == 0) is is_strip
    for control in boxes["controls"]:
        assert left <= control[0] < control[2] <= right
        assert top <= control[1] < control[3] <= bottom
        assert control[2] - control[0] >= 20
    assert len(boxes["controls"]) == 10
    until(lambda: top_of(viewer, client) > bottom)
