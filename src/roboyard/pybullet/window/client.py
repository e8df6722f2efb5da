"""A client with a window: commands, the window and the clock share its lock."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.logs.videos import open_video
from roboyard.pybullet.state.visualizer_camera import VisualizerCamera
from roboyard.pybullet.window.clock import Clock
from roboyard.pybullet.window.options import WindowOptions
from roboyard.pybullet.window.shared_client import SharedClient
from roboyard.pybullet.window.window import Window


class WindowClient(SharedClient):
    """A client with a page in the browser.

    Each command holds the lock. A window that needs an update gets the lock when the running command ends: it
    delays at most one command, for as long as it takes to copy positions.
    """

    def __init__(self, method: int, options: WindowOptions) -> None:
        """Open the page.

        Raises:
            MissingExtraError: viser is not installed.
            ConfigError: no port is free.
        """
        self.window: Window | None = None
        super().__init__(method)
        _install()
        self.visualizer.width, self.visualizer.height = options.width, options.height
        self.window = Window(self, options)
        self._clock = Clock(self)
        if options.mp4:
            self.logs.start(open_video(self, options.mp4, options.mp4fps))

    @property
    def visualizer(self) -> VisualizerCamera:
        """The visualizer's camera, as last moved by the script or by the user in the page."""
        if self.window is not None:
            self.window.camera.pull(self.script_camera)
        return self.script_camera

    @visualizer.setter
    def visualizer(self, camera: VisualizerCamera) -> None:
        self.script_camera = camera

    def follow_clock(self, real_time: bool) -> None:
        """Start or stop stepping in real time."""
        self._clock.run(real_time)

    def close(self) -> None:
        """Close the page, the log files and the world."""
        if self.window is not None:
            self.window.gate.close()
        self._clock.close()
        if self.window is not None:
            self.window.close()
        with self.lock:
            super().close()


def _install() -> None:
    """Add the commands, which hold the lock, to the class."""
    for name, entry in COMMANDS.items():
        if name not in vars(WindowClient):
            setattr(WindowClient, name, _in_turn(entry.function, _AFTERWARDS.get(name)))


def _preview(window: Window, answer: Any) -> None:
    window.previews.store(*answer[2:])


def _aim(window: Window, _: Any) -> None:
    window.aim_new_pages()


_AFTERWARDS: dict[str, Callable[[Window, Any], None]] = {
    "getCameraImage": _preview,
    "resetDebugVisualizerCamera": _aim,
}
"""Function of the window called with a command's result."""


def _in_turn(
    function: Callable[..., Any], afterwards: Callable[[Window, Any], None] | None
) -> Callable[..., Any]:
    is_step = function.__name__ == "stepSimulation"

    @wraps(function)
    def call(client: WindowClient, *args: Any, **options: Any) -> Any:
        if is_step and client.window is not None:
            client.window.before_step()
        with client.lock:
            if is_step and not client._clock.may_step():
                return None
            client.depth += 1
            try:
                answer = function(client, *args, **options)
            finally:
                client.depth -= 1
                client.is_changed = True
            window = client.window
            if window is not None and not client.depth:
                if afterwards is not None:
                    afterwards(window, answer)
                if window.update_requested:
                    window.update()
        return answer

    return call
