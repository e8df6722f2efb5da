"""A client of a server: every command is a request and a response."""

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
from roboyard.pybullet.remote.access import token_of
from roboyard.pybullet.remote.datagram_channel import DatagramChannel
from roboyard.pybullet.remote.user_data_cache import UserDataCache
from roboyard.pybullet.state.user_data import UserDataKey
from roboyard.untrusted.text import one_line, printable

DEFAULT_PORTS = {c.TCP: 6667, c.UDP: 6667}
CONNECT_SECONDS = 5.0
MAX_HELLO_ANSWER = 1024
"""Longest answer to a greeting (bytes)."""


class Channel(Protocol):
    """A transport of requests and responses."""

    timeout: float | None
    """Time to wait for a response (s); None for no limit."""

    def exchange(self, body: bytes) -> bytes:
        """Return the response to a request.

        Raises:
            OSError: there is no response.
        """
        ...

    def close(self) -> None:
        """Close the transport."""
        ...


class StreamChannel:
    """Frames over TCP."""

    def __init__(self, host: str, port: int, token: str = "") -> None:
        """Connect and exchange greetings.

        Args:
            host: name or address of the server.
            port: its port.
            token: its token; "" for none.

        Raises:
            OSError: there is no server.
            WireError: the server uses another protocol.
        """
        self._socket = socket.create_connection((host, port), timeout=CONNECT_SECONDS)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.timeout: float | None = CONNECT_SECONDS
        self._largest = MAX_HELLO_ANSWER
        try:
            self._check_answer(wire.decode(self.exchange(wire.encode(wire.hello(token)))))
        except BaseException:
            self._socket.close()
            raise
        self._largest = wire.MAX_BODY
        self.timeout = None

    def exchange(self, body: bytes) -> bytes:
        """Return the response to a request.

        Raises:
            OSError: the connection failed.
            WireError: the response is too long.
        """
        self._socket.settimeout(self.timeout)
        self._socket.sendall(wire.PREFIX.pack(len(body)) + body)
        return self._receive(wire.body_length(self._receive(wire.PREFIX.size), self._largest))

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _check_answer(self, answer: Any) -> None:
        match answer:
            case [int(), "error", str(message), *_]:
                raise wire.WireError(one_line(message))
        wire.check_hello(answer)

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
    """A client of a server; every command of the table is a method that sends a request."""

    def __init__(self, method: int, channel: Channel) -> None:
        """Create a client of an open channel."""
        self.method = method
        self.is_alive = True
        self._channel = channel
        self._requests = 0
        self.user_data_cache = UserDataCache(self.ask)

    def ask(self, name: str, *arguments: Any) -> Any:
        """Return the result of a command.

        Raises:
            error: the command failed on the server, or the connection is lost.
            TypeError: an argument has the wrong type.
        """
        if not self.is_alive:
            raise self._lost(f"the connection was lost before {name}")
        self._requests += 1
        try:
            answer = wire.decode(self._channel.exchange(wire.encode([self._requests, name, arguments])))
        except (OSError, wire.WireError) as problem:
            self.is_alive = False
            self._channel.close()
            raise self._lost(str(problem)) from None
        match answer:
            case [int(), "ok", result]:
                try:
                    return wire.tupled(result)
                except RecursionError:
                    raise self._lost("the response is nested too deeply") from None
            case [int(), "error", str(message), list(notes)]:
                raise failure(printable(message), *(printable(str(note)) for note in notes))
            case [int(), "type", str(message), _]:
                raise TypeError(printable(message))
            case _:
                raise self._lost(f"the response is not valid: {wire.shortened(answer)}")

    def addUserData(self, body: int, key: str, value: str, link: int = -1, shape: int = -1) -> int:
        """Add an entry; see `api.user_data`. Entries of other clients are visible after syncUserData."""
        return self.user_data_cache.add(body, key, value, link, shape)

    def getUserData(self, number: int) -> bytes | None:
        """Return the text of an entry, or None."""
        return self.user_data_cache.value(number)

    def getUserDataId(self, body: int, key: str, link: int = -1, shape: int = -1) -> int:
        """Return the id of an entry, or -1."""
        return self.user_data_cache.find(UserDataKey(body, link, shape, key))

    def getNumUserData(self, body: int) -> int:
        """Return the number of entries of a body."""
        return len(self.user_data_cache.of_body(body))

    def getUserDataInfo(self, body: int, index: int) -> tuple[int, bytes, int, int, int]:
        """Return id, key, body, link and visual shape of a body's i-th entry."""
        return self.user_data_cache.info(body, index)

    def removeUserData(self, number: int) -> None:
        """Remove an entry."""
        self.user_data_cache.remove(number)

    def syncUserData(self, bodies: int | Iterable[int] = -1) -> None:
        """Fetch the entries of bodies from the server; all for -1."""
        self.user_data_cache.sync(bodies)

    def removeBody(self, body: int) -> None:
        """Remove a body and its cached user data."""
        self.ask("removeBody", body)
        self.user_data_cache.forget([body])

    def resetSimulation(self, flags: int = 0) -> None:
        """Reset the simulation and the cached user data."""
        self.ask("resetSimulation", flags)
        self.user_data_cache.clear()

    def setTimeOut(self, timeOutInSeconds: float) -> None:
        """Set the time to wait for a response (s); negative values are ignored."""
        seconds = number(timeOutInSeconds)
        if seconds >= 0:
            self._channel.timeout = seconds

    def close(self) -> None:
        """Close the connection; the server keeps running."""
        self.is_alive = False
        self._channel.close()

    def _lost(self, why: str) -> error:
        return failure(
            "Not connected to physics server.", f"the connection is lost: {why}; disconnect and connect again"
        )


def _forwarder(name: str) -> Callable[..., Any]:
    def forward(self: RemoteClient, *arguments: Any) -> Any:
        return self.ask(name, *arguments)

    forward.__name__ = name
    return forward


for _name in COMMANDS:
    if not hasattr(RemoteClient, _name):
        setattr(RemoteClient, _name, _forwarder(_name))


def open_at(method: int, host: str, port: int | None, options: str = "") -> RemoteClient | None:
    """Return a client of the server at an address; if there is none, print a message and return None.

    Args:
        method: TCP or UDP.
        host: name or address of the server.
        port: its port; None for the default.
        options: "--token=TOKEN" for a server with a token.
    """
    token = token_of(options)
    address = host, DEFAULT_PORTS[method] if port is None else port
    try:
        channel = StreamChannel(*address, token) if method == c.TCP else DatagramChannel(*address, token)
    except (OSError, OverflowError, UnicodeError, wire.WireError) as problem:  # the latter: odd ports, names
        print(
            f"roboyard: no server at {host}:{address[1]} ({problem}); start `roboyard serve`", file=sys.stderr
        )
        return None
    return _synchronized(RemoteClient(method, channel))


def _synchronized(client: RemoteClient) -> RemoteClient:
    """Return a new client after fetching the server's user data."""
    client.user_data_cache.sync(-1)
    return client


def open_by_key(key: int) -> RemoteClient | None:
    """Return a client of the server with a key on this machine, or None."""
    address = rendezvous.find(key)
    if address is None:
        return None
    try:
        channel = StreamChannel(address.host, address.port, address.token)
    except (OSError, UnicodeError):  # it has ended
        return None
    except wire.WireError as problem:
        print(f"roboyard: the server of key {key} refuses: {problem}", file=sys.stderr)
        return None
    return _synchronized(RemoteClient(c.SHARED_MEMORY, channel))
