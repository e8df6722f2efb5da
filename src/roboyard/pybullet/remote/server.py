"""The server of `roboyard serve`: one world, any number of clients over TCP and UDP."""

from __future__ import annotations

import asyncio
import signal
import sys
from contextlib import suppress

from roboyard.errors import ConfigError, RoboyardError
from roboyard.pybullet.face import wire
from roboyard.pybullet.remote import rendezvous
from roboyard.pybullet.remote.datagrams import DatagramServer
from roboyard.pybullet.remote.dispatch import Dispatcher

MAX_CONNECTIONS = 64
"""Clients, which have sent a valid hello."""
MAX_STRANGERS = 256
"""Connections that have not; the oldest one goes when there are more."""
HELLO_TIMEOUT = 5.0
"""Time in which a client has to send its hello (s)."""
HELLO_BYTES = 256
"""Largest first frame (bytes)."""


class Server:
    """A server on one port for TCP and UDP. Commands of all clients run one after another."""

    def __init__(self, host: str = "127.0.0.1", port: int = 0) -> None:
        """Prepare a server; `start` opens the port.

        Args:
            host: address to listen on.
            port: port; 0 for any free one.
        """
        self.host = host
        self.port = port
        """Port; after `start`, the one in use."""
        self.dispatcher = Dispatcher()
        self._connections: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._strangers: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        """Those of the connections that have not sent their hello yet, oldest first."""
        self._listener: asyncio.Server | None = None
        self._datagrams: asyncio.DatagramTransport | None = None

    async def start(self) -> None:
        """Open the port.

        Raises:
            RoboyardError: the port cannot be opened.
        """
        try:
            self._listener = await asyncio.start_server(self._serve, self.host, self.port)
            self.port = self._listener.sockets[0].getsockname()[1]
            loop = asyncio.get_running_loop()
            self._datagrams, _ = await loop.create_datagram_endpoint(
                lambda: DatagramServer(self.dispatcher), (self.host, self.port)
            )
        except OSError as problem:
            await self.stop()
            raise RoboyardError(
                f"cannot listen on {self.host}:{self.port}: {problem.strerror or problem}; try another --port"
            ) from None

    async def stop(self) -> None:
        """Close the port and the log files."""
        if self._datagrams is not None:
            self._datagrams.close()
        if self._listener is not None:
            self._listener.close()
        for writer in self._connections.values():
            writer.close()
        if self._connections:
            await asyncio.wait(set(self._connections), timeout=1.0)
        self.dispatcher.client.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one client until it disconnects or violates the protocol."""
        task = asyncio.current_task()
        assert task is not None
        self._connections[task] = writer
        try:
            self._strangers[task] = writer
            if len(self._strangers) > MAX_STRANGERS:
                self._strangers.pop(next(iter(self._strangers))).close()
            try:
                async with asyncio.timeout(HELLO_TIMEOUT):
                    wire.check_hello(wire.decode(await _read_body(reader, HELLO_BYTES)))
            except TimeoutError:
                raise wire.WireError(f"no hello within {HELLO_TIMEOUT:g} s") from None
            self._strangers.pop(task, None)
            if len(self._connections) - len(self._strangers) > MAX_CONNECTIONS:
                raise wire.WireError(f"there are already {MAX_CONNECTIONS} clients, the limit")
            writer.write(wire.frame(wire.HELLO))
            while True:
                body = self.dispatcher.answer(wire.decode(await _read_body(reader)))
                writer.write(wire.PREFIX.pack(len(body)))
                writer.write(body)
                await writer.drain()
        except wire.WireError as problem:
            print(f"roboyard serve: a client was refused: {problem}", file=sys.stderr)
            with suppress(ConnectionError):
                writer.write(wire.frame([-1, "error", f"refused: {problem}", []]))
                await writer.drain()
        except (ConnectionError, asyncio.IncompleteReadError):
            pass  # the client disconnected
        finally:
            self._strangers.pop(task, None)
            del self._connections[task]
            writer.close()


async def _read_body(reader: asyncio.StreamReader, largest: int = wire.MAX_BODY) -> bytes:
    length = wire.body_length(await reader.readexactly(wire.PREFIX.size), largest)
    return await reader.readexactly(length)


def serve_forever(*, host: str, port: int, key: int) -> None:
    """Serve until interrupted or terminated; print the address when the port is open.

    Args:
        host: address to listen on.
        port: port; 0 for any free one.
        key: key for connect(SHARED_MEMORY, key).

    Raises:
        ConfigError: the port is out of range.
        RoboyardError: the port cannot be opened.
    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"port must be 0 to 65535, got {port}")
    with suppress(KeyboardInterrupt):
        asyncio.run(_serve_until_signal(host, port, key))


async def _serve_until_signal(host: str, port: int, key: int) -> None:
    server = Server(host, port)
    await server.start()
    leave = asyncio.Event()
    loop = asyncio.get_running_loop()
    for name in ("SIGINT", "SIGTERM"):
        with suppress(NotImplementedError, ValueError):  # Windows, or not the main thread
            loop.add_signal_handler(getattr(signal, name), leave.set)
    with rendezvous.announced(key, server.host, server.port):
        print(f"roboyard serve: connect(TCP, {server.host!r}, {server.port}), key {key}", flush=True)
        await leave.wait()
    await server.stop()
