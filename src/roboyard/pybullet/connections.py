"""Connections: connect, disconnect, and the registry of open clients."""

from __future__ import annotations

import atexit
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from roboyard.pybullet.client import Client
from roboyard.pybullet.face import constants as c
from roboyard.pybullet.face.direct_calls import close_to_machine_code, forget, open_to_machine_code
from roboyard.pybullet.face.errors import failure, unavailable

if TYPE_CHECKING:
    from roboyard.pybullet.remote.client import RemoteClient

MAX_CLIENTS = 1024
_WINDOW_METHODS = (c.GUI, c.GUI_SERVER, c.GUI_MAIN_THREAD)
_ONE_WINDOW = (
    "Only one local in-process GUI/GUI_SERVER connection allowed. Use DIRECT connection mode or start a "
    "separate GUI physics server (ExampleBrowser, App_SharedMemoryPhysics_GUI, App_SharedMemoryPhysics_VR) "
    "and connect over SHARED_MEMORY, UDP or TCP instead."
)
_UNAVAILABLE = {
    c.GRAPHICS_CLIENT: "images are rendered in this process; use DIRECT or GUI",
    c.GRAPHICS_SERVER: "images are rendered in this process; use DIRECT or GUI",
    c.GRAPHICS_SERVER_TCP: "images are rendered in this process; use DIRECT or GUI",
    c.GRAPHICS_SERVER_MAIN_THREAD: "images are rendered in this process; use DIRECT or GUI",
}


class Clients(dict[int, "Client | RemoteClient"]):
    """Open clients by number."""

    def __missing__(self, number: object) -> Client:
        """Raise an error for a number that is not connected.

        Raises:
            TypeError: the number is not an integer.
            error: otherwise.
        """
        if isinstance(number, bool) or not hasattr(number, "__index__"):
            raise TypeError(f"physicsClientId must be an integer, not {type(number).__name__}")
        if self:
            remedy = f"physicsClientId {number!r} is not connected; connected clients: {sorted(self)}"
        else:
            remedy = "no client is connected; call connect(DIRECT) first"
        raise failure("Not connected to physics server.", remedy)

    def lowest_free(self) -> int:
        """Return the lowest number that is not in use."""
        number = 0
        while number in self:
            number += 1
        return number


CLIENTS = Clients()


def connect(method: int, *args: Any, **kwargs: Any) -> int:
    """Open a connection and return its number, or -1 if no server answers.

    connect(method, key=SHARED_MEMORY_KEY, options="") or
    connect(method, hostName="localhost", port=..., options="").
    DIRECT and GUI create a world in this process, SHARED_MEMORY_SERVER one that other clients can share. GUI
    shows it in the browser. TCP, UDP and SHARED_MEMORY use the world of `roboyard serve`.

    Raises:
        error: the method is unknown or not available, or there are too many connections.
        TypeError: an argument has the wrong type.
    """
    if isinstance(method, bool) or not hasattr(method, "__index__"):
        raise TypeError(f"method must be an integer, not {type(method).__name__}")
    key, host, port, options = _connection_arguments(args, kwargs)
    if len(CLIENTS) >= MAX_CLIENTS:
        raise failure(
            "Exceeding maximum number of physics connections.", f"at most {MAX_CLIENTS}; disconnect some"
        )
    opener = _opener(int(method), key, host, port, options)
    client = opener()
    if client is None:
        return -1
    number = CLIENTS.lowest_free()
    CLIENTS[number] = client
    forget()
    if type(client) is Client:
        open_to_machine_code(number, client)
    return number


def _connection_arguments(args: tuple[Any, ...], kwargs: dict[str, Any]) -> tuple[int, str, int | None, str]:
    """Return (key, host name, port, options) of either calling form."""
    by_host = (args and isinstance(args[0], str)) or "hostName" in kwargs or "port" in kwargs
    names = ("hostName", "port", "options") if by_host else ("key", "options")
    if len(args) > len(names):
        raise TypeError(f"connect() takes at most {len(names) + 1} arguments ({len(args) + 1} given)")
    given: dict[str, Any] = dict(zip(names, args, strict=False))
    for name, value in kwargs.items():
        if name not in names or name in given:
            raise TypeError(f"connect() got an unexpected or repeated argument {name!r}")
        given[name] = value
    wanted: dict[str, type] = {"hostName": str, "port": int, "options": str, "key": int}
    for name, value in given.items():
        if not isinstance(value, wanted[name]):
            raise TypeError(f"connect(): {name} must be {wanted[name].__name__}, not {type(value).__name__}")
    port = given.get("port", -1)
    return (
        given.get("key", c.SHARED_MEMORY_KEY),
        given.get("hostName", "localhost"),
        port if port >= 0 else None,
        given.get("options", ""),
    )


def _opener(
    method: int, key: int, host: str, port: int | None, options: str
) -> Callable[[], Client | RemoteClient | None]:
    if method == c.DIRECT:
        return lambda: _open_world(method)
    if method in _WINDOW_METHODS:
        return lambda: _open_window(method, options)
    if method == c.SHARED_MEMORY_SERVER:
        from roboyard.pybullet.remote.shared_memory_server import open_shared_memory_server

        return lambda: open_shared_memory_server(key)
    if method in (c.TCP, c.UDP, c.SHARED_MEMORY):
        from roboyard.pybullet.remote import client

        if method == c.SHARED_MEMORY:
            return lambda: client.open_by_key(key)
        return lambda: client.open_at(method, host, port, options)
    if method in _UNAVAILABLE:
        raise unavailable(f"connect({method})", _UNAVAILABLE[method])
    raise failure(
        "connectPhysicsServer unexpected argument",
        f"method {method} is unknown; use DIRECT, GUI, TCP, UDP or SHARED_MEMORY",
    )


def _open_world(method: int) -> Client:
    return Client(method)


def _open_window(method: int, options: str) -> Client:
    from roboyard.pybullet.window.opener import open_window

    if any(client.method in (c.GUI, c.GUI_SERVER) for client in CLIENTS.values()):
        raise failure(_ONE_WINDOW)
    return open_window(method, options)


def disconnect(physicsClientId: int = 0) -> None:
    """Close a connection; its number can be reused.

    Raises:
        error: the number is not connected.
    """
    client = CLIENTS[physicsClientId]
    del CLIENTS[physicsClientId]
    try:
        client.close()
    finally:
        close_to_machine_code(physicsClientId)


def isConnected(physicsClientId: int = 0) -> int:
    """Return 1 while the client is connected, else 0."""
    client = CLIENTS.get(physicsClientId)
    return 1 if client is not None and client.is_alive else 0


def getConnectionInfo(physicsClientId: int = 0) -> dict[str, int]:
    """Return `isConnected` (0 or 1) and `connectionMethod` (DIRECT, GUI, ...; 0 when closed)."""
    client = CLIENTS.get(physicsClientId)
    if client is None or not client.is_alive:
        return {"isConnected": 0, "connectionMethod": 0}
    return {"isConnected": 1, "connectionMethod": client.method}


def isNumpyEnabled(physicsClientId: int = 0) -> int:
    """Return 1: images are NumPy arrays."""
    return 1


def getAPIVersion(physicsClientId: int = 0) -> int:
    """Return the version of PyBullet's API that this module implements."""
    return 202010061


@atexit.register
def _close_all() -> None:
    for number in list(CLIENTS):
        disconnect(number)
