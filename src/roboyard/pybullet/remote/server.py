"""The server of `roboyard serve`: one world, any number of clients over TCP and UDP."""

from __future__ import annotations

import asyncio
import signal
from contextlib import suppress
from pathlib import Path

from roboyard.errors import ConfigError, RoboyardError
from roboyard.pybullet.face import wire
from roboyard.pybullet.remote import rendezvous
from roboyard.pybullet.remote.access import server_token
from roboyard.pybullet.remote.byte_budget import ByteBudget, give_back
from roboyard.pybullet.remote.datagrams import DatagramServer
from roboyard.pybullet.remote.dispatch import Dispatcher
from roboyard.pybullet.state.output_files import OutputFiles
from roboyard.untrusted.repeated import RepeatedNotices

MAX_CONNECTIONS = 64
"""Clients, which have sent a valid hello."""
MAX_STRANGERS = 256
"""Connections that have not; the oldest one goes when there are more."""
HELLO_TIMEOUT = 5.0
"""Time in which a client has to send its hello (s)."""
FRAME_TIMEOUT = 60.0
"""Time in which a frame has to arrive once it began, and in which a client has to take its answer (s)."""


class Server:
    """A server on one port for TCP and UDP. Commands of all clients run one after another."""

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        token: str = "",
        output_files: OutputFiles | None = None,
    ) -> None:
        """Prepare a server; `start` opens the port.

        Args:
            host: address to listen on.
            port: port; 0 for any free one.
            token: what a client's greeting has to bring; "" for nothing.
            output_files: where commands may write; nowhere by default.
        """
        self.host = host
        self.port = port
        """Port; after `start`, the one in use."""
        self.dispatcher = Dispatcher(output_files)
        self._token = token
        self._budget = ByteBudget()
        self._notices = RepeatedNotices("roboyard serve")
        self._connections: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._strangers: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        """Those of the connections that have not sent their hello yet, oldest first."""
        self._listener: asyncio.Server | None = None
        self._datagrams: asyncio.DatagramTransport | None = None

    @property
    def address(self) -> rendezvous.Address:
        """Host, port and token."""
        return rendezvous.Address(host=self.host, port=self.port, token=self._token)

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
                lambda: DatagramServer(
                    self.dispatcher, token=self._token, budget=self._budget, notices=self._notices
                ),
                (self.host, self.port),
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
                    greeting = await self._read(reader, wire.HELLO_BYTES)
                wire.check_hello(wire.decode(greeting), self._token)
            except TimeoutError:
                raise wire.WireError(f"no hello within {HELLO_TIMEOUT:g} s") from None
            self._strangers.pop(task, None)
            if len(self._connections) - len(self._strangers) > MAX_CONNECTIONS:
                raise wire.WireError(f"there are already {MAX_CONNECTIONS} clients, the limit")
            writer.write(wire.frame(wire.HELLO))
            while True:
                await self._answer(reader, writer)
        except wire.WireError as problem:
            self._notices.say("a client was refused", str(problem))
            with suppress(ConnectionError, TimeoutError):
                writer.write(wire.frame([-1, "error", f"refused: {problem}", []]))
                async with asyncio.timeout(HELLO_TIMEOUT):
                    await writer.drain()
        except (OSError, asyncio.IncompleteReadError):
            pass  # the client disconnected, or does not take its answer
        finally:
            self._strangers.pop(task, None)
            del self._connections[task]
            writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Read one request, execute it and send the response."""
        request = await self._read(reader, wire.MAX_BODY)
        size = len(request)
        message = wire.decode(request)
        del request
        body = self.dispatcher.answer(message)
        del message
        writer.write(wire.PREFIX.pack(len(body)))
        writer.write(body)
        size = max(size, len(body))
        del body
        async with asyncio.timeout(FRAME_TIMEOUT):
            await writer.drain()
        give_back(size)

    async def _read(self, reader: asyncio.StreamReader, largest: int) -> bytes:
        """Read one frame, whose memory counts while it arrives."""
        length = wire.body_length(await reader.readexactly(wire.PREFIX.size), largest)
        self._budget.reserve(length)
        try:
            async with asyncio.timeout(FRAME_TIMEOUT):
                return await reader.readexactly(length)
        finally:
            self._budget.release(length)


def serve_forever(
    *, host: str, port: int, key: int, folder: Path | None = None, token: str | None = None
) -> None:
    """Serve until interrupted or terminated; print the address when the port is open.

    Args:
        host: address to listen on.
        port: port; 0 for any free one.
        key: key for connect(SHARED_MEMORY, key).
        folder: folder in which clients may write; it is made where it does not exist. None for nowhere.
        token: what clients have to give; None for a new one where others reach the address, else for none.

    Raises:
        ConfigError: the port is out of range, the token cannot be one, or the folder cannot be made.
        RoboyardError: the port cannot be opened.
    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"port must be 0 to 65535, got {port}")
    if folder is not None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            folder = folder.resolve(strict=True)
        except (OSError, RuntimeError) as problem:
            reason = getattr(problem, "strerror", None) or problem
            raise ConfigError(f"--folder {folder}: {reason}; name a folder") from None
    server = Server(
        host,
        port,
        token=server_token(host, token or ""),
        output_files=OutputFiles(is_free=False, folder=folder),
    )
    with suppress(KeyboardInterrupt):
        asyncio.run(_serve_until_signal(server, key))


async def _serve_until_signal(server: Server, key: int) -> None:
    await server.start()
    leave = asyncio.Event()
    loop = asyncio.get_running_loop()
    for name in ("SIGINT", "SIGTERM"):
        with suppress(NotImplementedError, ValueError):  # Windows, or not the main thread
            loop.add_signal_handler(getattr(signal, name), leave.set)
    address = server.address
    with rendezvous.announced(key, address):
        token = f", options='--token={address.token}'" if address.token else ""
        print(f"roboyard serve: connect(TCP, {address.host!r}, {address.port}{token}), key {key}", flush=True)
        await leave.wait()
    await server.stop()
