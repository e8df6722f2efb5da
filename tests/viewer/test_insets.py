"""Pictures of a robot's cameras and lidars on the driving page."""

from __future__ import annotations

import base64
import io
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from roboyard import World
from roboyard.sensors import IMPORTED_PATTERN, Lidar
from roboyard.viewer.driving.insets import RADIUS, SIDE, WIDTH, picture_of, scan_picture

pytest.importorskip("viser")
from roboyard.viewer.driving import DrivingPage

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DrivingPage]:
    page = DrivingPage(
        {"scene": "tabletop", "robot": "r1"}, port=0, folder=tmp_path_factory.mktemp("films"), quiet=True
    )
    link = page.robot.body.link("base_link")
    page.robot.sensors.add(Lidar(link, position=(0, 0, 0.45), pattern=IMPORTED_PATTERN, rate=10))
    page.insets.show_robot(page.robot)
    yield page
    page.close()


def tick(drive: DrivingPage) -> None:
    drive.tick(0.0)


def name_of(drive: DrivingPage, label: str) -> str:
    return next(name for name, text in drive.insets.labels.items() if text == label)


def test_every_camera_and_lidar_has_a_button(drive: DrivingPage) -> None:
    assert sorted(drive.insets.labels.values()) == ["base link", "eyes", "left eef link", "right eef link"]


def test_a_camera_is_shown_as_it_sees_in_its_own_proportions(drive: DrivingPage) -> None:
    sensor: Any = drive.robot.sensors[name_of(drive, "eyes")]
    full = sensor.image().rgb[..., :3]
    shown = picture_of(sensor)
    assert shown.shape == (round(WIDTH * full.shape[0] / full.shape[1]), WIDTH, 3)
    scaled = np.asarray(Image.fromarray(np.ascontiguousarray(full)).resize(shown.shape[1::-1]), dtype=float)
    assert np.abs(scaled - shown).mean() < 6.0


def test_a_lidar_is_shown_from_above_with_its_x_axis_up() -> None:
    world = World()  # without a floor, which would be hit all around
    robot = world.add_box(size=(0.1, 0.1, 0.1), position=(1.0, 2.0, 0.5), mass=0.0)
    world.add_box(size=(0.3, 0.3, 2.0), position=(4.0, 2.0, 1.0), mass=0.0)  # 3 m ahead
    world.add_box(size=(0.3, 0.3, 2.0), position=(1.0, 4.0, 1.0), mass=0.0)  # 2 m to the left
    lidar = Lidar(robot.links[0], pattern=IMPORTED_PATTERN)
    picture = scan_picture(lidar.scan(), robot.id)
    bright = picture.max(axis=2) > 120
    middle, scale = (SIDE - 1) / 2, 2 * RADIUS / SIDE

    def is_hit(x: float, y: float) -> bool:
        row, column = round(middle - x / scale), round(middle - y / scale)
        return bool(bright[row - 2 : row + 3, column - 2 : column + 3].any())

    assert is_hit(3.0 - 0.15, 0.0) and is_hit(0.0, 2.0 - 0.15)
    assert not is_hit(0.0, -2.0 + 0.15) and not is_hit(-3.0 + 0.15, 0.0)


def test_pictures_are_taken_only_while_they_are_shown_and_watched(drive: DrivingPage, browser, wait) -> None:
    eyes = name_of(drive, "eyes")
    tick(drive)
    assert drive.insets.pictures == {}
    page = browser(drive.viewer)
    wait(lambda: drive.viewer.watchers == 1)
    text = json.dumps([1, [eyes, True]])
    page.send(type="GuiUpdateMessage", uuid=drive.insets._script._uuid, updates={"value": text})
    wait(lambda: tick(drive) or drive.insets.pictures.get(eyes), 60.0)
    sensor: Any = drive.robot.sensors[eyes]
    now = picture_of(sensor)
    picture = np.asarray(Image.open(io.BytesIO(drive.insets.pictures[eyes])), dtype=float)
    assert np.abs(picture - now).mean() < 6.0
    sent = page.listen(lambda m: m["type"] == "RunJavascriptMessage" and "/9j/" in m["source"])
    data = sent["source"].split("/9j/")[1].split('"')[0].rstrip("\\")
    assert base64.b64decode("/9j/" + data) == drive.insets.pictures[eyes]
    for message in ([eyes, 1], ["nothing", True], [eyes], {}, None):
        text = json.dumps([2, message])
        page.send(type="GuiUpdateMessage", uuid=drive.insets._script._uuid, updates={"value": text})
    text = json.dumps([3, [eyes, False]])
    page.send(type="GuiUpdateMessage", uuid=drive.insets._script._uuid, updates={"value": text})
    wait(lambda: tick(drive) or drive.insets.pictures == {})


@pytest.mark.slow
@pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium")
def test_a_click_shows_a_picture_in_the_corner_of_the_page(drive: DrivingPage, tmp_path: Path) -> None:
    page = chromium.Page(drive.viewer.url, tmp_path / "profile", (1280, 800))
    eyes = name_of(drive, "eyes")
    found = "[...document.querySelectorAll('.roboyard-insets {}')].find(e => e.dataset.inset === {!r})"
    button, shown = found.format("button", eyes), found.format("figure", eyes)

    def step() -> None:
        tick(drive)

    try:
        page.click_on(button, tick=step)
        until(lambda: page.evaluate(f"{shown}?.firstChild.naturalWidth") == WIDTH, tick=step)
        assert page.evaluate(f"{button}.ariaPressed") == "true"

        def is_in_the_corner() -> bool:
            edge = page.evaluate("window.__viserMutable.canvas.getBoundingClientRect().right")
            box = page.evaluate(f"(b => [b.left, b.right, b.bottom])({shown}.getBoundingClientRect())")
            return edge - 300 < box[0] < box[1] <= edge - 10 and box[2] < page.evaluate("innerHeight")

        until(is_in_the_corner, tick=step)
        page.click_on(button, tick=step)
        until(lambda: not page.evaluate(f"!!{shown}"), tick=step)
    finally:
        page.close()
