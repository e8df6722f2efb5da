"""The camera of real pages: ten robots in the frame, narrow windows, new bodies, the filmed tab."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import Camera, World, add_robot
from roboyard.robots import REGISTERED_ROBOTS
from roboyard.sim.queries.default_view import FILL, fitted_points

pytest.importorskip("viser")
from roboyard.viewer import Viewer
from roboyard.viewer.driving import DrivingPage

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
MARGIN = FILL + 0.03


def world_of(robot: str) -> World:
    world = World()
    world.add_plane()
    add_robot(world, robot)
    return world


def seen_by(client: Any) -> Camera:
    camera = client.camera
    return Camera.look_at(
        camera.position,
        camera.look_at,
        width=camera.image_width,
        height=camera.image_height,
        fovy=camera.fov,
    )


def largest_share(client: Any, points: np.ndarray) -> float:
    """Return the largest share of half the frame, in width or height, that the points cover."""
    camera = seen_by(client)
    clip = np.c_[points, np.ones(len(points))] @ (camera.projection @ camera.view).T
    return float(np.abs(clip[:, :2] / clip[:, 3:]).max()) if (clip[:, 3] > 0).all() else 9.0


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[tuple[Viewer, chromium.Page, Any]]:
    viewer = Viewer(world_of("r1"), port=0, quiet=True)
    page = chromium.Page(viewer.url, tmp_path / "profile", (1280, 800))
    client = until(lambda: next(iter(viewer.server.get_clients().values()), None))
    until(lambda: page.evaluate("!!window.__viserMutable?.cameraControl"))
    yield viewer, page, client
    page.close()
    viewer.close()


def is_fitted(viewer: Viewer, client: Any) -> bool:
    return 0.5 < largest_share(client, fitted_points(viewer.world.bodies)) < MARGIN


def test_ten_robots_are_in_the_frame_one_after_another(opened: tuple[Viewer, chromium.Page, Any]) -> None:
    viewer, _, client = opened
    names = sorted(REGISTERED_ROBOTS)[:10]
    for name in names:
        viewer.show_world(world_of(name))
        until(lambda: is_fitted(viewer, client))


def test_a_narrowed_window_moves_the_camera_back_unless_it_was_moved(
    opened: tuple[Viewer, chromium.Page, Any],
) -> None:
    viewer, page, client = opened
    viewer.show_world(world_of("rover"))  # wider than high
    until(lambda: is_fitted(viewer, client))
    far = [distance(client)]
    for width, height in ((700, 1000), (1800, 700)):
        page.resize(width, height)
        until(lambda height=height: client.camera.image_height == height and is_fitted(viewer, client))
        until(lambda: is_settled(page, client) and is_fitted(viewer, client))
        far.append(distance(client))
    assert far[1] > 1.15 * far[0]
    page._call("Input.dispatchMouseEvent", type="mouseWheel", x=300, y=300, deltaX=0, deltaY=-400)
    until(lambda: distance(client) < 0.9 * far[2])
    until(lambda: is_settled(page, client))
    mine = np.array(client.camera.position)
    page.resize(800, 1000)
    until(lambda: client.camera.image_height == 1000)
    until(lambda: is_settled(page, client))
    np.testing.assert_allclose(client.camera.position, mine, atol=0.01)


def distance(client: Any) -> float:
    return float(np.linalg.norm(client.camera.position - client.camera.look_at))


def is_settled(page: chromium.Page, client: Any) -> bool:
    """Return whether camera and size of its picture stay for 0.8 s, where the page is going to."""
    goal = page.evaluate("(p => [-p.z, -p.x, p.y])(window.__viserMutable.cameraControl.getPosition())")
    if np.abs(client.camera.position - goal).max() > 1e-3:
        return False
    seen = [(*client.camera.position, client.camera.image_width)]
    for _ in range(8):
        time.sleep(0.1)
        seen.append((*client.camera.position, client.camera.image_width))
    return bool(np.ptp(seen, axis=0).max() < 1e-3)


def test_a_body_added_outside_the_frame_is_fitted(opened: tuple[Viewer, chromium.Page, Any]) -> None:
    viewer, page, client = opened
    until(lambda: is_settled(page, client) and is_fitted(viewer, client))
    before = np.array(client.camera.position)
    viewer.world.add_box(size=(0.1, 0.1, 0.1), position=(0.2, 0.3, 0.05))  # inside: nothing moves
    viewer.sync()
    time.sleep(0.5)
    np.testing.assert_allclose(client.camera.position, before, atol=1e-3)
    viewer.world.add_box(size=(0.1, 0.1, 0.1), position=(0.0, -4.0, 0.05))
    viewer.sync()
    until(lambda: is_settled(page, client) and is_fitted(viewer, client))
    assert np.linalg.norm(client.camera.position - before) > 0.5


def test_a_video_shows_the_tab_that_started_it(tmp_path: Path) -> None:
    drive = DrivingPage({"scene": "empty", "robot": "rover"}, port=0, folder=tmp_path, quiet=True)
    pages = []
    try:
        for number in range(2):
            pages.append(chromium.Page(drive.viewer.url, tmp_path / f"profile {number}"))
            until(lambda count=number + 1: len(drive.viewer.server.get_clients()) == count)
        first, second = (client for _, client in sorted(drive.viewer.server.get_clients().items()))
        until(lambda: pages[1].place_at_rest(pages[1].with_text("Video")))
        until(lambda: pages[1].evaluate("!!window.__viserMutable.cameraControl"))
        pages[1]._call("Input.dispatchMouseEvent", type="mouseWheel", x=200, y=300, deltaX=0, deltaY=-500)
        until(lambda: np.linalg.norm(first.camera.position - second.camera.position) > 0.2)
        pages[1].click_on(pages[1].with_text("Video"))
        pages[1].click_on(pages[1].with_text("Record"))
        until(lambda: drive.recording.writer is not None, tick=lambda: drive.tick(0.02))
        pages[0].click(200, 300)  # another tab used meanwhile
        until(lambda: drive.viewer.last_used.client.client_id == first.client_id)
        until(lambda: is_settled(pages[1], second))
        drive.tick(0.02)
        assert drive.filmed_client == second.client_id
        shown = np.linalg.inv(drive.camera().view)[:3, 3]
        np.testing.assert_allclose(shown, second.camera.position, atol=1e-3)
        # without a tab that started it: the one used last
        drive.stop_video()
        drive.filmed_client = None
        until(lambda: is_settled(pages[0], first))
        np.testing.assert_allclose(
            np.linalg.inv(drive.camera().view)[:3, 3], first.camera.position, atol=1e-3
        )
    finally:
        for page in pages:
            page.close()
        drive.close()
