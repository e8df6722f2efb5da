"""Two tabs of the inspector, and one that is loaded again: they show the same as the server."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser")
from roboyard.viewer.inspector import Inspector, RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import slider, until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
SLIDER = slider("hinge")
VALUE = f"Number({SLIDER}?.getAttribute('aria-valuenow') ?? 9)"
TURN = "window.__viserMutable?.nodeRefFromName?.['/pendulum/bob']?.quaternion?.toArray()"
"""JavaScript for the drawn orientation of the pendulum (x, y, z, w)."""
RELOADED = "window.__before === undefined && document.readyState === 'complete'"


def test_two_tabs_and_a_reloaded_one_agree(pendulum: Path, tmp_path: Path) -> None:
    pendulum.write_text(
        pendulum.read_text().replace(
            "</geometry></visual>",
            '</geometry><material name="red"><color rgba="0.9 0 0 1"/></material></visual>',
        )
    )
    inspector = Inspector(RobotSource(name="pendulum", urdf=pendulum), port=0, quiet=True)
    pages = []

    def tick() -> None:
        inspector.tick(0.02)

    def middle(page: chromium.Page) -> float | None:
        """Return how far right of the middle the red pixels are (pixels); None: there are none."""
        width = page.evaluate("window.__viserMutable?.canvas?.getBoundingClientRect().width")
        if not width:
            return None
        picture = page.picture()[60:, : round(width)]
        red = picture[..., 0] > picture[..., 1:].max(axis=2) + 60
        return float(np.nonzero(red)[1].mean()) - width / 2 if red.sum() > 100 else None

    def has_moved(page: chromium.Page, start: float) -> bool:
        """Whether the red pixels are elsewhere; the width of a page's panel, thus of its picture, varies."""
        found = middle(page)
        return found is not None and abs(found - start) > 20

    def shows(page: chromium.Page, angle: float) -> bool:
        """Whether a page draws the pendulum at an angle (rad) about its hinge, along y."""
        turn = page.evaluate(TURN)
        return turn is not None and np.allclose(turn, [0, np.sin(angle / 2), 0, np.cos(angle / 2)], atol=1e-4)

    def settled(page: chromium.Page) -> float:
        """Return `middle` once ten pictures in succession agree: the page draws what it received late."""
        seen: list[float | None] = []

        def is_still() -> bool:
            seen.append(middle(page))
            return len(seen) >= 10 and None not in seen[-10:] and len(set(seen[-10:])) == 1

        until(is_still, tick=tick)
        assert seen[-1] is not None
        return seen[-1]

    def open_move_tab(page: chromium.Page) -> bool:
        """Click on the tab with the sliders until they are shown."""
        if page.evaluate(f"{SLIDER}?.getClientRects().length"):
            return True
        place = page.place_of(page.with_text("Move"))
        if place is not None:
            page.click(*place)
        return False

    def move(page: chromium.Page, key: str, goal: float) -> None:
        """Move the hinge to a limit by a key on its slider, pressed until it moves."""
        seen: list[tuple[float, float]] = []

        def is_there() -> bool:
            seen.append((page.evaluate(VALUE), inspector.body.joint("hinge").position))
            if abs(seen[-1][1] - goal) < 0.01:
                return True
            page.evaluate(f"{SLIDER}.focus()")
            for one in ({"End": "Home", "Home": "End"}[key], key):  # the first makes the second a change
                page.press(one)
            return False

        try:
            until(is_there, tick=tick)
        except AssertionError as error:
            raise AssertionError(f"slider and hinge were at {seen[-5:]}") from error

    try:
        for number in range(2):
            pages.append(chromium.Page(inspector.viewer.url, tmp_path / f"profile {number}"))
            until(lambda: middle(pages[-1]) is not None, tick=tick)
            until(lambda: open_move_tab(pages[-1]), tick=tick)
        starts = [settled(page) for page in pages]
        assert all(shows(page, 0.0) for page in pages)
        move(pages[0], "End", 2.0)
        for page, start in zip(pages, starts, strict=True):
            until(lambda page=page: page.evaluate(VALUE) == 2.0, tick=tick)
            until(lambda page=page: shows(page, 2.0), tick=tick)
            until(lambda page=page, start=start: has_moved(page, start), tick=tick)
        pages[0].evaluate("window.__before = 1; location.reload()")
        until(lambda: pages[0].evaluate(RELOADED), tick=tick)
        until(lambda: shows(pages[0], 2.0), tick=tick)
        shown = settled(pages[0])
        assert abs(shown - starts[0]) > 20
        until(lambda: open_move_tab(pages[0]), tick=tick)
        until(lambda: pages[0].evaluate(VALUE) == 2.0, tick=tick)
        # the tab that stayed open moves the robot in the reloaded one
        move(pages[1], "Home", -2.0)
        until(lambda: pages[0].evaluate(VALUE) == -2.0, tick=tick)
        until(lambda: shows(pages[0], -2.0), tick=tick)
        until(lambda: has_moved(pages[0], shown), tick=tick)
        pages[1].close()
        until(lambda: inspector.viewer.watchers == 1, tick=tick)
        assert pages[0].evaluate(VALUE) == -2.0
    finally:
        for page in pages:
            page.close()
        inspector.close()
