"""A drop-in for `pybullet_utils.bullet_client`: a client as an object whose methods know their client."""

from __future__ import annotations

import os
from functools import partial
from inspect import isbuiltin
from typing import Any

import roboyard.pybullet as bullet
from roboyard.pybullet.connections import connect, disconnect, isConnected
from roboyard.pybullet.face.constants import DIRECT, SHARED_MEMORY


class BulletClient:
    """One client; every function of the interface is a method that needs no `physicsClientId`."""

    def __init__(
        self, connection_mode: int | None = None, hostName: str | None = None, options: str = ""
    ) -> None:
        """Connect.

        Args:
            connection_mode: DIRECT, GUI, TCP, ...; None joins a server by shared memory where one runs and
                makes a world of its own otherwise.
            hostName: of the server, for TCP and UDP.
            options: passed on to `connect`.
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
        value = getattr(bullet, name)
        if isbuiltin(value):
            value = partial(value, physicsClientId=self._client)
        if name == "disconnect":
            self._client = -1
        return value

    def __del__(self) -> None:
        if self._client >= 0 and self._pid == os.getpid() and isConnected(self._client):
            disconnect(self._client)
            self._client = -1
