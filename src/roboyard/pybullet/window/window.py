"""A client's page: what it shows, what it hears, and when it looks at the world."""

from __future__ import annotations

import logging
import sys
from time import perf_counter
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.state.input_events import key_code
from roboyard.pybullet.window.camera import WindowCamera
from roboyard.pybullet.window.dragging import Dragging
from roboyard.pybullet.window.drawing import drawing_of
from roboyard.pybullet.window.previews import Previews
from roboyard.pybullet.window.sliders import Sliders
from roboyard.pybullet.window.switches import AT_START, SHORTCUTS, Switches, is_on
from roboyard.viewer import Viewer
from roboyard.viewer.page.browser import open_page
from roboyard.viewer.page.keys import KeyEvent, Keys
from roboyard.viewer.page.pointer import Pointer, PointerEvent

if TYPE_CHECKING:
    from roboyard.pybullet.window.options import WindowOptions
    from roboyard.pybullet.window.shared_client import SharedClient

log = logging.getLogger(__name__)

TITLE = "Roboyard"
PATIENCE = 0.1
"""s from the first body that came or went to showing it: scripts load many in a row"""
SHARE = 5.0
"""After a compile for the window's sake, the next waits at least this many times as long as it took."""
GRABBED = (
    *"abcdefghijklmnopqrstuvwxyz0123456789 -=[];',./\\`",
    *("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown", "Home", "End", "Enter", "Alt"),
)
"""Keys that belong to the script, not to the page."""


class Window:
    """The page of one client. Its own thread works while somebody watches; everything else is cheap."""

    def __init__(self, client: SharedClient, options: WindowOptions) -> None:
        """Open it.

        Raises:
            MissingExtraError: viser is not installed.
            ConfigError: no port is free.
        """
        self._client = client
        self.wants_to_look = False
        """Set by the viewer's thread: the next command lets the window look when it ends."""
        self._viewer = Viewer(
            client.scene.world, options.host, options.port, title=TITLE, quiet=True, follow_steps=False
        )
        self._viewer.rate = min(self._viewer.rate, 1000.0 / options.frame_ms)
        server = self._viewer.server
        self.camera = WindowCamera(server, options, client.visualizer)
        self._dragging = Dragging()
        self._switches = Switches(self._viewer, self._dragging, options.background)
        self._sliders = Sliders(server)
        self.previews = Previews(server)
        self._keys = Keys(server, GRABBED)
        self._keys.subscribe(self._hear_key)
        self._pointer = Pointer(server, self._hear_mouse)
        server.on_client_disconnect(self._on_disconnect)
        self._items_revision = -1
        self._stale_since: float | None = None
        self._patience = PATIENCE
        self._viewer.before_frame.append(self._before_frame)
        self.url: str = self._viewer.url
        print(f"roboyard: the GUI is at {self.url}", file=sys.stderr, flush=True)
        open_page(self.url)

    def close(self) -> None:
        """Take the page down."""
        self._viewer.close()

    # ----------------------------------------------------------------- under the client's lock, in any thread

    def aim_ahead(self) -> None:
        """Let a page that opens look from where the script does; open ones are aimed by `look`."""
        if not self._viewer.watchers:
            self.camera.push(self._client.script_camera)

    def look(self) -> None:
        """See what has changed since the last look."""
        self.wants_to_look = False
        try:
            self._look()
        except Exception:  # a page that cannot be drawn is no reason to stop the script
            log.exception("the window cannot show the world")

    def _look(self) -> None:
        client, viewer = self._client, self._viewer
        camera = client.visualizer
        self.camera.push(camera)
        scene = client.scene
        if self._dragging.is_pending:
            self._dragging.apply(scene)
            client.is_changed = True
        if not is_on(camera, c.COV_ENABLE_RENDERING) or not client.is_changed or not self._may_compile():
            return
        start, was_stale = perf_counter(), scene.world.is_stale
        if scene.world is viewer.world:
            viewer.sync()
        else:
            viewer.show_world(scene.world)
            self._items_revision = -1
        if was_stale:
            self._patience = max(PATIENCE, SHARE * (perf_counter() - start))
        items = list(client.debug_items.drawings())
        revision = (client.debug_items.revision, viewer.world.revision)
        if revision != self._items_revision:
            self._items_revision = revision
            viewer.draw(drawing_of((item for _, item in items), scene))
        client.is_changed = client.debug_items.has_ends

    def _may_compile(self) -> bool:
        """Not while a script is loading one body after the other."""
        if not self._client.scene.world.is_stale:
            self._stale_since = None
            return True
        now = perf_counter()
        if self._stale_since is None:
            self._stale_since = now
        if now - self._stale_since < self._patience:
            return False
        self._stale_since = None
        return True

    # ----------------------------------------------------------------------------- in the viewer's own thread

    def _before_frame(self) -> None:
        client = self._client
        self.wants_to_look = True
        if client.lock.acquire(timeout=0.002):
            try:
                if self.wants_to_look and not client.depth:
                    self.look()
            finally:
                client.lock.release()
        self._switches.apply(client.script_camera)
        self._sliders.show(dict(client.debug_items.parameters))
        self.previews.show(client.script_camera)

    # ----------------------------------------------------------------------------- in the server's event loop

    def _hear_key(self, event: KeyEvent) -> None:
        code = key_code(event.key)
        if code is None:
            return
        keyboard = self._client.keyboard
        (keyboard.press if event.is_down else keyboard.release)(code)
        camera = self._client.script_camera
        if event.is_down and code in SHORTCUTS and is_on(camera, c.COV_ENABLE_KEYBOARD_SHORTCUTS):
            flag = SHORTCUTS[code]
            camera.switches[flag] = not camera.switches.get(flag, AT_START[flag])

    async def _on_disconnect(self, client: Any) -> None:
        self._dragging.drop(client.client_id)
        self.wants_to_look = self.wants_to_look or self._dragging.is_pending

    def _hear_mouse(self, event: PointerEvent) -> None:
        mouse = self._client.mouse
        if event.kind == "move":
            mouse.move(event.x, event.y)
        else:
            mouse.button(event.x, event.y, event.button, is_down=event.kind == "down")
