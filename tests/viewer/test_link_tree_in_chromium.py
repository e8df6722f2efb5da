"""The tree of links in a real browser: eyes, opacity, clicks in the tree and in the scene, keys."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from roboyard.viewer.inspector import Inspector, RobotSource

pytest.importorskip("viser")
sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
ROW = "[...document.querySelectorAll('[role=treeitem]')].find(e => e.ariaLabel === {!r})"
PICKED = "document.querySelector('[role=treeitem][aria-selected=true]')?.ariaLabel ?? null"
FOCUSED = "document.activeElement?.ariaLabel ?? null"
Opened = tuple[Inspector, chromium.Page, Callable[[], None]]


@pytest.fixture(scope="module")
def shared(gripper_text: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Opened]:
    folder = tmp_path_factory.mktemp("tree")
    file = folder / "gripper.urdf"
    red = '<material name="red"><color rgba="0.9 0 0 1"/></material></visual>'
    file.write_text(gripper_text.replace("</visual>", red))
    inspector = Inspector(RobotSource(name="gripper", urdf=file), port=0, quiet=True)
    page = chromium.Page(inspector.viewer.url, folder / "profile", (1280, 1000))

    def tick() -> None:
        inspector.tick(0.02)

    until(lambda: share(page, 0) > 0.005 and page.place_of(ROW.format("left")), tick=tick)
    yield inspector, page, tick
    page.close()
    inspector.close()


@pytest.fixture
def opened(shared: Opened) -> Opened:
    """Return the page with all visual meshes shown, opaque, and no link selected."""
    inspector, page, tick = shared
    tree = inspector.links.tree
    inspector.links.pick(None)
    tree.fade(0, 0, 1.0, below=True)
    for layer, on in ((0, True), (1, False)):
        tree.show(layer, -1, on)
    until(lambda: page.evaluate(PICKED) is None and share(page, 0) > 0.005, tick=tick)
    return shared


def share(page: chromium.Page, channel: int) -> float:
    """Return the fraction of the scene's pixels in which one channel dominates."""
    picture = page.picture()[60:, :860]
    others = np.delete(picture, channel, axis=2).max(axis=2)
    return float((picture[..., channel] > others + 60).mean())


def click_row(page: chromium.Page, name: str, inner: str = ".name") -> None:
    page.click_on(f"{ROW.format(name)}?.querySelector({inner!r})")


def switch(page: chromium.Page, name: str, layer: int, tick: Callable[[], None]) -> None:
    """Click on the button of a layer of a link, and wait until the tree shows it switched."""
    button = f"button[data-layer='{layer}']"
    pressed = f"{ROW.format(name)}?.querySelector({button!r})?.ariaPressed"
    before = page.evaluate(pressed)
    click_row(page, name, button)
    until(lambda: page.evaluate(pressed) != before, tick=tick)


def test_eyes_and_opacity_change_the_picture(opened: Opened) -> None:
    _, page, tick = opened
    red, green = share(page, 0), share(page, 1)
    switch(page, "palm", 0, tick)
    until(lambda: share(page, 0) < 0.8 * red, tick=tick)  # the palm is hidden, the fingers are not
    assert share(page, 0) > 0.1 * red
    switch(page, "palm", 1, tick)  # its collision shape, where the mesh was
    until(lambda: share(page, 1) > green + 0.001, tick=tick)
    switch(page, "palm", 1, tick)
    until(lambda: share(page, 1) < green + 0.0005, tick=tick)
    switch(page, "palm", 0, tick)
    until(lambda: share(page, 0) > 0.95 * red, tick=tick)
    # the palm almost transparent, by keys
    click_row(page, "palm")
    slider = "document.querySelector('.roboyard-fade input[data-layer=\"0\"]')"
    until(lambda: page.evaluate(PICKED) == "palm", tick=tick)
    page.evaluate(f"{slider}.focus()")
    page.press("Home")
    until(lambda: page.evaluate(f"{slider}.value") == "5", tick=tick)
    click_row(page, "palm")
    until(lambda: page.evaluate(PICKED) is None, tick=tick)
    until(lambda: share(page, 0) < 0.8 * red, tick=tick)


def test_a_click_selects_in_the_tree_and_in_the_scene(opened: Opened) -> None:
    inspector, page, tick = opened
    picture = page.picture()[60:, :860]
    rows, columns = np.nonzero(picture[..., 0] > picture[..., 1:].max(axis=2) + 60)
    at = len(rows) // 2
    page.click(int(columns[at]), int(rows[at]) + 60)
    name = until(lambda: page.evaluate(PICKED), tick=tick)
    assert inspector.links.picked is not None
    assert inspector.links.picked.name == name
    other = "right" if name != "right" else "left"
    click_row(page, other)
    until(lambda: page.evaluate(PICKED) == other, tick=tick)
    assert inspector.links.picked.name == other
    orange = (1.0, 0.45, 0.05)
    tinted = {s.owner for _, s in inspector.viewer.nodes._shapes.values() if s.rgba[:3] == orange}
    assert tinted == {(inspector.body.id, inspector.body.link(other).index)}


def test_keys_walk_through_the_tree_and_every_button_has_a_name(opened: Opened) -> None:
    inspector, page, tick = opened
    page.evaluate(f"{ROW.format('palm')}.focus()")
    for key, expected in (
        *(("ArrowDown", "left"), ("ArrowDown", "nail"), ("ArrowLeft", "left"), ("ArrowUp", "palm")),
        *(("End", "right"), ("Home", "palm"), ("ArrowRight", "left")),
    ):
        page.press(key)
        assert page.evaluate(FOCUSED) == expected, key
    page.press("ArrowLeft")  # closes the branch
    assert page.evaluate(f"{ROW.format('left')}.ariaExpanded") == "false"
    page.press("ArrowDown")
    assert page.evaluate(FOCUSED) == "right"
    page.press("Enter")
    until(lambda: page.evaluate(PICKED) == "right", tick=tick)
    inspector.links.pick(inspector.body.link("nail"))  # opens the branch of a selected link
    until(lambda: page.evaluate(PICKED) == "nail", tick=tick)
    assert page.evaluate(f"{ROW.format('left')}.ariaExpanded") == "true"
    unnamed = "[...document.querySelectorAll('.roboyard-tree :is(button, input[type=range])')]"
    assert page.evaluate(f"{unnamed}.filter(e => !e.ariaLabel).length") == 0
    assert page.evaluate(f"{unnamed}.length") > 10


def test_a_second_page_and_a_reloaded_one_show_the_same_tree(opened: Opened, tmp_path: Path) -> None:
    inspector, page, tick = opened
    switch(page, "left", 0, tick)
    until(lambda: "left" not in inspector.panels.visuals.shown, tick=tick)
    click_row(page, "right")
    pressed = f"{ROW.format('left')}?.querySelector('button').ariaPressed"
    second = chromium.Page(inspector.viewer.url, tmp_path / "second", (1280, 1000))
    try:
        for one in (page, second):
            until(lambda one=one: one.evaluate(PICKED) == "right", tick=tick)
            until(lambda one=one: one.evaluate(pressed) == "false", tick=tick)
        page.evaluate("location.reload()")
        until(lambda: page.evaluate("performance.getEntriesByType('navigation')[0].type") == "reload")
        until(lambda: page.evaluate(PICKED) == "right", tick=tick)
        assert page.evaluate(pressed) == "false"
    finally:
        second.close()
