"""Changes by a script's thread and by the event loop of a page's server in the same instant."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import roboyard.pybullet as p
from roboyard import World
from roboyard.pybullet.connections import CLIENTS

pytest.importorskip("viser")
from roboyard.viewer import Viewer
from roboyard.viewer.page import first_view
from roboyard.viewer.page.page_camera import PageCamera, View
from roboyard.viewer.scene.drags import Drag
from roboyard.viewer.scene.grab import Grab


def meanwhile(act: Callable[[], Any], seconds: float = 0.3) -> threading.Thread:
    """Let another thread act; waits for it unless it waits for this one."""
    other = threading.Thread(target=act)
    other.start()
    other.join(seconds)
    return other


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    world = World()
    world.add_plane()
    world.add_box((0.2, 0.2, 0.2), position=(0.0, 0.0, 0.1))
    viewer = Viewer(world, port=0, quiet=True)
    yield viewer
    viewer.close()


def test_a_page_that_opens_shows_no_older_state_than_the_last(viewer: Viewer) -> None:
    newest = viewer._latest

    class Older:
        def now(self) -> Any:
            viewer._latest = newest  # the world is stepped while the positions are copied
            return self

    viewer._latest = Older()  # type: ignore[assignment]
    asyncio.run(viewer._on_connect(SimpleNamespace(client_id=9)))
    assert viewer._latest is newest


def test_a_slider_that_a_page_has_just_moved_stays(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = viewer.time_folder
    viewer.watchers += 1  # states are recorded while a page is open
    for _ in range(500):
        viewer.world.step()
    viewer.watchers -= 1
    everything = viewer.moments.all

    def slow() -> Any:
        folder.slider._impl.value = -0.5  # viser sets it before it calls the callback
        return everything()

    monkeypatch.setattr(viewer.moments, "all", slow)
    folder.show()
    monkeypatch.undo()
    assert folder.slider.value == -0.5
    asyncio.run(folder._on_slider(SimpleNamespace(client_id=1, target=folder.slider)))
    assert viewer.playback.before_now == pytest.approx(0.5, abs=0.02)
    viewer.playback.go_live()
    folder.show()
    assert folder.slider.value == 0.0


def test_a_page_that_closes_while_a_body_is_added_is_no_error(
    viewer: Viewer, browser: Any, wait: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    browser(viewer)
    wait(lambda: viewer.watchers == 1)
    wait(lambda: viewer.first_view._aimed)
    seen = []

    def closing(*_: Any) -> bool:
        seen.extend(viewer.first_view._aimed)
        viewer.first_view._aimed.clear()
        return True

    monkeypatch.setattr(first_view, "_is_at", closing)
    viewer.world.add_box((0.1, 0.1, 0.1), position=(3.0, 0.0, 0.1))
    viewer.sync()
    assert len(seen) == 1


class InitialCamera:
    """Lets a page report its camera while a script moves it."""

    def __init__(self, report: Callable[[], Any]) -> None:
        self._report = report
        self.fov = 1.0
        self.look_at = self.up = np.zeros(3)

    @property
    def position(self) -> np.ndarray:
        return np.zeros(3)

    @position.setter
    def position(self, _: np.ndarray) -> None:
        meanwhile(self._report)


def test_a_camera_that_a_script_moves_is_not_where_it_was_before() -> None:
    old = SimpleNamespace(
        position=np.array([1.0, 0.0, 0.0]),
        look_at=np.zeros(3),
        up_direction=np.array([0.0, 0.0, 1.0]),
        image_width=640,
        image_height=480,
    )
    client = SimpleNamespace(client_id=3, camera=old, atomic=threading.Lock)
    old.client = client
    server = SimpleNamespace(
        initial_camera=InitialCamera(lambda: asyncio.run(pages._on_update(old))),
        get_clients=lambda: {3: client},
        on_client_connect=lambda _: None,
        on_client_disconnect=lambda _: None,
    )
    pages = PageCamera(server, 1.0)
    asyncio.run(pages._on_update(old))
    assert pages.take_moved() is not None
    pages.aim(View(eye=np.array([0.0, 5.0, 0.0]), target=np.zeros(3), up=np.array([0.0, 0.0, 1.0])))
    assert pages.take_moved() is None


class SlowGrab(Grab):
    """A drag begins while the one before is looked at."""

    begin: Callable[[], Any] | None = None
    _first: Drag | None = None

    @property
    def _start(self) -> Drag | None:  # type: ignore[override]
        first, begin, self.begin = self._first, self.begin, None
        if begin is not None:
            meanwhile(begin)
        return first

    @_start.setter
    def _start(self, drag: Drag | None) -> None:
        self._first = drag


def test_a_drag_that_begins_while_a_step_looks_for_one_is_not_lost(viewer: Viewer, wait: Any) -> None:
    box = viewer.world.bodies[1]
    grab = SlowGrab()
    drag = Drag(phase="start", owner=(box.id, 0), grip=(0.0, 0.0, 0.2), target=(0.0, 0.0, 0.5), client=1)
    grab.drop()  # something to do
    grab.begin = lambda: grab.on_drag(drag)
    grab.apply(viewer.world, viewer.world.timestep)
    wait(lambda: grab.drag is drag)
    grab.apply(viewer.world, viewer.world.timestep)
    assert grab.is_holding


def test_a_dropped_drag_comes_back_with_the_next_press_only(viewer: Viewer) -> None:
    """A reset drops a drag of which its page knows nothing: motions of the mouse that follow pull nothing."""
    world = viewer.world
    box, grab = world.bodies[1], Grab()

    def drag(phase: Any) -> None:
        at = {"grip": (0.0, 0.0, 0.2), "target": (0.0, 0.0, 0.5)}
        grab.on_drag(Drag(phase=phase, owner=(box.id, 0), client=1, **at))
        grab.apply(world, world.timestep)

    drag("start")
    assert grab.is_holding
    grab.release(world)
    drag("update")
    assert grab.drag is None and not grab.is_holding and not world.constraints.all
    drag("start")
    drag("update")
    assert grab.is_holding


def test_a_drag_that_goes_on_while_it_is_released_is_released(viewer: Viewer) -> None:
    world = viewer.world
    box, grab = world.bodies[1], SlowGrab()
    start, update = (
        Drag(phase=phase, owner=(box.id, 0), grip=(0.0, 0.0, 0.2), target=(0.0, 0.0, 0.5), client=1)
        for phase in ("start", "update")
    )
    grab.on_drag(start)
    grab.apply(world, world.timestep)
    assert grab.is_holding
    grab.begin = lambda: grab.on_drag(update)
    grab.release(world)
    assert not grab.is_holding and not world.constraints.all


def test_forces_switched_on_while_the_window_is_updated_are_shown(
    monkeypatch: pytest.MonkeyPatch, browser: Any, wait: Any
) -> None:
    monkeypatch.delenv("ROBOYARD_VIEWER", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    p.connect(p.GUI, options="--port=0")
    try:
        client: Any = CLIENTS[0]
        window = client.window
        p.setGravity(0, 0, -10)
        half = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.1])
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
        p.createMultiBody(1, half, basePosition=[0, 0, 0.1])
        browser(window._viewer)
        wait(lambda: window._viewer.watchers == 1)
        for _ in range(60):
            p.stepSimulation()
        sync = window._viewer.sync

        def slow() -> None:
            sync()
            monkeypatch.setattr(window._viewer, "sync", sync)
            window._viewer.bar.show(forces=True)  # a page asks for the forces in the same instant
            window._viewer.bar.controls.refresh()

        monkeypatch.setattr(window._viewer, "sync", slow)
        with client.lock:
            client.is_changed = True
        wait(lambda: window._viewer.server.scene.get_handle_by_name("/roboyard contact forces"))
    finally:
        for number in list(CLIENTS):
            p.disconnect(number)
