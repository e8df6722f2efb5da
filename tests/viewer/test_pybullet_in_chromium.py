"""PyBullet's GUI in real browsers: pixels, keys and mouse. Skipped without Chromium."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard.pybullet.connections import CLIENTS

sys.path.insert(0, str(Path(__file__).parent))
import chromium

pytest.importorskip("viser")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.delenv("ROBOYARD_VIEWER", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    p.connect(
        p.GUI,
        options="--port=0 --background_color_red=1 --background_color_green=1 --background_color_blue=1",
    )
    yield CLIENTS[0].window
    for number in list(CLIENTS):
        p.disconnect(number)


@pytest.fixture
def browse(window: Any, tmp_path: Path) -> Iterator[Callable[[], chromium.Page]]:
    """Open pages, each in its own browser."""
    pages: list[chromium.Page] = []

    def open_page() -> chromium.Page:
        pages.append(chromium.Page(window.url, tmp_path / f"profile {len(pages)}"))
        return pages[-1]

    yield open_page
    for page in pages:
        page.close()


def run_until(
    so: Callable[[], Any], step: Callable[[], None] = p.stepSimulation, seconds: float = 180.0
) -> Any:
    """Run the simulation until a condition is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for _ in range(10):
            step()
        found = so()
        if found:
            return found
        time.sleep(0.05)
    pytest.fail("waited in vain")
    return None


def share(page: chromium.Page, channel: int) -> float:
    """Return the fraction of the pixels in which one channel dominates, without the panel."""
    picture = page.picture()[150:, :500]
    others = np.delete(picture, channel, axis=2).max(axis=2)
    return float((picture[..., channel] > others + 60).mean())


def press(page: chromium.Page, kind: str, key: str) -> None:
    page._call("Input.dispatchKeyEvent", type=kind, key=key, code=key)


def drag(
    page: chromium.Page, start: tuple[float, float], end: tuple[float, float], *, release: bool = True
) -> None:
    ways = np.linspace(start, end, 8)
    page._call("Input.dispatchMouseEvent", type="mouseMoved", x=start[0], y=start[1])
    time.sleep(0.3)
    page._call(
        "Input.dispatchMouseEvent", type="mousePressed", x=start[0], y=start[1], button="left", clickCount=1
    )
    for x, y in ways.tolist():
        page._call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, button="left", buttons=1)
        time.sleep(0.05)
    if release:
        page._call(
            "Input.dispatchMouseEvent", type="mouseReleased", x=end[0], y=end[1], button="left", clickCount=1
        )


def arm(pendulum: Path) -> int:
    """Load a red pendulum with a fixed base."""
    body = p.loadURDF(str(pendulum), [0, 0, 0.5], useFixedBase=True)
    for link in (-1, 0):
        p.changeVisualShape(body, link, rgbaColor=[1, 0, 0, 1])
    return body


def test_a_robot_is_shown_moved_and_drawn_on(window: Any, browse: Any, pendulum: Path) -> None:
    body = arm(pendulum)
    slider = p.addUserDebugParameter("hinge", -2, 2, 0)
    p.resetDebugVisualizerCamera(1.2, 0, 0, [0, 0, 0.3])
    page = browse()

    def follow_slider() -> None:
        p.setJointMotorControl2(body, 0, p.POSITION_CONTROL, p.readUserDebugParameter(slider), force=50)
        p.stepSimulation()

    run_until(lambda: window._viewer.watchers == 1)
    run_until(lambda: share(page, 0) > 0.005)  # the robot, by its pixels

    page.click_on(chromium.TRACK, x=0.75, tick=p.stepSimulation)
    run_until(lambda: p.getJointState(body, 0)[0] > 0.8, follow_slider)
    assert p.getJointState(body, 0)[0] == pytest.approx(1.0, abs=0.3)

    assert share(page, 1) < 0.001
    p.addUserDebugLine([-0.5, 0, 0], [0.5, 0, 0], [0, 1, 0], lineWidth=8)
    run_until(lambda: share(page, 1) > 0.004)
    p.removeAllUserDebugItems()
    run_until(lambda: share(page, 1) < 0.001)
    assert share(page, 2) < 0.002
    p.addUserDebugText("WWWWW", [-0.3, 0, -0.1], [0, 0, 1], textSize=4)
    run_until(lambda: share(page, 2) > 0.004)

    red = share(page, 0)
    p.changeVisualShape(body, -1, rgbaColor=[0, 1, 0, 1])  # the picture follows the change
    run_until(lambda: share(page, 1) > 0.002 and share(page, 0) < red)


def test_keys_drive_and_the_mouse_turns_the_camera(window: Any, browse: Any, pendulum: Path) -> None:
    body = arm(pendulum)
    p.resetDebugVisualizerCamera(1.2, 0, -10, [0, 0, 0.3])
    page = browse()
    run_until(lambda: window._viewer.watchers == 1)
    run_until(lambda: share(page, 0) > 0.005)

    def drive() -> None:
        keys = p.getKeyboardEvents()
        speed = 1.0 if keys.get(p.B3G_RIGHT_ARROW, 0) & p.KEY_IS_DOWN else 0.0
        p.setJointMotorControl2(body, 0, p.VELOCITY_CONTROL, targetVelocity=speed, force=50)
        p.stepSimulation()

    press(page, "keyDown", "ArrowRight")
    run_until(lambda: p.getJointState(body, 0)[0] > 0.5, drive)
    press(page, "keyUp", "ArrowRight")
    run_until(lambda: abs(p.getJointState(body, 0)[1]) < 1e-3, drive)

    # the page's camera flies there; a busy machine draws few of its frames
    run_until(lambda: p.getDebugVisualizerCamera()[8:11] == pytest.approx((0.0, -10.0, 1.2), abs=1e-4))
    before = p.getDebugVisualizerCamera()
    assert before[:2] != (1024, 768)
    drag(page, (80, 350), (160, 370))
    run_until(lambda: abs(p.getDebugVisualizerCamera()[8] - before[8]) > 5)
    assert p.getDebugVisualizerCamera()[10] == pytest.approx(1.2, abs=0.01)
    moves = run_until(lambda: [event for event in p.getMouseEvents() if event[0] == 2])
    assert moves[0][3:] == (0, p.KEY_IS_DOWN | p.KEY_WAS_TRIGGERED)


def test_two_browsers_show_the_same_and_can_close(window: Any, browse: Any, pendulum: Path) -> None:
    body = arm(pendulum)
    p.resetDebugVisualizerCamera(1.2, 0, 0, [0, 0, 0.3])
    pages = [browse(), browse()]
    run_until(lambda: window._viewer.watchers == 2)
    run_until(lambda: all(share(page, 0) > 0.005 for page in pages))
    p.resetJointState(body, 0, 1.2)
    run_until(lambda: np.abs(pages[0].picture()[150:, :500] - pages[1].picture()[150:, :500]).mean() < 1.0)
    start = window._viewer.watchers
    pages[0].close()
    run_until(lambda: window._viewer.watchers == start - 1)
    red = share(pages[1], 0)
    p.removeBody(body)
    run_until(lambda: share(pages[1], 0) < 0.1 * red)
    pages[1].close()
    run_until(lambda: window._viewer.watchers == 0)
    p.setGravity(0, 0, -10)
    ball = p.createMultiBody(1, p.createCollisionShape(p.GEOM_SPHERE, radius=0.1))
    for _ in range(24):
        p.stepSimulation()
    assert p.getBasePositionAndOrientation(ball)[0][2] < -0.04
