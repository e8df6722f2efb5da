"""Driving and editing in a real browser: keys, joysticks, fields, pixels. Skipped without Chromium."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.viewer.driving import DrivingPage
from roboyard.viewer.inspector import Inspector, RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium

pytest.importorskip("viser")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]


def until(tick: Callable[[float], None], so: Callable[[], Any], seconds: float = 180.0) -> Any:
    """Run `tick` in real time until `so` is true; `so` runs in another thread."""
    end, found = time.monotonic() + seconds, []

    def look() -> None:
        while not (value := so()) and time.monotonic() < end:
            time.sleep(0.05)
        found.append(value)

    looking = threading.Thread(target=look)
    looking.start()
    last = time.perf_counter()
    while looking.is_alive():
        now = time.perf_counter()
        tick(now - last)
        last = now
        time.sleep(0.005)
    if not found or not found[0]:
        pytest.fail("waited in vain")
    return found[0]


def key(page: chromium.Page, kind: str, name: str) -> None:
    text = {"text": name} if kind == "keyDown" else {}
    page._call("Input.dispatchKeyEvent", type=kind, key=name, code=f"Key{name.upper()}", **text)


@pytest.fixture
def driving(tmp_path: Path) -> Iterator[tuple[DrivingPage, chromium.Page]]:
    drive = DrivingPage({"scene": "empty", "robot": "rover"}, port=0, folder=tmp_path, quiet=True)
    page = chromium.Page(drive.viewer.url, tmp_path / "profile")
    yield drive, page
    page.close()
    drive.close()


def test_keys_and_joysticks_of_a_page_drive_the_robot(driving: tuple[DrivingPage, chromium.Page]) -> None:
    drive, page = driving

    def x() -> float:
        return float(drive.robot.position[0])

    until(drive.tick, lambda: drive.viewer.watchers == 1 and page.evaluate("!!window.__viserMutable"))
    before = x()
    key(page, "keyDown", "i")
    until(drive.tick, lambda: x() > before + 0.1)
    key(page, "keyUp", "i")
    until(drive.tick, lambda: not drive.keys.held)

    stick = "document.querySelector('[data-stick=drive]')"
    there = until(drive.tick, lambda: page.place_at_rest(stick, y=0.15))
    seen = page.evaluate("JSON.stringify(window.__viserMutable.cameraControl.getTarget(undefined))")
    page._call(
        "Input.dispatchMouseEvent", type="mousePressed", x=there[0], y=there[1], button="left", clickCount=1
    )
    turned = x()
    until(drive.tick, lambda: drive.joysticks.values["drive"][1] > 0.8 and x() > turned + 0.1)
    page._call(
        "Input.dispatchMouseEvent", type="mouseReleased", x=there[0], y=there[1], button="left", clickCount=1
    )
    until(drive.tick, lambda: drive.joysticks.values["drive"] == (0.0, 0.0))
    # and the camera of the page followed
    script = "JSON.stringify(window.__viserMutable.cameraControl.getTarget(undefined))"
    until(drive.tick, lambda: page.evaluate(script) != seen)

    # a key typed into a field is ignored
    number = "[...document.querySelectorAll('input[inputmode=decimal]')].find(e => e.getClientRects().length)"
    page.evaluate(f"({number}).focus()")
    key(page, "keyDown", "i")
    key(page, "keyUp", "i")
    time.sleep(0.3)
    assert drive._events.qsize() == 0
    page.evaluate("document.activeElement.blur()")

    key(page, "keyDown", "k")
    until(drive.tick, lambda: "k" in drive.keys.held)
    page.close()  # with the key down: it is released
    until(drive.tick, lambda: not drive.keys.held)


def test_an_edit_on_the_page_is_in_the_file(gripper: Path, tmp_path: Path) -> None:
    config = tmp_path / "config.yaml"
    before = (
        "urdf_path: gripper.urdf\nname: gripper\ncamera_links:  # mine\n"
        "  - {link: eye, parent_link: palm, offset: {position: [0, 0, 0.3]}}\n"
    )
    config.write_text(before)
    inspector = Inspector(RobotSource(name="gripper", urdf=gripper, config=config), port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, tmp_path / "profile", size=(1280, 900))

    def click(text: str) -> None:
        page.click(*until(inspector.tick, lambda: page.place_at_rest(page.with_text(text))))

    try:
        until(inspector.tick, lambda: inspector.viewer.watchers == 1)
        click("sensors and tools")
        until(inspector.tick, lambda: inspector.overlays.is_on("sensors and tools"))
        until(inspector.tick, lambda: page.choose_quality("normal"))  # thin lines in full resolution
        orange = [240, 140, 20]

        def orange_pixels() -> bool:
            return (np.abs(page.picture() - orange).max(axis=2) < 40).mean() > 1e-4

        try:  # the pyramid of the selected camera is orange
            until(inspector.tick, orange_pixels)
        except BaseException:
            picked = inspector.overlays.is_on("sensors and tools"), len(inspector.panels.edits.sensors)
            state = page.evaluate("document.body.innerText.slice(0, 400)")
            print(picked, state, page.picture().mean(axis=(0, 1)), page.picture().std())
            raise
        click("Edit")
        field = "[...document.querySelectorAll('input')].find(e => /^0[.]30*$/.test(e.value))"
        page.click(*until(inspector.tick, lambda: page.place_at_rest(field)))
        page.evaluate(f"({field}).select()")
        page._call("Input.insertText", text="0.25")
        until(inspector.tick, lambda: inspector.panels.edits.sensors[0].position[2] == 0.25)
        click("Write the edits")
        until(inspector.tick, lambda: not inspector.panels.save.is_changed)
        assert config.read_text() == before.replace("0.3]", "0.25]")
    finally:
        page.close()
        inspector.close()


def test_every_switch_changes_the_picture(gripper: Path, tmp_path: Path) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(
        "urdf_path: gripper.urdf\nname: gripper\n"
        "camera_links: [{link: eye, parent_link: palm, offset: {position: [0, 0, 0.3]}}]\n"
        "curobo: {collision_spheres: {palm: [{center: [0, 0, 0], radius: 0.12}]}}\n"
    )
    source = RobotSource(name="gripper", urdf=gripper, config=config)
    inspector = Inspector(source, fixed_base=False, port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, tmp_path / "profile")

    def still() -> np.ndarray:
        """Return the scene, once two pictures are equal."""
        last: list[np.ndarray] = []

        def same() -> bool:
            last.append(page.picture()[60:, :500])
            return len(last) > 1 and np.abs(last[-1] - last[-2]).max() < 8

        until(inspector.tick, same)
        return last[-1]

    def click(label: str) -> None:
        page.click(*until(inspector.tick, lambda: page.place_at_rest(page.with_text(label))))

    def changed(before: np.ndarray) -> float:
        """Return the fraction of the scene that changed."""
        return float((np.abs(page.picture()[60:, :500] - before).max(axis=2) > 25).mean())

    try:
        until(inspector.tick, lambda: inspector.viewer.watchers == 1)
        inspector.play(True)
        for _ in range(180):
            inspector.tick(1 / 60)
        inspector.play(False)
        until(inspector.tick, lambda: page.place_of(page.with_text("contacts")))
        until(inspector.tick, lambda: page.choose_quality("normal"))  # thin lines in full resolution
        for label, box in inspector.switches.items():
            before, was = still(), bool(box.value)
            click(label)
            until(inspector.tick, lambda box=box, was=was: box.value != was)
            until(inspector.tick, lambda before=before: changed(before) > 1e-4)
            if label == "visual meshes":
                continue  # they stay hidden: they would cover the contacts
            click(label)
            until(inspector.tick, lambda box=box, was=was: box.value == was)
    finally:
        page.close()
        inspector.close()
