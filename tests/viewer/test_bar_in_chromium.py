"""The bar in real browsers: on pages of a script, PyBullet's GUI, the inspector and a drive."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard import World
from roboyard.pybullet.connections import CLIENTS

pytest.importorskip("viser")
from roboyard.viewer import Viewer
from roboyard.viewer.driving import DrivingPage
from roboyard.viewer.inspector import Inspector
from roboyard.viewer.inspector.robot_source import RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]


def bar(kind: str) -> str:
    return f"document.querySelector('.roboyard-bar [data-bar={kind}]')"


def press(page: chromium.Page, kind: str) -> None:
    page.click_on(bar(kind))


def wait_until_still(value: Callable[[], Any]) -> Any:
    """Return a value once it has stayed the same for half a second."""
    seen: list[Any] = [None]

    def is_still() -> bool:
        seen.append(value())
        time.sleep(0.5)
        return bool(seen[-1] == value())

    until(is_still)
    return seen[-1]


def choose(page: chromium.Page, kind: str, value: str) -> None:
    page.evaluate(f"(s => {{ s.value = '{value}'; s.dispatchEvent(new Event('change')); }})({bar(kind)})")


@pytest.fixture
def browse(tmp_path: Path) -> Iterator[Callable[[str], chromium.Page]]:
    pages: list[chromium.Page] = []

    def open_page(url: str) -> chromium.Page:
        pages.append(chromium.Page(url, tmp_path / f"profile {len(pages)}", (1280, 800)))
        return pages[-1]

    yield open_page
    for page in pages:
        page.close()


class Script:
    """A thread that steps a world with a cube, as a user's program does."""

    def __init__(self, port: int = 0) -> None:
        self.world = World()
        self.world.add_plane()
        self.cube = self.world.add_box(size=(0.2, 0.2, 0.2), position=(0.0, 0.0, 0.3), mass=1.0)
        self.viewer = Viewer(self.world, port=port, quiet=True)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.is_set():
            self.world.step()
            time.sleep(0.001)

    def close(self) -> None:
        self._stop.set()
        self.viewer.close()
        self._thread.join(timeout=5)
        assert not self._thread.is_alive()


def test_a_script_is_paused_stepped_slowed_and_reset(browse: Any) -> None:
    script = Script()
    world, viewer = script.world, script.viewer
    try:
        page = browse(viewer.url)
        until(lambda: page.evaluate(f"{bar('time')}?.textContent?.includes(' s')"))
        assert page.evaluate("document.title") == "Roboyard"
        assert page.evaluate("document.querySelector('link[rel~=icon]').href").startswith(
            "data:image/svg+xml"
        )
        assert page.evaluate(f"{bar('play')}.getAttribute('aria-label')") == "Pause"
        press(page, "play")
        until(lambda: page.evaluate(f"{bar('play')}.getAttribute('aria-label')") == "Play")
        held = wait_until_still(lambda: world.time)
        for count in (1, 2):
            press(page, "step")
            until(lambda count=count: world.time == pytest.approx(held + count * world.timestep))
        until(lambda: page.evaluate(f"{bar('time')}.textContent").startswith(f"{world.time:.2f} s"))
        press(page, "reset")
        until(lambda: world.time == 0.0)
        assert script.cube.position[2] == pytest.approx(0.3)
        choose(page, "speed", "0.25")
        press(page, "play")
        until(lambda: world.time > 0.1)
        paces: list[float] = []

        def is_paced() -> bool:
            start, wall = world.time, time.monotonic()
            time.sleep(1.0)
            paces.append((world.time - start) / (time.monotonic() - wall))
            return paces[-1] == pytest.approx(0.25, abs=0.05)

        until(is_paced)
        assert max(paces) < 0.35  # slower only where the machine is, and what it missed is not made up
        until(lambda: page.evaluate(f"{bar('time')}.textContent").endswith(("0.24×", "0.25×", "0.26×")))

        camera = next(iter(viewer.server.get_clients().values())).camera

        def away() -> np.ndarray:
            return np.array(camera.position) - np.array(camera.look_at)

        choose(page, "view", "left")
        until(
            lambda: camera.position[1] - camera.look_at[1] > 5 * abs(camera.position[0] - camera.look_at[0])
        )
        choose(page, "view", "home")
        until(lambda: away()[0] > 0.2)

        press(page, "forces")
        until(lambda: viewer.server.scene.get_handle_by_name("/roboyard contact forces"))

        def lift() -> float:
            arrows = viewer.server.scene.get_handle_by_name("/roboyard contact forces").points
            return float((arrows[:, 1, 2] - arrows[:, 0, 2]).sum())

        until(lambda: lift() == pytest.approx(0.3, rel=0.2))  # together the cube's weight: 0.3 m
        press(page, "forces")
        until(lambda: not viewer.server.scene.get_handle_by_name("/roboyard contact forces"))

        press(page, "picture")
        kept = until(lambda: page.evaluate("document.querySelector('.roboyard-bar').dataset.kept"))
        assert ".png " in kept
        assert int(kept.split()[1]) > 5000  # an empty picture is far smaller
        press(page, "film")
        until(lambda: page.evaluate(f"{bar('film')}.getAttribute('aria-pressed')") == "true")
        time.sleep(2.0)
        press(page, "film")
        film = until(
            lambda: (
                kept
                if (kept := page.evaluate("document.querySelector('.roboyard-bar').dataset.kept")).split()[0][
                    -4:
                ]
                != ".png"
                else None
            )
        )
        assert int(film.split()[1]) > 1000

        press(page, "play")
        until(lambda: not viewer.gate.playing)
        page.close()  # a paused script goes on when the last page is gone
        until(lambda: viewer.gate.playing)
    finally:
        script.close()


def test_a_stopped_server_is_named_and_its_return_is_noticed(browse: Any) -> None:
    script = Script()
    port = script.viewer.port
    page = browse(script.viewer.url)
    note = "document.querySelector('.roboyard-note')"
    until(lambda: page.evaluate(f"{bar('time')}?.textContent?.includes(' s')"))
    assert page.evaluate(f"{note}.hidden") is True
    page.evaluate("window.oldBar = document.querySelector('.roboyard-bar')")
    script.close()
    until(lambda: page.evaluate(f"{note}.hidden") is False)
    assert "has stopped" in page.evaluate(f"{note}.textContent")
    again = Script(port)
    try:
        assert again.viewer.port == port
        until(lambda: again.viewer.watchers == 1)
        until(
            lambda: page.evaluate(
                f"document.querySelectorAll('.roboyard-note').length === 1 && {note}.hidden"
            )
        )
        # the bar of the server that has stopped may still be there, with its last time
        until(lambda: page.evaluate("document.querySelector('.roboyard-bar') !== window.oldBar"))
        until(lambda: page.evaluate(f"{bar('time')}?.textContent?.includes(' s')"))
        press(page, "play")
        until(lambda: not again.viewer.gate.playing)
    finally:
        again.close()


def test_a_click_counts_while_the_time_changes(browse: Any) -> None:
    """A person holds a button of the mouse down for 0.1 s, and the bar has a new time each 0.25 s."""
    script = Script()
    try:
        page = browse(script.viewer.url)
        until(lambda: page.evaluate(f"{bar('time')}?.textContent?.includes(' s')"))
        for playing in (False, True):
            x, y = until(lambda: page.place_at_rest(bar("play")))
            page.mouse("mouseMoved", x, y)
            page.mouse("mousePressed", x, y)
            script.viewer.bar.show(title=f"Roboyard {playing}")
            until(lambda playing=playing: page.evaluate("document.title") == f"Roboyard {playing}")
            page.mouse("mouseReleased", x, y)
            until(lambda playing=playing: script.viewer.gate.playing is playing)
    finally:
        script.close()


def test_pybullet_scripts_are_paused_and_reset(monkeypatch: pytest.MonkeyPatch, browse: Any) -> None:
    monkeypatch.delenv("ROBOYARD_VIEWER", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    p.connect(p.GUI, options="--port=0")
    stop = threading.Event()
    try:
        client: Any = CLIENTS[0]
        window: Any = client.window
        p.setGravity(0, 0, -9.8)
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=0.1)
        ball = p.createMultiBody(1, shape, basePosition=[0, 0, 100])
        steps: list[int] = []

        def run() -> None:
            while not stop.is_set():
                p.stepSimulation()
                steps.append(1)
                time.sleep(0.002)

        page = browse(window.url)
        until(lambda: page.place_of(bar("play")), tick=p.stepSimulation)
        until(lambda: window._viewer.watchers == 1, tick=p.stepSimulation)
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        press(page, "play")
        until(lambda: not window.gate.playing)
        held = wait_until_still(lambda: len(steps))
        press(page, "step")
        until(lambda: len(steps) == held + 1)
        assert p.getBasePositionAndOrientation(ball)[0][2] < 100
        press(page, "reset")
        until(lambda: p.getBasePositionAndOrientation(ball)[0][2] > 99.9)
        press(page, "play")
        until(lambda: len(steps) > held + 10)
    finally:
        stop.set()
        for number in list(CLIENTS):
            p.disconnect(number)


def test_the_inspector_and_a_drive_obey_the_bar(pendulum: Path, tmp_path: Path, browse: Any) -> None:
    inspector = Inspector(RobotSource(name="pendulum", urdf=pendulum, config=None), port=0, quiet=True)
    drive = DrivingPage({"scene": "empty", "robot": "rover"}, port=0, folder=tmp_path, quiet=True)
    try:
        for loop, url, world in (
            (inspector, inspector.viewer.url, inspector.world),
            (drive, drive.viewer.url, drive.world),
        ):
            tick = lambda loop=loop: loop.tick(0.03)  # noqa: E731
            page = browse(url)
            until(lambda page=page: page.place_of(bar("play")), tick=tick)
            if loop.is_playing:
                press(page, "play")
                until(lambda loop=loop: not loop.is_playing, tick=tick)
            before = world.time
            press(page, "step")
            until(lambda world=world, before=before: world.time > before, tick=tick)
            assert world.time - before < 0.04
            press(page, "play")
            until(lambda loop=loop: loop.is_playing, tick=tick)
            choose(page, "speed", "2")
            until(lambda loop=loop: loop.viewer.bar.state["speed"] == 2.0, tick=tick)
            before = world.time
            for _ in range(20):
                loop.tick(0.02)
            assert world.time - before == pytest.approx(0.8, abs=0.06)
            press(page, "reset")
            until(lambda world=world: world.time < 0.3, tick=tick)
            assert np.isfinite(world.data.qpos).all()
        assert page.evaluate("document.title") == "Roboyard: drive"
    finally:
        inspector.close()
        drive.close()


def test_where_a_processor_draws_a_picture_at_rest_gets_all_pixels(browse: Any) -> None:
    """While something moves a quarter of the pixels is drawn, without smoothed edges, and at rest all."""
    script = Script()
    try:
        page = browse(script.viewer.url)
        until(lambda: page.evaluate(f"{bar('quality')}?.value") == "low")
        context = "window.__viserMutable.canvas.getContext('webgl2')"
        assert page.evaluate(f"{context}.getContextAttributes().antialias") is False
        pixels = "(c => c.width / c.clientWidth)(window.__viserMutable.canvas)"
        turn = "window.__viserMutable.cameraControl.rotate({}, 0, false)"
        watch = (  # the size of the picture changes for less than a second
            f"(c => {{ window.__ratios = []; new MutationObserver(() => window.__ratios.push({pixels}))"
            ".observe(c, {attributes: true}); })(window.__viserMutable.canvas)"
        )
        until(lambda: page.evaluate(pixels) == pytest.approx(1.0, abs=0.01))
        before = page.picture()
        page.evaluate(watch)
        page.evaluate(turn.format(0.5))
        until(lambda: any(abs(ratio - 0.5) < 0.01 for ratio in page.evaluate("window.__ratios")))
        until(lambda: page.evaluate(pixels) == pytest.approx(1.0, abs=0.01))
        assert np.abs(page.picture() - before).mean() > 0.5
        choose(page, "quality", "normal")
        until(lambda: page.evaluate(pixels) == pytest.approx(1.0, abs=0.01))
        page.evaluate(turn.format(0.5))
        for _ in range(10):
            assert page.evaluate(pixels) == pytest.approx(1.0, abs=0.01)
            time.sleep(0.05)
    finally:
        script.close()
