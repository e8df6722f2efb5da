"""Pages in real browsers: every control has a name, keys reach it, labels stand out, dark mode."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser")
from roboyard.viewer.inspector import Inspector
from roboyard.viewer.inspector.robot_source import RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import slider, until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
UNNAMED = (
    "[...document.querySelectorAll('[role=slider], input:not([type=hidden]), select')]"
    ".filter(e => e.getClientRects().length && !e.getAttribute('aria-label') && !e.labels?.length).length"
)

LABEL = """(() => {
  const found = [...document.querySelectorAll('label[for]')].find(e => e.getClientRects().length);
  if (!found) return null;
  const root = getComputedStyle(document.documentElement), probe = document.createElement('i');
  probe.style.color = root.getPropertyValue('--mantine-color-body');
  document.body.append(probe);
  const ground = getComputedStyle(probe).color;
  probe.remove();
  return [getComputedStyle(found).color, ground].map(c => c.match(/[0-9.]+/g).slice(0, 3).map(Number));
})()"""


def contrast(page: chromium.Page) -> float:
    """Return the contrast ratio of a label, as WCAG 2.2 defines it."""
    colors = page.evaluate(LABEL)
    if colors is None:
        return 0.0
    light = []
    for color in colors:
        v = np.array(color) / 255.0
        linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
        light.append(float(linear @ (0.2126, 0.7152, 0.0722)))
    return (max(light) + 0.05) / (min(light) + 0.05)


@pytest.fixture
def opened(pendulum: Path, tmp_path: Path) -> Iterator[tuple[Inspector, chromium.Page]]:
    inspector = Inspector(RobotSource(name="pendulum", urdf=pendulum, config=None), port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, tmp_path / "profile", (1280, 800))
    yield inspector, page
    page.close()
    inspector.close()


def test_sliders_have_names_and_obey_keys(opened: tuple[Inspector, chromium.Page]) -> None:
    inspector, page = opened

    def tick() -> None:
        inspector.tick(0.02)

    hinge = slider("hinge")

    def click_until_shown() -> bool:
        place = page.place_of(page.with_text("Move"))
        if place is not None:
            page.click(*place)
        return bool(page.evaluate(f"{hinge}?.getClientRects().length"))

    until(click_until_shown, tick=tick)
    until(lambda: page.evaluate(UNNAMED) == 0, tick=tick)
    page.evaluate(f"{hinge}.focus()")
    page._call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", code="ArrowRight")
    until(lambda: inspector.body.joint("hinge").position > 0.001, tick=tick)


def test_pages_follow_the_dark_mode_and_labels_stand_out(opened: tuple[Inspector, chromium.Page]) -> None:
    inspector, page = opened

    def tick() -> None:
        inspector.tick(0.02)

    until(lambda: page.place_of(page.with_text("Move")), tick=tick)
    until(lambda: page.picture()[400:, -60:].mean() > 200, tick=tick)
    until(lambda: contrast(page) > 7.0, tick=tick)  # viser's own labels have 3.3
    page._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    until(lambda: page.picture()[400:, -60:].mean() < 80, tick=tick)
    until(lambda: contrast(page) > 7.0, tick=tick)
    page._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "light"}])
    until(lambda: page.picture()[400:, -60:].mean() > 200, tick=tick)
