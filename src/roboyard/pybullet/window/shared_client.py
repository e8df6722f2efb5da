"""A client that commands, the window and the clock use in turn."""

from __future__ import annotations

import threading

from roboyard.pybullet.client import Client
from roboyard.pybullet.state.visualizer_camera import VisualizerCamera


class SharedClient(Client):
    """A client with a lock, so that neither window nor clock ever sees a half-finished command."""

    def __init__(self, method: int) -> None:
        """Create the client.

        Args:
            method: connection method (GUI, GUI_SERVER, ...).
        """
        self.lock = threading.RLock()
        self.depth = 0
        """Number of nested commands that are running; changes only under the lock."""
        self.is_changed = True
        """Whether commands ran since the window last updated."""
        self.script_camera = VisualizerCamera()
        """The visualizer's camera without the moves of the page."""
        super().__init__(method)
