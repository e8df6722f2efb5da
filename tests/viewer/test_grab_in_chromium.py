"""Links dragged with the mouse, Ctrl held: a running world pulls them, a paused robot follows by IK."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard import Camera

pytest.importorskip("viser")
from roboyard.viewer.driving import DrivingPage
from roboyard.viewer.inspector import Inspector
from roboyard.viewer.inspector.robot_source import RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from test_bar_in_chromium import Script, until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
CTRL = 2


class Mouse:
    """The mouse over the scene of one page, aimed at points of the world."""

    def __init__(self, page: chromium.Page, viewer: Any, tick: Any = None) -> None:
        self.page, self._tick = page, tick
        self.client = until(lambda: next(iter(viewer.server.get_clients().values()), None), tick=tick)
        until(
            lambda: page.evaluate("window.__viserMutable?.canvas?.clientWidth < innerWidth - 100"), tick=tick
        )
        self._wait(2.0)

    def _wait(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self._tick is not None:
                self._tick()
            time.sleep(0.02)

    def pixel(self, point: Any) -> tuple[float, float]:
        camera = self.client.camera
        seen = Camera.look_at(
            camera.position,
            camera.look_at,
            width=camera.image_width,
            height=camera.image_height,
            fovy=camera.fov,
        )
        clip = seen.projection @ seen.view @ np.append(point, 1.0)
        x, y = clip[:2] / clip[3]
        left, top = self.page.evaluate(
            "(b => [b.left, b.top])(window.__viserMutable.canvas.getBoundingClientRect())"
        )
        return left + 0.5 * (1 + x) * seen.width, top + 0.5 * (1 - y) * seen.height

    def send(self, kind: str, x: float, y: float, **more: Any) -> None:
        self.page._call("Input.dispatchMouseEvent", type=kind, x=x, y=y, modifiers=CTRL, **more)

    def drag(
        self, start: Any, by: tuple[float, float], grab: Any, has_moved: Callable[[], bool] | None = None
    ) -> None:
        """Press on a point of the world (m), and move by pixels; the button stays down.

        A page that draws in software on a busy machine may notice the press too late, or show what is to be
        moved where it was: then once more.
        """
        for _ in range(4):
            self._drag(start, by)
            end = time.monotonic() + (20.0 if has_moved else 3.0)
            while time.monotonic() < end:
                if grab.drag is not None and (has_moved is None or has_moved()):
                    return
                self._wait(0.05)
            self.release()
            self._wait(0.5)
        pytest.fail("no drag arrived" if has_moved is None else "nothing moved")

    def _drag(self, start: Any, by: tuple[float, float]) -> None:
        x, y = self.pixel(start)
        self.page._call(
            "Input.dispatchKeyEvent", type="keyDown", key="Control", code="ControlLeft", modifiers=CTRL
        )
        self.send("mouseMoved", x, y)
        self._wait(0.5)
        self.send("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        for k in range(1, 9):
            self.send("mouseMoved", x + k / 8 * by[0], y + k / 8 * by[1], button="left", buttons=1)
            self._wait(0.08)
        self.last = x + by[0], y + by[1]

    def release(self) -> None:
        self.send("mouseReleased", *self.last, button="left", clickCount=1)


def reset(script: Script) -> None:
    """Reset the world, and wait until its thread has done so; until then it may be as a test waits for."""
    done = threading.Event()
    script.viewer.bar.controls.reset()
    script.viewer.gate.do(done.set)
    until(done.is_set)


def test_a_cube_is_lifted_and_falls(tmp_path: Path) -> None:
    script = Script()
    is_lifted = lambda: script.cube.position[2] > 0.125  # noqa: E731
    page = chromium.Page(script.viewer.url, tmp_path / "profile", (1280, 800))
    try:
        mouse = Mouse(page, script.viewer)
        until(lambda: script.cube.position[2] < 0.11)
        mouse.drag(script.cube.position, (0, -250), script.viewer.grab, is_lifted)
        until(lambda: script.viewer.server.scene.get_handle_by_name("/roboyard pull"))
        mouse.release()
        until(lambda: script.cube.position[2] < 0.11)
        until(lambda: not script.viewer.server.scene.get_handle_by_name("/roboyard pull"))
        reset(script)
        until(lambda: abs(script.cube.position[0]) < 1e-3 and script.cube.position[2] < 0.11)
        # reset while it is held, which adds a constraint to the world
        mouse.drag(script.cube.position, (0, -250), script.viewer.grab, is_lifted)
        reset(script)
        until(lambda: not script.viewer.grab.is_holding)
        until(lambda: abs(script.cube.position[0]) < 1e-3 and script.cube.position[2] < 0.11)
    finally:
        page.close()
        script.close()


def test_a_paused_robot_follows_the_mouse(pendulum: Path, tmp_path: Path) -> None:
    inspector = Inspector(RobotSource(name="pendulum", urdf=pendulum, config=None), port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, tmp_path / "profile", (1280, 800))
    tick = lambda: inspector.tick(0.02)  # noqa: E731
    try:
        mouse = Mouse(page, inspector.viewer, tick)
        bob, hinge = inspector.body.link("bob"), inspector.body.joint("hinge")
        position, _ = bob.pose
        mouse.drag(position + np.array((0.0, 0.0, -0.4)), (-120, 0), inspector.viewer.grab)
        until(lambda: abs(hinge.position) > 0.2, tick=tick)
        assert inspector.world.time == 0.0
        assert inspector.joints.sliders["hinge"].value == pytest.approx(hinge.position, abs=1e-3)
        mouse.release()
        until(lambda: inspector.viewer.grab.drag is None, tick=tick)
        before = float(hinge.position)
        inspector.play(True)
        for _ in range(30):
            inspector.tick(0.02)
        assert hinge.position == pytest.approx(before, abs=0.1)  # its drive holds it there
    finally:
        page.close()
        inspector.close()


def test_a_robot_that_drives_is_pulled(tmp_path: Path) -> None:
    drive = DrivingPage({"scene": "empty", "robot": "rover"}, port=0, folder=tmp_path, quiet=True)
    page = chromium.Page(drive.viewer.url, tmp_path / "profile", (1280, 800))
    tick = lambda: drive.tick(0.02)  # noqa: E731
    try:
        mouse = Mouse(page, drive.viewer, tick)
        bounds = drive.robot.body.bounds
        mouse.drag(0.5 * (bounds[0] + bounds[1]), (0, -150), drive.viewer.grab)
        until(lambda: drive.viewer.grab.is_holding, tick=tick)
        until(lambda: drive.robot.body.bounds[0, 2] > bounds[0, 2] + 0.03, tick=tick)
        mouse.release()
        until(lambda: not drive.viewer.grab.is_holding, tick=tick)
    finally:
        page.close()
        drive.close()


def test_scripts_wait_for_no_thread() -> None:
    """A closed viewer leaves no thread that waits at the gate."""
    script = Script()
    script.viewer.gate.play(False)
    script.close()
    assert not [t for t in threading.enumerate() if t.name == "roboyard-viewer" and t.is_alive()]
