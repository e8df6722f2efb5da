"""Replacement for `pybullet_utils.bullet_client`: a client as an object."""

from __future__ import annotations

import os
from functools import partial
from types import BuiltinFunctionType
from typing import Any

import roboyard.pybullet as bullet
from roboyard.pybullet.connections import connect, disconnect, isConnected
from roboyard.pybullet.face.constants import DIRECT, SHARED_MEMORY


class BulletClient:
    """A client; every function of the API is a method without `physicsClientId`."""

    def __init__(
        self, connection_mode: int | None = None, hostName: str | None = None, options: str = ""
    ) -> None:
        """Connect.

        Args:
            connection_mode: DIRECT, GUI, TCP, ...; None connects to a server by shared memory if one is
                running, otherwise DIRECT.
            hostName: host of the server, for TCP and UDP.
            options: options of `connect`.

        Raises:
            error: the connection cannot be opened.
        """
        self._client = -1
        self._pid = os.getpid()
        self._shapes: dict[Any, Any] = {}
        if connection_mode is None:
            self._client = connect(SHARED_MEMORY, options=options)
            if self._client >= 0:
                return
            connection_mode = DIRECT
        if hostName is None:
            self._client = connect(connection_mode, options=options)
        else:
            self._client = connect(connection_mode, hostName=hostName, options=options)

    def __getattr__(self, name: str) -> Any:
        """Return a constant, or a function bound to this client.

        Raises:
            AttributeError: the API has no such name.
        """
        value = getattr(bullet, name)
        if isinstance(value, BuiltinFunctionType):
            value = partial(value, physicsClientId=self._client)
        if name == "disconnect":
            self._client = -1
        return value

    def __del__(self) -> None:
        """Disconnect, unless this is a forked process."""
        if self._client >= 0 and self._pid == os.getpid() and isConnected(self._client):
            disconnect(self._client)
            self._client = -1
