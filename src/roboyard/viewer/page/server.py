"""The web server behind a viewer: viser, on this machine only unless told otherwise, without share links."""

from __future__ import annotations

import atexit
import errno
import logging
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from roboyard.errors import ConfigError, MissingExtraError
from roboyard.viewer.page.origins import guarded

DEFAULT_PORT = 8080
PORTS_TRIED = 100


def open_server(host: str, port: int, title: str) -> Any:
    """A started `viser.ViserServer` with an empty scene, z up.

    Args:
        host: address to listen at.
        port: first port to try; the next free one is taken where it is in use. 0: any free one.
        title: heading of the page's panel.

    Raises:
        MissingExtraError: viser is not installed.
        ConfigError: nothing can listen at this address, or no port is free.
    """
    viser = load_viser()
    logging.getLogger("websockets.server").addFilter(_is_worth_saying)
    free = free_port(host, port)

    class Server(viser.ViserServer):
        """Never opens a tunnel to the outside, whatever a page asks for."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            return None

    with _quiet(), guarded(host):
        server = Server(host=host, port=free, label=title, verbose=False)
    # at exit viser would say that it stops
    atexit.unregister(server._websock_server.stop)
    atexit.register(stop_server, server)
    server.gui.configure_theme(
        show_logo=False, show_share_button=False, control_width="large", brand_color=(38, 96, 164)
    )
    server.gui.main_panel.dock_right()
    server.scene.world_axes.visible = False
    return server


def _is_worth_saying(record: logging.LogRecord) -> bool:
    """Not of browsers that open a connection ahead of need and drop it."""
    return record.getMessage() != "opening handshake failed"


def stop_server(server: Any) -> None:
    """Stop it; pages that are open say that they lost it."""
    with _quiet():
        server.stop()


def free_port(host: str, port: int) -> int:
    """The first port from `port` on that can be listened at; 0 stays 0.

    Raises:
        ConfigError: this machine has no such address, or every port that was tried is in use.
    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"port {port}: give a number from 0 to 65535")
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
    raise ConfigError(f"no free port from {port} to {last - 1}; name another with port=0 or a higher number")


def load_viser() -> Any:
    """The module viser.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import viser
    except ImportError as error:
        raise MissingExtraError("viser", "gui", "the viewer") from error
    return viser


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep viser's own words about its address out of the output; a viewer says its own."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
