"""connect(SHARED_MEMORY_SERVER): a server in a thread of this process, and its first client."""

from __future__ import annotations

import asyncio
import secrets
import threading

from roboyard.errors import RoboyardError
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.errors import failure
from roboyard.pybullet.remote import rendezvous
from roboyard.pybullet.remote.client import RemoteClient, StreamChannel
from roboyard.pybullet.remote.server import Server
from roboyard.pybullet.state.output_files import OutputFiles

_START_TIMEOUT = 10.0  # s


class SharedMemoryServerClient(RemoteClient):
    """A client that stops its server when it is closed."""

    def __init__(self, channel: StreamChannel, thread: ServerThread) -> None:
        """Create the client of a running server thread."""
        super().__init__(c.SHARED_MEMORY_SERVER, channel)
        self._thread = thread

    def close(self) -> None:
        """Close the connection and the server."""
        super().close()
        self._thread.stop()


class ServerThread:
    """A server on the loopback interface with an event loop of its own.

    Its token is in the file of its key, which only this user reads; its clients may therefore write any file.
    """

    def __init__(self, key: int) -> None:
        """Prepare the server of a key."""
        self._key = key
        self._server = Server(token=secrets.token_urlsafe(18), output_files=OutputFiles())
        self._loop = asyncio.new_event_loop()
        self._leave = asyncio.Event()
        self._started = threading.Event()
        self._problem: RoboyardError | None = None
        self._thread = threading.Thread(target=self._run, name="roboyard server", daemon=True)

    def start(self) -> rendezvous.Address:
        """Start the server and return its address.

        Raises:
            RoboyardError: the server did not start in time, or no port could be opened.
        """
        self._thread.start()
        if not self._started.wait(_START_TIMEOUT):
            raise RoboyardError(f"the server did not start within {_START_TIMEOUT:.0f} s")
        if self._problem is not None:
            raise self._problem
        return self._server.address

    def stop(self) -> None:
        """Stop the server and wait for the thread."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._leave.set)
        self._thread.join(_START_TIMEOUT)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._started.set()
            self._loop.close()

    async def _serve(self) -> None:
        try:
            await self._server.start()
        except RoboyardError as problem:
            self._problem = problem
            return
        with rendezvous.announced(self._key, self._server.address):
            self._started.set()
            await self._leave.wait()
        await self._server.stop()


def open_shared_memory_server(key: int) -> SharedMemoryServerClient:
    """Start a server with a key and return its first client.

    Raises:
        error: the server cannot be started.
    """
    thread = ServerThread(key)
    try:
        address = thread.start()
    except RoboyardError as problem:
        raise failure("Not connected to physics server.", str(problem)) from None
    return SharedMemoryServerClient(StreamChannel(address.host, address.port, address.token), thread)
