"""The viser server of a viewer: on this machine only by default, without share links."""

from __future__ import annotations

import atexit
import errno
import logging
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.viewer.page.accessible import make_accessible
from roboyard.viewer.page.every_change import send_every_change
from roboyard.viewer.page.origins import guarded

DEFAULT_PORT = 8080
PORTS_TRIED = 100
"""Ports to try from the requested one on."""


def open_server(host: str, port: int, title: str) -> Any:
    """Start a `viser.ViserServer` with an empty scene, z up.

    Args:
        host: address to listen on.
        port: first port to try; if it is in use, the next free one is used. 0: any free port.
        title: heading of the page's panel.

    Raises:
        MissingExtraError: viser is not installed.
        ConfigError: this machine has no such address, or no port is free.
    """
    viser = load_viser()
    logging.getLogger("websockets.server").addFilter(_is_relevant)
    free = free_port(host, port)

    class Server(viser.ViserServer):
        """Ignores requests of pages for a public tunnel."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            return None

    with _quiet(), guarded(host):
        server = Server(host=host, port=free, label=title, verbose=False)
    # otherwise viser prints a message at exit
    atexit.unregister(server._websock_server.stop)
    atexit.register(stop_server, server)
    server.gui.configure_theme(
        show_logo=False, show_share_button=False, control_width="large", brand_color=(38, 96, 164)
    )
    server.gui.main_panel.dock_right()
    server.scene.world_axes.visible = False
    send_every_change(server)
    make_accessible(server)
    return server


def _is_relevant(record: logging.LogRecord) -> bool:
    """Return False for messages about connections that a browser opened in advance and dropped."""
    return record.getMessage() != "opening handshake failed"


def stop_server(server: Any) -> None:
    """Stop a server; open pages show that they are disconnected."""
    with _quiet():
        server.stop()


def free_port(host: str, port: int) -> int:
    """Return the first free port from `port` on; 0 stays 0.

    Raises:
        ConfigError: `port` is out of range, this machine has no such address, or all tried ports are in use.
    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"port {port}: choose a number from 0 to 65535")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (socket.gaierror, UnicodeError) as error:
        raise ConfigError(f"host {host!r}: no such address ({error})") from error
    last = min(port + PORTS_TRIED, 65536) if port else 1
    for candidate in range(port, last):
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address[0], candidate, *address[2:]))
            except OSError as error:
                if error.errno in (errno.EADDRINUSE, errno.EACCES):
                    continue
                raise ConfigError(f"host {host!r}: cannot listen there ({error.strerror})") from error
            return candidate
    raise ConfigError(
        f"no free port from {port} to {last - 1}; choose another number, or 0 for any free port"
    )


def load_viser() -> Any:
    """Import viser.

    Raises:
        MissingExtraError: viser is not installed.
    """
    try:
        import viser
    except ImportError as error:
        raise MissingExtraError("viser", "gui", "the viewer") from error
    return viser


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress viser's output about its address; a viewer prints its own."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
