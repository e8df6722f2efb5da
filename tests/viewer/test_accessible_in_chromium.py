"""Pages in real browsers: every control has a name, keys reach it, dark mode, small and large windows."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("viser")
from roboyard.viewer.inspector import Inspector
from roboyard.viewer.inspector.robot_source import RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from test_bar_in_chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
UNNAMED = (
    "[...document.querySelectorAll('[role=slider], input:not([type=hidden]), select')]"
    ".filter(e => e.getClientRects().length && !e.getAttribute('aria-label') && !e.labels?.length).length"
)


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

    slider = "document.querySelector('[role=slider]')"

    def click_until_shown() -> bool:
        place = page.place_of(page.with_text("Joints"))
        if place is not None:
            page.click(*place)
        return bool(page.evaluate(f"{slider}?.getClientRects().length"))

    until(click_until_shown, tick=tick)
    until(lambda: page.evaluate(f"{slider}?.getAttribute('aria-label')") == "hinge", tick=tick)
    until(lambda: page.evaluate(UNNAMED) == 0, tick=tick)
    page.evaluate(f"{slider}.focus()")
    page._call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight", code="ArrowRight")
    until(lambda: inspector.body.joint("hinge").position > 0.001, tick=tick)


def test_dark_mode_and_sizes(opened: tuple[Inspector, chromium.Page]) -> None:
    inspector, page = opened

    def tick() -> None:
        inspector.tick(0.02)

    until(lambda: page.place_of(page.with_text("Joints")), tick=tick)
    assert page.picture()[400:, -60:].mean() > 200
    page._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    until(lambda: page.picture()[400:, -60:].mean() < 80, tick=tick)
    page._call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "light"}])
    until(lambda: page.picture()[400:, -60:].mean() > 200, tick=tick)
    inside = (
        "(b => b.left >= 0 && b.right <= window.__viserMutable.canvas.getBoundingClientRect().right + 1)"
        "(document.querySelector('.roboyard-bar').getBoundingClientRect())"
    )
    for size in ((800, 600), (2560, 1440)):
        page.resize(*size)
        until(lambda size=size: page.evaluate("innerWidth") == size[0], tick=tick)
        until(lambda: page.evaluate(inside), tick=tick)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
