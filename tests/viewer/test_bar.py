"""State of the bar while several threads change it."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from roboyard import World

pytest.importorskip("viser")
from roboyard.viewer import Viewer


class SlowText(str):
    """A text whose comparison lets another thread run first."""

    compared: threading.Event
    changed: threading.Event
    __hash__ = str.__hash__

    def __new__(cls, text: str, compared: threading.Event, changed: threading.Event) -> SlowText:
        slow = super().__new__(cls, text)
        slow.compared, slow.changed = compared, changed
        return slow

    def __eq__(self, other: object) -> bool:
        self.compared.set()
        self.changed.wait(0.3)  # never comes where changes wait for each other
        return str.__eq__(self, other)

    def __ne__(self, other: object) -> bool:
        return not self == other


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    viewer = Viewer(World(), quiet=True)
    yield viewer
    viewer.close()


def test_a_pause_is_not_lost_while_the_simulation_shows_its_time(viewer: Viewer) -> None:
    compared, changed = threading.Event(), threading.Event()
    time = SlowText("1.00", compared, changed)
    simulation = threading.Thread(target=lambda: viewer.bar.show(time=time))
    simulation.start()
    assert compared.wait(5)
    viewer.bar.show(playing=False)
    changed.set()
    simulation.join(5)
    assert viewer.bar.state["playing"] is False
    assert viewer.bar.state["time"] == "1.00"
