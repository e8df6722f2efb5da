"""A client of a server: the commands of the table, each a request and its answer."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face import wire
from roboyard.pybullet.face.arguments import number
from roboyard.pybullet.face.commands import COMMANDS
from roboyard.pybullet.face.errors import error, failure
from roboyard.pybullet.remote import rendezvous
from roboyard.pybullet.remote.datagrams import DatagramChannel
from roboyard.pybullet.remote.user_data_cache import UserDataCache
from roboyard.pybullet.state.user_data import UserDataKey

DEFAULT_PORTS = {c.TCP: 6667, c.UDP: 6667}
CONNECT_SECONDS = 5.0


class Channel(Protocol):
    """Something that carries a body there and the answer back."""

    timeout: float | None
    """s to wait for an answer; None for as long as it takes."""

    def exchange(self, body: bytes) -> bytes:
        """The answer to a request; OSError where there is none."""
        ...

    def close(self) -> None: ...


class StreamChannel:
    """Frames over TCP."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), timeout=CONNECT_SECONDS)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.timeout: float | None = CONNECT_SECONDS
        wire.check_hello(wire.decode(self.exchange(wire.encode(wire.HELLO))))
        self.timeout = None

    def exchange(self, body: bytes) -> bytes:
        self._socket.settimeout(self.timeout)
        self._socket.sendall(wire.PREFIX.pack(len(body)) + body)
        return self._receive(wire.body_length(self._receive(wire.PREFIX.size)))

    def close(self) -> None:
        self._socket.close()

    def _receive(self, count: int) -> bytes:
        data = bytearray(count)
        view = memoryview(data)
        while view:
            got = self._socket.recv_into(view)
            if not got:
                raise ConnectionError("the server closed the connection")
            view = view[got:]
        return bytes(data)


class RemoteClient:
    """Every command of the table is a method that asks the server."""

    def __init__(self, method: int, channel: Channel) -> None:
        self.method = method
        self.is_alive = True
        self._channel = channel
        self._requests = 0
        self.user_data_cache = UserDataCache(self.ask)

    def ask(self, name: str, *arguments: Any) -> Any:
        """The answer to a command.

        Raises:
            error: the command failed there, or the server is gone.
            TypeError: wrong arguments.
        """
        if not self.is_alive:
            raise self._lost("the connection was lost before")
        self._requests += 1
        try:
            answer = wire.decode(self._channel.exchange(wire.encode([self._requests, name, arguments])))
        except (OSError, wire.WireError) as problem:
            self.is_alive = False
            self._channel.close()
            raise self._lost(str(problem)) from None
        match answer:
            case [int(), "ok", result]:
                return wire.tupled(result)
            case [int(), "error", str(message), list(notes)]:
                raise failure(message, *map(str, notes))
            case [int(), "type", str(message), _]:
                raise TypeError(message)
            case _:
                raise self._lost("the server sent something else than an answer")

    def addUserData(self, body: int, key: str, value: str, link: int = -1, shape: int = -1) -> int:
        """See `roboyard.pybullet.api.user_data`; entries of others are known after a sync."""
        return self.user_data_cache.add(body, key, value, link, shape)

    def getUserData(self, number: int) -> bytes | None:
        return self.user_data_cache.value(number)

    def getUserDataId(self, body: int, key: str, link: int = -1, shape: int = -1) -> int:
        return self.user_data_cache.find(UserDataKey(body, link, shape, key))

    def getNumUserData(self, body: int) -> int:
        return len(self.user_data_cache.of_body(body))

    def getUserDataInfo(self, body: int, index: int) -> tuple[int, bytes, int, int, int]:
        return self.user_data_cache.info(body, index)

    def removeUserData(self, number: int) -> None:
        self.user_data_cache.remove(number)

    def syncUserData(self, bodies: int | Iterable[int] = -1) -> None:
        self.user_data_cache.sync(bodies)

    def removeBody(self, body: int) -> None:
        self.ask("removeBody", body)
        self.user_data_cache.forget([body])

    def resetSimulation(self, flags: int = 0) -> None:
        self.ask("resetSimulation", flags)
        self.user_data_cache.clear()

    def setTimeOut(self, timeOutInSeconds: float) -> None:
        """How long to wait for an answer; s."""
        seconds = number(timeOutInSeconds)
        if seconds >= 0:
            self._channel.timeout = seconds

    def close(self) -> None:
        """Leave the server running and close the connection."""
        self.is_alive = False
        self._channel.close()

    def _lost(self, why: str) -> error:
        return failure(
            "Not connected to physics server.", f"the server is gone: {why}; disconnect and connect again"
        )


def _forwarder(name: str) -> Callable[..., Any]:
    def forward(self: RemoteClient, *arguments: Any) -> Any:
        return self.ask(name, *arguments)

    forward.__name__ = name
    return forward


for _name in COMMANDS:
    if not hasattr(RemoteClient, _name):
        setattr(RemoteClient, _name, _forwarder(_name))


def open_at(method: int, host: str, port: int | None) -> RemoteClient | None:
    """A client of the server at an address; None, and a line on standard error, where none answers."""
    address = host, DEFAULT_PORTS[method] if port is None else port
    try:
        channel = StreamChannel(*address) if method == c.TCP else DatagramChannel(*address)
    except (OSError, wire.WireError) as problem:
        print(
            f"roboyard: no server at {host}:{address[1]} ({problem}); start `roboyard serve`", file=sys.stderr
        )
        return None
    return _greeted(RemoteClient(method, channel))


def _greeted(client: RemoteClient) -> RemoteClient:
    """A new client that knows what user data there is."""
    client.user_data_cache.sync(-1)
    return client


def open_by_key(key: int) -> RemoteClient | None:
    """A client of the server on this machine that goes by a key; None where there is none."""
    address = rendezvous.find(key)
    if address is None:
        return None
    try:
        return _greeted(RemoteClient(c.SHARED_MEMORY, StreamChannel(*address)))
    except (OSError, wire.WireError):
        return None
