"""Controls changed within one tick of a page all reach the server, in order. Skipped without Chromium."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("viser")
from roboyard.viewer.page.server import open_server, stop_server

sys.path.insert(0, str(Path(__file__).parent))
import chromium
from chromium import until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.PROGRAM is None, reason="needs Chromium"),
]
COUNT = 12


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[tuple[Any, chromium.Page]]:
    server = open_server("127.0.0.1", 0, "burst")
    page = chromium.Page(f"http://127.0.0.1:{server.get_port()}", tmp_path / "profile")
    yield server, page
    page.close()
    stop_server(server)


def test_a_burst_of_changes_arrives_in_order(opened: tuple[Any, chromium.Page]) -> None:
    server, page = opened
    heard: list[str] = []
    buttons = [server.gui.add_button(f"press {k}") for k in range(COUNT)]
    boxes = [server.gui.add_checkbox(f"tick {k}", False) for k in range(COUNT)]
    for k, handle in enumerate((*buttons, *boxes)):

        async def note(event: Any, name: str = f"{k}") -> None:
            heard.append(name)

        (handle.on_click if handle in buttons else handle.on_update)(note)
    until(lambda: page.place_of(page.with_text(f"tick {COUNT - 1}")))
    until(lambda: page.evaluate("!!window.__roboyardSend"))
    page.evaluate(
        "(() => { const of = kind => [...document.querySelectorAll(kind)];"
        "of('button').filter(e => e.textContent.startsWith('press ')).forEach(e => e.click());"
        f"{json.dumps([box._impl.uuid for box in boxes])}"
        ".forEach(id => document.getElementById(id).click()); })()"
    )
    until(lambda: len(heard) >= 2 * COUNT)
    assert heard == [str(k) for k in range(2 * COUNT)]
    assert all(box.value for box in boxes)
    # the same button, clicked often
    heard.clear()
    press = "[...document.querySelectorAll('button')].find(e => e.textContent === 'press 3')"
    page.evaluate(f"for (let k = 0; k < 30; k++) ({press}).click()")
    until(lambda: len(heard) >= 30)
    assert heard == ["3"] * 30
    # one box toggled within the pause: the page and the server agree at the end
    box = f"document.getElementById('{boxes[0]._impl.uuid}')"
    page.evaluate(
        "(async () => { for (let k = 0; k < 7; k++) { "
        f"({box}).click(); await new Promise(f => setTimeout(f, 10)); }} }})()"
    )
    until(lambda: len(heard) >= 30 + 7)
    assert heard[30:] == [str(COUNT)] * 7
    assert boxes[0].value is False
    assert page.evaluate(f"({box}).checked") is False


def test_a_dragged_slider_arrives_before_the_button_that_follows(opened: tuple[Any, chromium.Page]) -> None:
    server, page = opened
    slider = server.gui.add_slider("value", min=0.0, max=1.0, step=0.01, initial_value=0.0)
    button = server.gui.add_button("press")
    at_click: list[float] = []
    values: list[float] = []

    @slider.on_update
    async def moved(event: Any) -> None:
        values.append(event.target.value)

    @button.on_click
    async def pressed(_: Any) -> None:
        at_click.append(slider.value)

    track = "document.querySelector('[role=slider]')"
    until(lambda: page.place_of(track))
    until(lambda: page.evaluate("!!window.__roboyardSend"))
    page.evaluate(f"({track}).focus()")
    press = "[...document.querySelectorAll('button')].find(e => e.textContent === 'press')"
    # ten steps with the arrow key within one tick, then the button
    page.evaluate(
        "(async () => { const s = " + track + "; for (let k = 0; k < 10; k++) {"
        "const keys = {key: 'ArrowRight', code: 'ArrowRight', bubbles: true};"
        "s.dispatchEvent(new KeyboardEvent('keydown', keys));"
        "await new Promise(f => requestAnimationFrame(f)); }"
        f"({press}).click(); }})()"
    )
    until(lambda: at_click)
    shown = float(page.evaluate(f"({track}).getAttribute('aria-valuenow')"))
    assert shown == pytest.approx(0.1)
    assert at_click == [pytest.approx(shown)]
    assert len(values) < 10 or values == sorted(values)
