"""The camera of a real page that drives: what hides the robot fades, and it follows smoothly."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import World
from roboyard.sim.queries import rays

pytest.importorskip("viser")
from roboyard.viewer import Viewer
from roboyard.viewer.scene.follow import Follow
from roboyard.viewer.scene.see_through import SeeThrough

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
FADED = "(window.__roboyardFaded ?? []).map(name => name.split('/')[1]).sort()"
GREEN = (0.0, 0.75, 0.1, 1.0)
FREE = (0.5, -4.0, 1.6)
"""Where nothing hides the robot (m)."""
EYES = """(() => {
  const c = window.__viserMutable.cameraControl, seen = window.__eyes = [];
  const go = () => {
    const p = c.getPosition(undefined, true), t = c.getTarget(undefined, true);
    seen.push([-p.z, -p.x, p.y, -t.z, -t.x, t.y]);  // three.js has y up
    window.__watching = requestAnimationFrame(go);
  };
  go();
})()"""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Viewer, chromium.Page, Any, Any]]:
    """Open a page with a green box as robot, a wall beside it and a cabinet behind it."""
    world = World()
    world.add_plane()
    robot = world.add_box(size=(0.4, 0.4, 1.0), position=(0.0, 0.0, 0.5), rgba=GREEN, name="robot")
    world.add_box(size=(0.1, 6.0, 2.0), position=(1.5, 0.0, 1.0), mass=0.0, name="wall")
    world.add_box(size=(0.5, 1.0, 1.2), position=(-1.5, 0.0, 0.6), mass=0.0, name="cabinet")
    viewer = Viewer(world, port=0, quiet=True, follow_steps=False)
    page = chromium.Page(viewer.url, tmp_path_factory.mktemp("page") / "profile")
    client = until(lambda: next(iter(viewer.server.get_clients().values()), None))
    until(lambda: look(client, FREE) or green(page) > 0.01)
    yield viewer, page, client, robot
    page.close()
    viewer.close()


def green(page: chromium.Page) -> float:
    """Return the fraction of the pixels in which green dominates."""
    picture = page.picture()[60:, :560]
    return float((picture[..., 1] > picture[..., [0, 2]].max(axis=2) + 25).mean())


def look(client: Any, eye: tuple[float, float, float]) -> None:
    with client.atomic():
        client.camera.position, client.camera.look_at = eye, (0.0, 0.0, 0.6)


def hiding(viewer: Viewer, robot: Any, eye: tuple[float, float, float]) -> list[str]:
    """Return the bodies between a point and three points of the robot, by rays on the collision shapes."""
    found = set()
    for height in (0.1, 0.5, 0.9):
        start = np.array(eye)
        end = np.array([*robot.position[:2], height])
        hit = rays.cast_one(viewer.world, start, end)
        while hit is not None and hit.link.body is not robot:
            found.add(hit.link.body.name)
            start = start + (hit.distance + 0.01) * (end - start) / np.linalg.norm(end - start)
            inside = hit.link.body
            hit = rays.cast_one(viewer.world, start, end)
            if hit is not None and hit.link.body is inside:
                start, hit = end, None
    return sorted(found)


def test_what_hides_the_robot_fades_and_comes_back(opened: tuple[Viewer, chromium.Page, Any, Any]) -> None:
    viewer, page, client, robot = opened
    over = (3.5, -1.0, 1.2)
    look(client, FREE)
    until(lambda: abs(page.evaluate("window.__viserMutable.cameraControl.getPosition().x") - 4.0) < 1e-3)
    whole = until(lambda: green(page))
    through = SeeThrough(viewer.server)
    through.keep(viewer.path_of(robot.links[0]), [-0.4, 0.0, 0.4])
    assert hiding(viewer, robot, FREE) == []
    look(client, over)
    assert hiding(viewer, robot, over) == ["wall"]
    until(lambda: page.evaluate(FADED) == ["wall"])
    until(lambda: green(page) > 0.3 * whole)
    through.clear()
    until(lambda: green(page) < 0.02 * whole)  # the wall is opaque again
    through.keep(viewer.path_of(robot.links[0]), [-0.4, 0.0, 0.4])
    until(lambda: green(page) > 0.3 * whole)
    look(client, (-3.0, 0.3, 0.8))
    until(lambda: page.evaluate(FADED) == ["cabinet"])
    until(lambda: green(page) > 0.3 * whole)
    look(client, FREE)
    until(lambda: page.evaluate(FADED) == [])
    until(lambda: abs(green(page) - whole) < 0.1 * whole)
    opaque = (
        "window.__viserMutable.nodeRefFromName && Object.entries(window.__viserMutable.nodeRefFromName)"
        ".filter(([n]) => n.startsWith('/wall/')).every(([, o]) => { let ok = true;"
        "o.traverse(m => { if (m.isMesh && m.material.transparent) ok = false; }); return ok; })"
    )
    until(lambda: page.evaluate(opaque))
    through.clear()


def test_the_camera_follows_smoothly_and_jumps_with_a_reset(
    opened: tuple[Viewer, chromium.Page, Any, Any],
) -> None:
    viewer, page, client, robot = opened
    look(client, FREE)
    until(lambda: abs(page.evaluate("window.__viserMutable.cameraControl.getPosition().x") - 4.0) < 1e-3)
    follow = Follow(viewer.server)
    follow.set(viewer.path_of(robot.links[0]))
    page.evaluate(EYES)
    until(lambda: page.evaluate("window.__eyes.length") > 3)

    def go(x: float) -> np.ndarray:
        """Move the robot at once; return the cameras of all frames until it has followed."""
        page.evaluate("window.__eyes.length = 0")
        robot.set_pose(position=(x, 0.0, 0.5))
        viewer.sync()
        until(lambda: abs(page.evaluate("window.__eyes.at(-1)?.[0] ?? 9") - (0.5 + x)) < 1e-3)
        return np.array(page.evaluate("window.__eyes"))

    seen = go(-0.6)
    np.testing.assert_allclose(seen[-1], [-0.1, -4.0, 1.6, -0.6, 0.0, 0.6], atol=2e-3)
    steps = np.linalg.norm(np.diff(seen[:, :3], axis=0), axis=1)
    moving = steps[steps > 1e-6]
    assert moving.max() < 0.55 * 0.6  # 49 % at 10 frames a second and fewer, 10 % at 60
    assert len(moving) >= 5
    np.testing.assert_allclose(np.diff(seen[:, :3] - seen[:, 3:], axis=0), 0.0, atol=1e-6)
    seen = go(2.5)
    np.testing.assert_allclose(seen[-1], [3.0, -4.0, 1.6, 2.5, 0.0, 0.6], atol=2e-3)
    steps = np.linalg.norm(np.diff(seen[:, :3], axis=0), axis=1)
    assert (steps > 0.01).sum() == 1 and steps.max() == pytest.approx(3.1, abs=0.01)
    page.evaluate("cancelAnimationFrame(window.__watching)")
    follow.set(None)


def test_the_page_shows_the_driven_robot_through_walls(tmp_path: Path) -> None:
    from roboyard.viewer.driving import DrivingPage

    drive = DrivingPage({"scene": "home", "robot": "rover"}, port=0, folder=tmp_path, quiet=True)
    page = chromium.Page(drive.viewer.url, tmp_path / "profile")

    def tick() -> None:
        drive.tick(0.02)

    try:
        client = until(lambda: next(iter(drive.viewer.server.get_clients().values()), None), tick=tick)
        shapes = "Object.keys(window.__viserMutable?.nodeRefFromName ?? {}).length"
        until(lambda: page.evaluate(shapes) > 700, tick=tick)
        assert page.evaluate(FADED) == []  # the first view is free
        place = np.array(drive.robot.base_link.pose[0])
        with client.atomic():
            client.camera.position, client.camera.look_at = place + np.array([0.0, -4.5, 1.0]), place
        until(lambda: "walls" in page.evaluate(FADED), tick=tick)
        page.click_on(page.with_text("see through walls"), tick=tick)
        until(lambda: not drive.panel.sees_through, tick=tick)
        until(lambda: page.evaluate(FADED) == [], tick=tick)
    finally:
        page.close()
        drive.close()
