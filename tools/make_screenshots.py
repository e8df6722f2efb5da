"""Take pictures of pages for the documentation, in a headless Chromium.

    python tools/make_screenshots.py [NAME ...]

Writes docs/images/<name>.png. Requires the extra `gui` and Chromium, run by `tests/viewer/chromium.py`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "viewer"))
import chromium  # noqa: E402

PATIENCE = 25.0
"""Time for a page to render in software (s)."""
NORMAL_QUALITY = "localStorage.setItem('roboyard quality', 'normal'); location.reload()"
"""Browsers that draw in software begin with low quality; edges are smooth where another was chosen first."""


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
            wait(tick, 5.0)
            page.evaluate(NORMAL_QUALITY)
            wait(tick, seconds)
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
        tree = page.links.tree
        tree.show(1, page.body.link("left_arm_link1").index, True, below=True)
        tree.fade(0, page.body.link("left_arm_link1").index, 0.5, below=True)
        page.links.pick(page.body.link("torso_link4"))
        page.viewer.look_at((0.0, 0.0, 0.85), 2.6)
        wait(page.tick, 2.0)
        shown.evaluate("document.querySelector('.roboyard-fade').scrollIntoView({block: 'end'})")

    try:
        take("inspector", page.viewer.url, page.tick, act)
    finally:
        page.close()


def inspector_sensors() -> None:
    """Take a picture of R1's planning spheres and sensors, with the live picture of its head camera."""
    from roboyard.viewer.inspector import Inspector, find_robot

    page = Inspector(find_robot("r1"), port=0, quiet=True)

    def act(shown: chromium.Page) -> None:
        shown.click(*shown.place_of(shown.with_text("Edit")))
        for kind in ("planning spheres", "sensors and tools"):
            page.switches[kind].value = True
            page.panels.switch(kind, True)
        sensors = page.panels.edits.sensors
        page.panels.sensors.pick(next(one for one in sensors if one.link == "eyes"))
        page.viewer.look_at((0.1, 0.0, 0.95), 2.6)
        wait(page.tick, 2.0)
        shown.evaluate("[...document.querySelectorAll('img')].pop()?.scrollIntoView({block: 'end'})")

    try:
        take("inspector_sensors", page.viewer.url, page.tick, act)
    finally:
        page.close()


def inspector_checks() -> None:
    """Take a picture of all checks of R1, with the first link of one of them."""
    from roboyard.viewer.inspector import Inspector, find_robot

    page = Inspector(find_robot("r1"), port=0, quiet=True)

    def act(shown: chromium.Page) -> None:
        shown.click(*shown.place_of(shown.with_text("Check")))
        page.panels.checks.run_all()
        failed = [k for k, found in page.panels.checks.results.items() if found.violations]
        link = next(v.link for k in failed for v in page.panels.checks.results[k].violations if v.link)
        page.panels.point(link)

    try:
        take("inspector_checks", page.viewer.url, page.tick, act)
    finally:
        page.close()


def pybullet_gui() -> None:
    """Take a picture of a PyBullet script with a slider, rays drawn as lines, and a text."""
    import roboyard.pybullet as p
    import roboyard.pybullet_data as pybullet_data
    from roboyard.pybullet.connections import CLIENTS

    client: Any = CLIENTS[p.connect(p.GUI, options="--port=0")]
    p.setAdditionalSearchPath(pybullet_data.getDataPath())
    p.setGravity(0, 0, -9.81)
    random = np.random.default_rng(3)
    heights = np.kron(random.uniform(0.0, 0.05, (64, 64)), np.ones((2, 2))).ravel()
    shape = p.createCollisionShape(
        p.GEOM_HEIGHTFIELD,
        meshScale=[0.15, 0.15, 1.0],
        heightfieldData=heights.tolist(),
        numHeightfieldRows=128,
        numHeightfieldColumns=128,
    )
    p.createMultiBody(0, shape)
    husky = p.loadURDF("husky/husky.urdf", [0, 0, 0.3])
    p.addUserDebugParameter("wheel speed", -10, 10, 0)
    for _ in range(240):
        p.stepSimulation()
    place = np.array(p.getBasePositionAndOrientation(husky)[0])
    starts = np.tile(place + np.array([0.0, 0.0, 0.6]), (36, 1))
    turn = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    ends = starts + np.c_[4.0 * np.cos(turn), 4.0 * np.sin(turn), np.full(36, -1.0)]
    for start, hit in zip(starts, p.rayTestBatch(starts.tolist(), ends.tolist()), strict=True):
        p.addUserDebugLine(start.tolist(), hit[3] if hit[0] >= 0 else start.tolist(), [0.4, 0.9, 0.2], 1.5)
    p.addUserDebugText("husky", (place + np.array([0.0, 0.0, 0.75])).tolist(), [0, 0, 0.9], 1.5)
    p.resetDebugVisualizerCamera(3.2, 50, -28, place.tolist())
    try:
        take("pybullet_gui", client.window.url, lambda _: p.stepSimulation(), lambda _: None)
    finally:
        p.disconnect()


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
        for name, label in page.insets.labels.items():
            page.insets.switch(name, label in ("eyes", "left eef link"))
        take("driving", page.viewer.url, page.tick, lambda _: None)
    finally:
        page.close()


SHOTS = {
    one.__name__: one
    for one in (inspector, inspector_sensors, inspector_checks, lidar, driving, pybullet_gui)
}

if __name__ == "__main__":
    for shot in sys.argv[1:] or SHOTS:
        SHOTS[shot]()
        print(f"docs/images/{shot}.png")
