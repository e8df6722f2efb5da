"""Take pictures of pages for the documentation, in a headless Chromium.

    python tools/make_screenshots.py [inspector] [lidar] [driving]

Writes docs/images/<name>.png. Requires the extra `gui` and Chromium, run by `tests/viewer/chromium.py`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "viewer"))
import chromium  # noqa: E402

PATIENCE = 25.0
"""Time for a page to render in software (s)."""
NORMAL_QUALITY = (
    "(s => { if (s) { s.value = 'normal'; s.dispatchEvent(new Event('change')); } })"
    "(document.querySelector('[data-bar=quality]'))"
)


def take(
    name: str,
    url: str,
    tick: Callable[[float], None],
    act: Callable[[chromium.Page], None],
    seconds: float = PATIENCE,
) -> None:
    """Open a page, run `act` on it, and save a picture of it after `seconds`."""
    with tempfile.TemporaryDirectory() as folder:
        page = chromium.Page(url, Path(folder) / "profile", (1280, 800))
        try:
            wait(tick, seconds)
            page.evaluate(NORMAL_QUALITY)  # browsers that draw in software begin with low
            act(page)
            wait(tick, seconds)
            page.evaluate("document.activeElement?.blur()")
            wait(tick, 2.0)
            image = Image.fromarray(page.picture().astype(np.uint8))
            image.quantize(192).save(ROOT / "docs" / "images" / f"{name}.png", optimize=True)
        finally:
            page.close()


def wait(tick: Callable[[float], None], seconds: float) -> None:
    """Run `tick` in real time for `seconds`."""
    end = last = time.monotonic()
    end += seconds
    while last < end:
        time.sleep(0.02)
        now = time.monotonic()
        tick(now - last)
        last = now


def inspector() -> None:
    """Take a picture of R1 with its collision shapes and one selected link."""
    from roboyard.viewer.inspector import Inspector, find_robot

    page = Inspector(find_robot("r1"), port=0, quiet=True)

    def act(shown: chromium.Page) -> None:
        shown.click(*shown.place_of(shown.with_text("Links")))  # type: ignore[misc]
        page.switches["collision shapes"].value = True
        page.panels.switch("collision shapes", True)
        page.links.pick(page.body.link("torso_link4"))
        page.viewer.look_at((0.0, 0.0, 0.85), 2.6)

    try:
        take("inspector", page.viewer.url, page.tick, act)
    finally:
        page.close()


def lidar() -> None:
    """Take a picture of R1 in the flat with a lidar on its base."""
    from roboyard.sensors import IMPORTED_PATTERN, Lidar
    from roboyard.viewer.driving import DrivingPage

    page = DrivingPage({"scene": "home", "robot": "r1"}, port=0, quiet=True)
    link = page.robot.body.link("base_link")
    page.robot.sensors.add(Lidar(link, position=(0, 0, 0.45), pattern=IMPORTED_PATTERN, rate=10))
    page.panel.show_robot()

    def act(shown: chromium.Page) -> None:
        del shown
        page.panel.scans_box.value = True
        page.follow.set(None)
        place = np.array(page.robot.base_link.pose[0])
        for client in page.viewer.server.get_clients().values():
            client.camera.position = place + np.array([-1.6, -0.9, 3.6])
            client.camera.look_at = place + np.array([0.9, 0.0, 0.4])

    try:
        take("lidar", page.viewer.url, page.tick, act)
    finally:
        page.close()


def driving() -> None:
    """Take a picture of the page on which R1 is driven through the flat."""
    from roboyard.viewer.driving import DrivingPage

    page = DrivingPage({"scene": "home", "robot": "r1"}, port=0, quiet=True)
    try:
        take("driving", page.viewer.url, page.tick, lambda _: None)
    finally:
        page.close()


SHOTS = {"inspector": inspector, "lidar": lidar, "driving": driving}

if __name__ == "__main__":
    for shot in sys.argv[1:] or SHOTS:
        SHOTS[shot]()
        print(f"docs/images/{shot}.png")
