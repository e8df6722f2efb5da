"""The last minute in a real browser: poses read from the page's scene against those that were simulated."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from roboyard import World
from roboyard.assets import asset_path
from roboyard.recording.state_log import load_log

pytest.importorskip("viser")
from roboyard.viewer import Viewer

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import slider, until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]

SLIDER = slider("Time")


class FallingArm:
    """A thread that steps an arm without motors, and remembers where its links were."""

    def __init__(self) -> None:
        self.world = World(timestep=0.005)
        self.world.add_plane()
        self.arm = self.world.add_urdf(asset_path("arm7"), fixed_base=True)
        moving = [joint for joint in self.arm.joints if joint.type != "fixed"]
        for joint, angle in zip(moving, (0.3, 0.7, 0.2, 0.9, 0.1, 0.4, 0.2), strict=False):
            joint.position = angle
            joint.disable_drive()
        self.viewer = Viewer(self.world, port=0, quiet=True)
        self.tip = self.arm.links[-1]
        self.path = self.viewer.path_of(self.tip)
        self.tips: list[tuple[float, np.ndarray]] = []
        self.is_stopped = False
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def _run(self) -> None:
        while not self.is_stopped:
            self.world.step()
            self.tips.append((self.world.time, self.tip.pose[0].copy()))
            time.sleep(0.004)

    def tip_at(self, seconds: float) -> np.ndarray:
        """Return where the tip was at a simulated time."""
        times = np.array([entry[0] for entry in self.tips])
        return self.tips[int(np.argmin(np.abs(times - seconds)))][1]

    def close(self) -> None:
        self.is_stopped = True
        self.viewer.close()
        if self._thread.ident is not None:
            self._thread.join(timeout=5)


def drawn(page: chromium.Page, path: str) -> np.ndarray:
    """Return the position of a node in the page's scene, below the root of the world (m)."""
    script = f"""(() => {{ const n = window.__viserMutable?.nodeRefFromName?.[{json.dumps(path)}];
        if (!n) return null; let o = n; const p = n.position.clone();
        for (o = n.parent; o && o.parent && o !== window.__viserMutable.nodeRefFromName['']; o = o.parent)
            p.applyMatrix4(o.matrix);
        return [p.x, p.y, p.z]; }})()"""
    return np.array(page.evaluate(script), dtype=float)


def open_folder(page: chromium.Page, name: str = "Last minute") -> None:
    page.click_on(page.with_text(name))


def press(page: chromium.Page, script: str) -> None:
    """Click in the middle of the element of a JavaScript expression."""
    page.click_on(script)


@pytest.fixture
def shown(tmp_path: Path) -> Iterator[tuple[FallingArm, chromium.Page]]:
    script = FallingArm()
    page = chromium.Page(script.viewer.url, tmp_path / "profile", (1280, 800))
    until(lambda: script.viewer.watchers == 1)
    until(lambda: page.evaluate(f"!!window.__viserMutable?.nodeRefFromName?.[{json.dumps(script.path)}]"))
    yield script, page
    page.close()
    script.close()


def test_the_past_is_shown_replayed_and_left(shown: tuple[FallingArm, chromium.Page], tmp_path: Path) -> None:
    script, page = shown
    viewer = script.viewer
    start = script.tip.pose[0].copy()
    np.testing.assert_allclose(drawn(page, script.path), start, atol=1e-4)
    script.start()
    until(lambda: script.world.time > 3.0)
    fallen = script.tip.pose[0].copy()
    assert np.linalg.norm(fallen - start) > 0.1
    open_folder(page)
    until(lambda: page.evaluate(f"!!{SLIDER}"))
    until(lambda: viewer.time_folder.slider.min <= -3.0)

    # keys move the slider to the oldest state, as the mouse does
    page.evaluate(f"{SLIDER}.focus()")
    page.press("Home")
    until(lambda: not viewer.playback.is_live)
    moment = viewer.playback.moment
    assert moment is not None
    past = script.tip_at(moment.snapshot.time)
    assert np.linalg.norm(past - script.tip.pose[0]) > 0.1
    until(lambda: np.abs(drawn(page, script.path) - past).max() < 1e-3)
    before = script.world.time
    until(lambda: script.world.time > before + 0.5)  # the simulation goes on
    np.testing.assert_allclose(drawn(page, script.path), past, atol=1e-3)
    until(lambda: page.evaluate("document.body.textContent").count("of simulated time"))

    # a press of the mouse in the middle: a later state
    track = f"{SLIDER}.closest('[class*=Slider-root]')"
    press(page, track)
    until(lambda: viewer.playback.moment is not moment)
    later = viewer.playback.moment
    assert later is not None
    assert later.snapshot.time > moment.snapshot.time + 0.5
    place = script.tip_at(later.snapshot.time)
    until(lambda: np.abs(drawn(page, script.path) - place).max() < 1e-3)

    # the shown moment arrives as a file
    page.save_downloads_in(tmp_path / "downloads")
    press(page, page.with_text("Save moment"))
    file = until(lambda: next((tmp_path / "downloads").glob("*.npz"), None))
    log = until(lambda: load_log(file))
    assert log.time[0] == later.snapshot.time
    np.testing.assert_array_equal(log.positions[0], later.snapshot.qpos[later.frames.position_columns.places])

    # a replay passes states between, and ends live
    press(page, page.with_text("Replay"))
    until(lambda: viewer.playback.is_replaying)
    seen = set()
    while viewer.playback.is_replaying:
        now = viewer.playback.moment
        if now is not None:
            seen.add(now.snapshot.time)
        time.sleep(0.02)
    assert len(seen) > 5
    assert min(seen) >= later.snapshot.time
    assert viewer.playback.is_live

    page.evaluate(f"{SLIDER}.focus()")
    page.press("Home")
    until(lambda: not viewer.playback.is_live)
    press(page, page.with_text("Live"))
    until(lambda: viewer.playback.is_live)
    viewer.gate.play(False)
    until(lambda: np.abs(drawn(page, script.path) - script.tip.pose[0]).max() < 1e-3)
    until(lambda: float(page.evaluate(f"{SLIDER}.getAttribute('aria-valuenow')")) == 0.0)


def choose(page: chromium.Page, label: str, option: str) -> None:
    """Choose an option of one of the panel's lists."""
    labels = (
        f"[...document.querySelectorAll('label')].find(l => l.textContent.trim() === {json.dumps(label)})"
    )
    field = f"document.getElementById({labels}?.htmlFor)"
    until(lambda: page.evaluate(f"{field}?.getClientRects().length > 0"))
    press(page, field)
    options = "[...document.querySelectorAll('[role=option]')].filter(e => e.getClientRects().length)"
    found = f"{options}.find(e => e.textContent.trim() === {json.dumps(option)})"
    until(lambda: page.evaluate(f"!!{found}"))
    press(page, found)
    until(lambda: page.evaluate(f"{field}.value") == option)


def plotted(page: chromium.Page, share: float) -> dict[str, float]:
    """Return the legend of the plot under the mouse, at a share of its width: labels and values."""
    place = until(lambda: page.place_of("document.querySelector('.u-over')", x=share))
    page.hover(place[0] + 3, place[1])
    page.hover(*place)
    rows = until(
        lambda: page.evaluate(
            "[...document.querySelectorAll('.u-legend .u-series')].map(e =>"
            "[e.querySelector('.u-label').textContent, e.querySelector('.u-value').textContent])"
        )
    )
    if any(value == "--" for _, value in rows):
        return {}
    return {label: float(value.replace("\u2212", "-").replace(",", "")) for label, value in rows}


def test_signals_are_plotted(shown: tuple[FallingArm, chromium.Page]) -> None:
    script, page = shown
    viewer = script.viewer
    joint = script.arm.joint("joint2")
    angles: list[tuple[float, float, float]] = []
    script.world.after_step.append(
        lambda: angles.append((script.world.time, float(joint.position), float(joint.velocity)))
    )
    open_folder(page, "Signals")
    script.start()
    until(lambda: script.world.time > 2.0)
    script.viewer.gate.play(False)

    def is_held() -> bool:
        before = script.world.time
        time.sleep(0.5)
        return script.world.time == before

    until(is_held)
    now = viewer.moments.all()[-1].snapshot.time
    times = np.array([entry[0] for entry in angles])
    for kind, label, column in (
        ("joint position", "position (rad)", 1),
        ("joint velocity", "velocity (rad/s)", 2),
    ):
        choose(page, "signal", kind)
        choose(page, "of", "arm7/joint2")
        until(lambda label=label: label in plotted(page, 0.3))
        for share in (0.1, 0.5, 0.9):
            seen = until(lambda share=share: plotted(page, share))
            k = int(np.argmin(np.abs(times - (now + seen["s before now"]))))
            near = [entry[column] for entry in angles[max(k - 2, 0) : k + 3]]  # the legend has few digits
            assert min(near) - 0.01 <= seen[label] <= max(near) + 0.01

    # while scrubbing the text has the value of the shown state
    viewer.playback.scrub(1.0)
    moment = viewer.playback.moment
    assert moment is not None
    speed = angles[int(np.argmin(np.abs(times - moment.snapshot.time)))][2]
    until(lambda: f"velocity (rad/s): {speed:.4g}" in page.evaluate("document.body.textContent"))
    choose(page, "signal", "(none)")
    until(lambda: not page.evaluate("!!document.querySelector('.u-over')"))
