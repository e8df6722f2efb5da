"""Keys of pages, from a fake browser; real browsers are tested in `test_pages_in_chromium.py`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

from roboyard import World
from roboyard.viewer import Viewer
from roboyard.viewer.page.keys import MOST_HELD, KeyEvent, Keys

pytest.importorskip("viser")


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    world = World()
    world.add_plane()
    with Viewer(world, port=0, quiet=True) as shown:
        yield shown


class Typist:
    """Sends the messages of the script in a page."""

    def __init__(self, keys: Keys, page: Any) -> None:
        self._uuid, self._page, self._count = keys._script._uuid, page, 0

    def say(self, value: Any) -> None:
        self._count += 1
        self.say_raw(json.dumps([self._count, value]))

    def say_raw(self, text: Any) -> None:
        self._page.send(type="GuiUpdateMessage", uuid=self._uuid, updates={"value": text})


def test_keys_are_held_until_they_are_released(viewer, browser, wait) -> None:
    keys = Keys(viewer.server)
    events: list[KeyEvent] = []
    keys.subscribe(events.append)
    typist = Typist(keys, browser(viewer))
    typist.say([["a", True]])
    typist.say([["ArrowUp", True], ["a", True]])
    wait(lambda: len(events) == 2)
    assert keys.held == {"a", "ArrowUp"}
    typist.say([["a", False]])
    typist.say([["a", False]])
    typist.say([["b", True]])
    wait(lambda: len(events) == 4)
    assert [(e.key, e.is_down) for e in events] == [
        ("a", True),
        ("ArrowUp", True),
        ("a", False),
        ("b", True),
    ]
    assert keys.held == {"ArrowUp", "b"}


def test_a_closing_page_releases_only_its_own_keys(viewer, browser, wait) -> None:
    keys = Keys(viewer.server)
    first, second = browser(viewer), browser(viewer)
    Typist(keys, first).say([["a", True], ["b", True]])
    wait(lambda: keys.held == {"a", "b"})
    typist = Typist(keys, second)
    typist._count = 100  # a second identical message is not sent
    typist.say([["b", True], ["c", True]])
    wait(lambda: keys.held == {"a", "b", "c"})
    first.close()
    wait(lambda: keys.held == {"b", "c"})
    assert keys._held.keys() == {1}


@pytest.mark.parametrize(
    "rubbish",
    [
        "",
        "{",
        "[1]",
        "[" * 5000,
        json.dumps([1, "a"]),
        json.dumps([1, [["a"], 3, ["", True], ["x" * 99, True]]]),
    ],
)
def test_invalid_messages_are_ignored(viewer, browser, wait, rubbish: str) -> None:
    keys = Keys(viewer.server)
    typist = Typist(keys, browser(viewer))
    typist.say_raw(rubbish)
    typist.say_raw(json.dumps([2, [[7, True], ["a", 1]]]))
    typist.say([[f"F{k}", True] for k in range(100)])
    wait(lambda: keys.held)
    assert len(keys.held) == MOST_HELD
    assert "a" not in keys.held


def test_pages_get_the_script_with_the_grabbed_keys(viewer, browser) -> None:
    Keys(viewer.server, grab={"w", "ArrowUp"})
    message = browser(viewer).listen(
        lambda m: m["type"] == "RunJavascriptMessage" and 'name = "keys"' in m["source"]
    )
    assert 'grabbed = ["ArrowUp", "w"]' in message["source"]
