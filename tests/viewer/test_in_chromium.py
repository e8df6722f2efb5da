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


def until(inspector: Inspector, so: Callable[[], Any], seconds: float = 180.0) -> Any:
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

    tick = lambda: inspector.tick(0.02)  # noqa: E731
    page.click_on(page.with_text("visual meshes"), tick=tick)
    until(inspector, lambda: share(page.picture(), 0) < 0.2 * red)
    page.click_on(page.with_text("collision shapes"), tick=tick)
    until(inspector, lambda: share(page.picture(), 1) > green + 0.002)

    page.click_on(page.with_text("Move"), tick=tick)
    page.click_on(chromium.TRACK, x=0.75, tick=tick)
    until(inspector, lambda: inspector.body.joint("grip").position > 0.3)
    assert inspector.body.joint("grip").position == pytest.approx(-0.2 + 0.75 * 1.0, abs=0.1)

    page.close()
    until(inspector, lambda: inspector.viewer.watchers == 0)
    inspector.play(True)
    inspector.tick(0.1)
    assert inspector.world.time > 0.05


def test_software_draws_few_triangles_until_asked_for_all(tmp_path: Path) -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=6, radius=0.5)
    ball.export(tmp_path / "ball.stl")
    file = tmp_path / "ball.urdf"
    file.write_text(
        '<robot name="ball"><link name="ball"><visual><geometry><mesh filename="ball.stl"/></geometry>'
        '<material name="red"><color rgba="0.9 0 0 1"/></material></visual></link></robot>'
    )
    inspector = Inspector(RobotSource(name="ball", urdf=file), port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, tmp_path / "profile")
    drawn = "window.__viserMutable?.scene?.__r3f?.root?.getState?.()?.gl?.info.render.triangles ?? 0"
    try:
        until(inspector, lambda: share(page.picture(), 0) > 0.01)
        until(inspector, lambda: 1000 < page.evaluate(drawn) < 40_000)
        low = page.picture()
        until(inspector, lambda: page.choose_quality("normal"))
        until(inspector, lambda: page.evaluate(drawn) > 80_000)
        until(inspector, lambda: len(inspector.viewer.nodes._replaced) == 0)
        red = (low[..., 0] > low[..., 1:].max(axis=2) + 60) & (low[..., 0] > 60)

        def is_alike() -> bool:  # light per corner and light per pixel
            return float(np.abs(page.picture() - low)[red].mean()) < 20

        until(inspector, is_alike)
    finally:
        page.close()
        inspector.close()
