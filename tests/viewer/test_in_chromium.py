"""The inspector in a real browser: pixels, not only messages. Skipped without Chromium."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from roboyard.viewer.inspector import Inspector, RobotSource

sys.path.insert(0, str(Path(__file__).parent))
import chromium

pytest.importorskip("viser")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]


@pytest.fixture
def shown(gripper: Path, tmp_path: Path) -> Iterator[tuple[Inspector, chromium.Page]]:
    text = gripper.read_text().replace(
        "</geometry></visual>",
        '</geometry><material name="red"><color rgba="0.9 0 0 1"/></material></visual>',
    )
    gripper.write_text(text)
    inspector = Inspector(RobotSource(name="gripper", urdf=gripper), port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, tmp_path / "profile")
    yield inspector, page
    page.close()
    inspector.close()


def until(inspector: Inspector, so: Callable[[], Any], seconds: float = 40.0) -> Any:
    """Run the inspector until a condition is true."""
    import time

    end = time.monotonic() + seconds
    while time.monotonic() < end:
        inspector.tick(0.02)
        found = so()
        if found:
            return found
        time.sleep(0.05)
    pytest.fail("waited in vain")
    return None


def share(picture: np.ndarray, channel: int) -> float:
    """Return the fraction of the pixels in which one channel dominates."""
    others = np.delete(picture, channel, axis=2).max(axis=2)
    return float((picture[..., channel] > others + 60).mean())


def test_the_robot_is_shown_switched_and_moved(shown: tuple[Inspector, chromium.Page]) -> None:
    inspector, page = shown
    until(inspector, lambda: inspector.viewer.watchers == 1)
    until(inspector, lambda: share(page.picture(), 0) > 0.005)
    red, green = share(page.picture(), 0), share(page.picture(), 1)

    page.click(*until(inspector, lambda: page.place_of(page.with_text("visual meshes"))))
    until(inspector, lambda: share(page.picture(), 0) < 0.2 * red)
    page.click(*until(inspector, lambda: page.place_of(page.with_text("collision shapes"))))
    until(inspector, lambda: share(page.picture(), 1) > green + 0.002)

    page.click(*until(inspector, lambda: page.place_of(page.with_text("Move"))))
    track = chromium.TRACK
    place = until(inspector, lambda: page.place_of(track, x=0.75))
    until(inspector, lambda: page.place_of(track, x=0.75) == place)
    page.click(*page.place_of(track, x=0.75))
    until(inspector, lambda: inspector.body.joint("grip").position > 0.3)
    assert inspector.body.joint("grip").position == pytest.approx(-0.2 + 0.75 * 1.0, abs=0.1)

    page.close()
    until(inspector, lambda: inspector.viewer.watchers == 0)
    inspector.play(True)
    inspector.tick(0.1)
    assert inspector.world.time > 0.05
