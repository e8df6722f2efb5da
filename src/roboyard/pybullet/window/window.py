"""The page of a client: drawing, keyboard, mouse, and updates from the world."""

from __future__ import annotations

import logging
import sys
from time import perf_counter
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.turns import TURNS
from roboyard.pybullet.state.input_events import key_code
from roboyard.pybullet.window.camera import WindowCamera
from roboyard.pybullet.window.drawing import drawing_of
from roboyard.pybullet.window.previews import Previews
from roboyard.pybullet.window.sliders import Sliders
from roboyard.pybullet.window.switches import DEFAULTS, SHORTCUTS, Switches, is_on
from roboyard.viewer import Viewer
from roboyard.viewer.bar.bar import Controls
from roboyard.viewer.page.browser import open_page
from roboyard.viewer.page.keys import KeyEvent, Keys
from roboyard.viewer.page.pointer import Pointer, PointerEvent

if TYPE_CHECKING:
    from roboyard.pybullet.window.options import WindowOptions
    from roboyard.pybullet.window.shared_client import SharedClient

log = logging.getLogger(__name__)

TITLE = "Roboyard"
COMPILE_DELAY = 0.1
"""Time from the first added or removed body to showing it (s), since scripts load many in a row."""
COMPILE_INTERVAL_FACTOR = 5.0
"""Shortest time between two compiles for the window, in compile times."""
SCRIPT_KEYS = (
    *"abcdefghijklmnopqrstuvwxyz0123456789 -=[];',./\\`",
    *("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown", "Home", "End", "Enter", "Alt"),
)
"""Keys that are sent to the script instead of the page."""


class Window:
    """The page of one client. Its thread works only while a browser is connected."""

    def __init__(self, client: SharedClient, options: WindowOptions) -> None:
        """Open the page.

        Raises:
            MissingExtraError: viser is not installed.
            ConfigError: no port is free.
        """
        self._client = client
        self.update_requested = False
        """Set by the viewer's thread: the next command updates the window when it ends."""
        self._viewer = Viewer(
            client.scene.world, options.host, options.port, title=TITLE, quiet=True, follow_steps=False
        )
        self._viewer.rate = min(self._viewer.rate, 1000.0 / options.frame_ms)
        server = self._viewer.server
        self._viewer.first_view.release()  # the visualizer's camera decides
        self.camera = WindowCamera(server, options, client.visualizer)
        self._dragging = self._viewer.grab
        self._switches = Switches(self._viewer, self._dragging, options.background)
        self._sliders = Sliders(server)
        self.previews = Previews(server)
        self._keys = Keys(server, SCRIPT_KEYS)
        self._keys.subscribe(self._on_key)
        self._pointer = Pointer(server, self._on_mouse)
        server.on_client_disconnect(self._on_disconnect)
        self.gate = self._viewer.gate
        """Holds stepSimulation while the page is paused."""
        self._viewer.bar.controls = Controls(
            play=self.gate.play,
            step=self.gate.step,
            reset=lambda: self.gate.do(self._reset),
            set_speed=self.gate.set_speed,
            home=self._viewer.go_home,
            refresh=self._refresh,
        )
        self._items_revision = -1
        self._stale_since: float | None = None
        self._compile_delay = COMPILE_DELAY
        self._viewer.before_frame.append(self._before_frame)
        self.url: str = self._viewer.url
        print(f"roboyard: the GUI is at {self.url}", file=sys.stderr, flush=True)
        open_page(self.url)

    def close(self) -> None:
        """Close the page."""
        self._viewer.close()

    def before_step(self) -> None:
        """Wait while the page is paused or the script is ahead of the chosen speed.

        Call it without the lock.
        """
        if self._viewer.watchers:
            self._keep_start()
        if not self.gate.is_open():
            with TURNS.given_up():
                self.gate.wait(self._client.scene.world.time)

    def _keep_start(self) -> None:
        """Save the state to which Reset returns: the one in which bodies were last added or removed."""
        with self._client.lock:
            world = self._client.scene.world
            if not world.is_stale:
                self._viewer.start_state.keep(world, is_held=self._dragging.is_holding)

    def _reset(self) -> None:
        with self._client.lock:
            scene = self._client.scene
            self._dragging.release(scene.world)
            if not self._viewer.start_state.restore(scene.world):
                return
            for record in scene.bodies.values():
                record.fixed_poses = record.placed = None
            scene.mark_moved()
            self._client.is_changed = True

    def _refresh(self) -> None:
        self._client.is_changed = True

    # ----------------------------------------------------------------- under the client's lock, in any thread

    def aim_new_pages(self) -> None:
        """Move the camera of pages that open later; `update` moves those of open ones."""
        if not self._viewer.watchers:
            self.camera.push(self._client.script_camera)

    def update(self) -> None:
        """Update the page with the changes since the last update."""
        self.update_requested = False
        try:
            self._update()
        except Exception:  # an error of the page must not stop the script
            self._client.is_changed = True
            log.exception("the window could not be updated")

    def _update(self) -> None:
        client, viewer = self._client, self._viewer
        camera = client.visualizer
        self.camera.push(camera)
        scene = client.scene
        if self._dragging.is_pending:
            self._dragging.apply(scene.world, scene.time_step)
            client.is_changed = True
        if not is_on(camera, c.COV_ENABLE_RENDERING) or not client.is_changed or not self._may_compile():
            return
        client.is_changed = False  # first: the page may change something meanwhile
        start, was_stale = perf_counter(), scene.world.is_stale
        if scene.world is viewer.world:
            viewer.sync()
        else:
            viewer.show_world(scene.world)
            self._items_revision = -1
        if was_stale:
            self._compile_delay = max(COMPILE_DELAY, COMPILE_INTERVAL_FACTOR * (perf_counter() - start))
        items = list(client.debug_items.drawings())
        revision = (client.debug_items.revision, viewer.world.revision)
        if revision != self._items_revision:
            self._items_revision = revision
            viewer.draw(drawing_of((item for _, item in items), scene))
        if client.debug_items.has_expiring:
            client.is_changed = True

    def _may_compile(self) -> bool:
        """Return whether the world may be compiled; not while a script loads many bodies."""
        if not self._client.scene.world.is_stale:
            self._stale_since = None
            return True
        now = perf_counter()
        if self._stale_since is None:
            self._stale_since = now
        if now - self._stale_since < self._compile_delay:
            return False
        self._stale_since = None
        return True

    # ----------------------------------------------------------------------------- in the viewer's own thread

    def _before_frame(self) -> None:
        client = self._client
        self.update_requested = True
        if client.lock.acquire(timeout=0.002):
            try:
                if self.update_requested and not client.depth:
                    self.update()
            finally:
                client.lock.release()
        self._switches.apply(client.script_camera)
        self._sliders.show(dict(client.debug_items.parameters))
        self.previews.show(client.script_camera)

    # ----------------------------------------------------------------------------- in the server's event loop

    def _on_key(self, event: KeyEvent) -> None:
        code = key_code(event.key)
        if code is None:
            return
        keyboard = self._client.keyboard
        (keyboard.press if event.is_down else keyboard.release)(code)
        camera = self._client.script_camera
        if event.is_down and code in SHORTCUTS and is_on(camera, c.COV_ENABLE_KEYBOARD_SHORTCUTS):
            flag = SHORTCUTS[code]
            camera.switches[flag] = not camera.switches.get(flag, DEFAULTS[flag])

    async def _on_disconnect(self, client: Any) -> None:
        self._dragging.drop(client.client_id)
        self.update_requested = self.update_requested or self._dragging.is_pending

    def _on_mouse(self, event: PointerEvent) -> None:
        mouse = self._client.mouse
        if event.kind == "move":
            mouse.move(event.x, event.y)
        else:
            mouse.button(event.x, event.y, event.button, is_down=event.kind == "down")
